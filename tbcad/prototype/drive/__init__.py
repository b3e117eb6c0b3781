"""The drive of the base and its loads."""
