"""Commands use the memory again that they have freed."""

import subprocess
import sys

import pytest

# Page faults while arrays of 16 MB are made and freed again and again.
FAULTS = """
import resource, sys
import numpy as np
from tbcad.app.cli.memory import keep_freed_memory
if sys.argv[1] == "kept":
    keep_freed_memory()
for count in range(60):
    if count == 10:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    many = [np.full(1 << 18, count, dtype=np.float64) for _ in range(8)]
    del many
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="of the GNU C library")
def test_freed_memory_is_used_again() -> None:
    """Without it every array is filled with zeros by the system, page by page, once more."""
    given_back, kept = (
        int(subprocess.check_output([sys.executable, "-c", FAULTS, word]))
        for word in ("given back", "kept")
    )
    assert kept < given_back / 10
