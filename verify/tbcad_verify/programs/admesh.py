"""admesh: would it repair anything? It repairs before it reports, so the counts of what it did."""

from __future__ import annotations

import re

from tbcad_verify.programs.answers import count_check, text_of, volume_check
from tbcad_verify.programs.program_query import ExpectedPart, ProgramQuery, Sandbox, on_path
from tbcad_verify.report.checks import Check, Unknown, at_most

PARTS, VOLUME = "parts", "mm^3 off"
FLAWS = (
    "Total disconnected facets",
    "Degenerate facets",
    "Edges fixed",
    "Facets removed",
    "Facets added",
    "Facets reversed",
    "Backwards edges",
    "Normals fixed",
)
LEAST_FACETS = 4


def ask(room: Sandbox, wanted: ExpectedPart) -> list[Check]:
    """Nothing to repair, one part, the mesh's volume.

    Raises:
        Unknown: there is no answer.
    """
    said = _figures(text_of(room.run(room.given)))
    flaws = {key: said[key] for key in FLAWS}
    found = ", ".join(f"{key} {count:.0f}" for key, count in flaws.items() if count)
    return [
        at_most(("admesh repairs", room.file, "flaws"), sum(flaws.values()), 0, found),
        count_check(("admesh parts", room.file, PARTS), said["Number of parts"], 1, "must be one"),
        volume_check(
            ("admesh volume", room.file, VOLUME),
            said["Volume"],
            wanted.volume,
            wanted.volume_error,
        ),
    ]


def _figures(text: str) -> dict[str, float]:
    """Every figure by its label; of two columns the first, "Original"."""
    rows = re.findall(r"(\w[\w ]{0,40}?) +: +(-?\d{1,20}(?:\.\d{1,9})?)\b", text)
    said = {label: float(figure) for label, figure in rows}
    wanted = {*FLAWS, "Number of facets", "Number of parts", "Volume"}
    if not wanted <= {*said} or said["Number of facets"] < LEAST_FACETS:
        raise Unknown("ended well, but without its report")
    return said


STL = ProgramQuery(
    program="admesh",
    kind="stl",
    install="apt install admesh",
    questions={"admesh repairs": "flaws", "admesh parts": PARTS, "admesh volume": VOLUME},
    find=lambda: on_path("admesh"),
    ask=ask,
)
