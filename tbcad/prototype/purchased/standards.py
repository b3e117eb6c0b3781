"""Standards that descriptions of parts name."""

import re

# A body, a number with its part, and a letter of its form, such as "DIN 705 A" or "ISO 3290-1".
STANDARD = re.compile(r"\b(?:ISO|DIN|EN|IEC|ASME|ANSI) (?:[A-Z]+)?\d+(?:[.-]\d+)*(?: [A-Z](?= ))?")


def standard_in(what: str) -> str:
    """The first standard that a description names; empty without any."""
    found = STANDARD.search(what)
    return found[0] if found else ""
