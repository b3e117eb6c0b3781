"""The error that ends a verification before it has a result."""

from __future__ import annotations


class BadExport(Exception):
    """The folder is not a readable tbcad build: nothing is verified and nothing is written.

    The message is one line that names the file, what is wrong, what is allowed and what to do.
    """
