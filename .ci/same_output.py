"""Compare what a command printed with what the README shows: the same words, the same figures.

Figures may differ by 1 %, since processors round differently and residuals of 1e-7 mm show it;
seconds are not compared. Prints the lines that differ and exits with 1.
"""

import math
import re
import sys
from pathlib import Path

NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
TOLERANCE = 0.01


def same(shown: str, printed: str) -> bool:
    """Whether two lines have the same words, and figures within the tolerance."""
    words = [" ".join(NUMBER.sub("#", line).split()) for line in (shown, printed)]
    figures = [[float(text) for text in NUMBER.findall(line)] for line in (shown, printed)]
    return words[0] == words[1] and all(
        math.isclose(a, b, rel_tol=TOLERANCE) for a, b in zip(*figures, strict=True)
    )


def main(shown: Path, printed: Path) -> int:
    """Compare two files line by line."""
    lines = [
        re.sub(r"(?m)^\d+ s;", "N s;", path.read_text()).splitlines() for path in (shown, printed)
    ]
    if len(lines[0]) != len(lines[1]):
        print(f"README shows {len(lines[0])} lines, the command printed {len(lines[1])}")
        return 1
    differing = [pair for pair in zip(*lines, strict=True) if not same(*pair)]
    for pair in differing:
        print("< {}\n> {}".format(*pair))
    return int(bool(differing))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
