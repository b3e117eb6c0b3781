"""The version of tbcad: the one record of it; and when a process loaded it."""

from time import time

__version__ = "0.1.0"
LOADED = time()
"""When this process began with tbcad, s of the clock: newer code is not what it runs."""
