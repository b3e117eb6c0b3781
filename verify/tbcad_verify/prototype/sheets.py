"""Drawings as PDF: what is written on them is paper, what a viewer does with them is not.

A PDF may run scripts, open addresses, hold other files, or scale its page. So its objects are
those that tbcad writes, and its page shows lines and texts at full size of the paper, whose frame
is where ISO 5457 has it. Source: ISO 32000-1, chapters 7 to 9.
"""

from __future__ import annotations

import math
import re

from tbcad_verify.record.files import FileBytes

NUMBER = r"-?\d+(?:\.\d+)?"
TEXT = r"\((?:[^()\\\n]|\\[()\\])*\)"
OBJECTS = (
    "<</Type/Catalog/Pages 2 0 R>>",
    "<</Type/Pages/Kids[3 0 R]/Count 1>>",
    "<</Type/Page/Parent 2 0 R/MediaBox[0 0 @ @]/Contents 5 0 R/Resources<</Font<</F1 4 0 R>>>>>>",
    "<</Type/Font/Subtype/Type1/BaseFont/Helvetica/Encoding/WinAnsiEncoding>>",
    "<</Length #>>\nstream\n1 J 1 j\n2.8346 0 0 2.8346 0 0 cm\n%\nendstream",
    "<</Title$>>",
)
TABLE = r"xref\n0 7\n(?:\d{10} \d{5} [nf] \n){7}"
TRAILER = "trailer\n<</Size 7/Root 1 0 R/Info 6 0 R>>\nstartxref\n#\n%%EOF\n"
PLACES = {"@": rf"({NUMBER})", "#": r"\d+", "%": r"([^\0]*)", "$": TEXT}
FRAME = re.compile(
    rf"{NUMBER} w \[\] 0 d 20 10 m ({NUMBER}) 10 l \1 ({NUMBER}) l 20 \2 l h S",
)
LINE = re.compile(
    rf"{NUMBER} w \[[\d. ]*\] 0 d [-\d. mlch]+ S"
    rf"|BT /F1 {NUMBER} Tf (?:{NUMBER} ){{6}}Tm {TEXT} Tj ET"
)
HIDDEN = re.compile(r"<<|\bobj\b|stream")  # in a text: an object for who looks for one
POINTS_PER_MM, BORDER_MM, SAME_MM = 72 / 25.4, 10.0, 0.01


def sheet_faults(blob: FileBytes) -> list[str]:
    """What a drawing has that tbcad does not write; empty for none."""
    text = blob.data.tobytes().decode("cp1252", errors="replace")
    found = _pattern().fullmatch(text)
    if not found:
        return [f"{blob.name}: other objects than one page of lines and texts"]
    width, height, drawn = float(found[1]), float(found[2]), found[3].split("\n")
    frame = FRAME.fullmatch(drawn[0])
    ends = [float(frame[k]) + BORDER_MM for k in (1, 2)] if frame else [math.nan, math.nan]
    page = [side / POINTS_PER_MM for side in (width, height)]
    if not all(abs(end - side) < SAME_MM for end, side in zip(ends, page, strict=True)):
        return [f"{blob.name}: a page of {page[0]:.0f} x {page[1]:.0f} mm, its frame is of another"]
    wrong = [line for line in drawn if not LINE.fullmatch(line) or HIDDEN.search(line)]
    return [f"{blob.name}: {wrong[0][:40]!r} is neither a line nor a text"] if wrong else []


def _pattern() -> re.Pattern[str]:
    objects = "".join(f"{k} 0 obj\n{one}\nendobj\n" for k, one in enumerate(OBJECTS, 1))
    return re.compile(_escaped(f"%PDF-1.4\n{objects}") + TABLE + _escaped(TRAILER))


def _escaped(text: str) -> str:
    parts = re.split(r"([@#$]|(?<=\n)%(?=\n))", text)
    return "".join(PLACES.get(part, re.escape(part)) for part in parts)
