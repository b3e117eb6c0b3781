"""The error that a user can cause, the one that a system can, and the one warning."""


def one_line(text: str) -> str:
    """Return text with line breaks and all that a screen would not show written as escapes."""
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text
    )


class InputError(Exception):
    """Bad input: its text is one line for the screen; commands end with exit code 2."""

    def __init__(self, text: str) -> None:
        """Keep the text, made one line: parts of it may come from a file or a path."""
        super().__init__(one_line(text))


class ProcessLost(RuntimeError):
    """A process of a command's own ended before its work was done, as where memory is short."""


class PlausibilityWarning(UserWarning):
    """Input that is allowed but unlikely to be meant; commands show it in one line and go on."""

    def __init__(self, text: str) -> None:
        """Keep the text, made one line: parts of it may come from a file or a path."""
        super().__init__(one_line(text))
