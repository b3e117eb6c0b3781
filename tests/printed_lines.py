"""Compare what a command printed with what a page shows: the same words, the same figures.

    python3 tests/printed_lines.py SHOWN PRINTED

compares two files line by line, but for the seconds that a command took, prints the lines that
differ, and exits with 1 if there are any. Needs nothing but Python.
"""

import math
import re
import sys
from pathlib import Path

NUMBER = re.compile(r"(\d+(?:\.(\d+))?)(?:e([+-]?\d+))?")
SECONDS = re.compile(r"^\d+ s;")
TOLERANCE = 0.01


def same(shown: str, printed: str) -> bool:
    """Whether two lines have the same words, and figures that differ by rounding at most."""
    words = [" ".join(NUMBER.sub("#", line).split()) for line in (shown, printed)]
    figures = [list(NUMBER.finditer(line)) for line in (shown, printed)]
    return words[0] == words[1] and all(map(near, *figures))


def near(shown: re.Match[str], printed: re.Match[str]) -> bool:
    """Whether two figures are the same but for rounding; numbers of things are not rounded.

    Processors round differently: by 1 %, or one unit of the last decimal.
    """
    _, decimals, exponent = shown.groups()
    unit = 1.001 * 10.0 ** (int(exponent or 0) - len(decimals)) if decimals else 0.0
    return math.isclose(float(shown[0]), float(printed[0]), rel_tol=TOLERANCE, abs_tol=unit)


def main(shown: Path, printed: Path) -> int:
    """Compare two files line by line."""
    lines = [file.read_text(encoding="utf-8").splitlines() for file in (shown, printed)]
    if len(lines[0]) != len(lines[1]):
        print(f"{len(lines[0])} lines are shown, {len(lines[1])} were printed")
        return 1
    pairs = [tuple(SECONDS.sub("N s;", line) for line in pair) for pair in zip(*lines, strict=True)]
    differing = [pair for pair in pairs if not same(*pair)]
    for pair in differing:
        print("< {}\n> {}".format(*pair))
    return int(bool(differing))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
