"""The run of a verification: stages, their processes and their results."""
