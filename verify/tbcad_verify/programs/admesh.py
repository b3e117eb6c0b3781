"""admesh: the repairs that a mesh needs. It repairs before it reports, and counts what it did."""

from __future__ import annotations

import re

from tbcad_verify.programs.answers import VOLUME, mesh_checks, text_of
from tbcad_verify.programs.program_query import ExpectedPart, ProgramQuery, Sandbox, on_path
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most

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
MIN_FACETS = 4


def ask(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """Nothing to repair, one part, the mesh's volume.

    Raises:
        Unknown: the program gives no answer.
    """
    report = _figures(text_of(sandbox.run(sandbox.copy)))
    flaws = {key: report[key] for key in FLAWS}
    repairs = ", ".join(f"{key} {count:.0f}" for key, count in flaws.items() if count)
    return [
        at_most(names[0], sum(flaws.values()), 0, repairs),
        *mesh_checks(names[1:], report["Number of parts"], report["Volume"], expected),
    ]


def _figures(text: str) -> dict[str, float]:
    """Every figure by its label; the first of two columns, "Original"."""
    rows = re.findall(r"(\w[\w ]{0,40}?) +: +(-?\d{1,20}(?:\.\d{1,9})?)\b", text)
    report = {label: float(figure) for label, figure in rows}
    labels = {*FLAWS, "Number of facets", "Number of parts", "Volume"}
    if not labels <= {*report} or report["Number of facets"] < MIN_FACETS:
        raise Unknown("ended without error, but without its report")
    return report


STL = ProgramQuery(
    program="admesh",
    kind="stl",
    install="apt install admesh",
    questions={"admesh repairs": "flaws", "admesh parts": "parts", "admesh volume": VOLUME},
    find=lambda: on_path("admesh"),
    ask=ask,
)
