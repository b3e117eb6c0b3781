"""Memory of commands: garbage is collected seldom, and freed memory is kept."""

import gc
import sys

# Objects that are made before the first look for garbage, and looks before those at older objects.
# What commands load stays to their end, and is much: looking for garbage among it again and again
# takes an eighth of the time in which bad input is refused.
gc.set_threshold(100_000, 20, 20)

# mallopt(3): from which size on an array is mapped for itself, how much free memory is kept, and
# how many stores there are.
M_MMAP_THRESHOLD, M_TRIM_THRESHOLD, M_ARENA_MAX = -3, -1, -8
LARGE = 32 << 20  # bytes, the most that the GNU C library takes
KEPT = 1 << 30  # bytes


def keep_freed_memory() -> None:
    """Use freed memory again instead of giving it back; other systems than Linux are left alone.

    The system fills each new array with zeros first, page by page: a twentieth of the processor
    time of a build. Arrays beyond LARGE still go back at once. All threads share one store: with
    one each they would keep what the others need, a quarter more memory in the verification.
    """
    import ctypes

    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        mallopt(M_MMAP_THRESHOLD, LARGE)
        mallopt(M_TRIM_THRESHOLD, KEPT)
        mallopt(M_ARENA_MAX, 1)
