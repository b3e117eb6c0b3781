"""Manufacturing processes and the errors that they bring."""
