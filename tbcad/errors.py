"""The one error a user can cause."""


class InputError(Exception):
    """Bad input: its text is one line for the screen; commands end with exit code 2."""
