"""The version of tbcad: the one record of it."""

__version__ = "0.1.0"
