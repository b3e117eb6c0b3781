"""Commands keep the memory that they have freed.

The C library gives large arrays back to the system as soon as they are freed, and the system fills
each new one with zeros first, page by page: a twentieth of the processor time of a build. Copies of
the process do as it does. Arrays beyond LARGE still go back at once. All threads share one store:
with one each they would keep what the others need, a quarter more memory in the verification.
"""

import ctypes
import sys

# mallopt(3): from which size on an array is mapped for itself, how much free memory is kept, and
# how many stores there are.
M_MMAP_THRESHOLD, M_TRIM_THRESHOLD, M_ARENA_MAX = -3, -1, -8
LARGE = 32 << 20  # bytes, the most that the GNU C library takes
KEPT = 1 << 30  # bytes


def keep_freed_memory() -> None:
    """Use freed memory again instead of giving it back; other systems than Linux are left alone."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        mallopt(M_MMAP_THRESHOLD, LARGE)
        mallopt(M_TRIM_THRESHOLD, KEPT)
        mallopt(M_ARENA_MAX, 1)
