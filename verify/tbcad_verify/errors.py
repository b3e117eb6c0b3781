"""What goes wrong before a proof can start."""

from __future__ import annotations


class BadExport(Exception):
    """The folder is no readable tbcad export: nothing can be proved and nothing is written.

    The message is one line that names the file, what is wrong, what is allowed and what to do.
    """
