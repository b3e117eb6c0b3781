"""The assembly page: one HTML file with its pictures, to read or to print."""

import base64
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from pathlib import Path

from tbcad.common.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.output.single_files import check_file
from tbcad.prototype.assembly_steps.machine import RESISTORS, AssembledMachine
from tbcad.prototype.assembly_steps.steps import Step
from tbcad.report.drawing import check_drawn_files, draw_apart

NAME = "assembly.html"
MODULE = "assembly_pictures"
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; color: #222 }
h1, h2, h3 { line-height: 1.2 }
h2 { border-top: 2px solid #444; padding-top: 1rem; margin-top: 3rem; break-after: avoid }
h3 { margin: 1rem 0 .3rem; break-after: avoid }
img { width: 100%; border: 1px solid #ccc; break-inside: avoid }
table { border-collapse: collapse; width: 100%; font-size: .9rem }
th, td { text-align: left; padding: .15rem .6rem; border-bottom: 1px solid #ddd }
td:nth-child(-n+2), th:nth-child(-n+2) { text-align: right; width: 3rem }
ul.check { list-style: none; padding-left: 0 }
ul.check li::before { content: "\\2610"; margin-right: .5rem }
nav ol { columns: 2 }
@media print { body { margin: 0; max-width: none; font-size: 11pt } nav { display: none } }
"""
ABOUT = (
    "The machine takes photographs for a light field: a base with steel balls, its mirrors, turns "
    "about an axis in front of a camera. The object stands between them on a post of its own and "
    "does not turn with the base. A motor drives the base from stop to stop; at each stop the "
    "camera takes photographs of the object in the balls.",
    "Numbers in circles and in brackets are those of the parts list (bom.csv). Blue parts and "
    "orange screws, inserts and magnets are new in a step, grey parts are there already. New parts "
    "are drawn away from their places, each against the direction in which it goes in. What has no "
    "number in a picture is not drawn (the list at the end says why) or hidden by another part.",
    "Torques are at most what printed PETG bears for years (20 MPa below a head, 8 MPa round an "
    "insert, friction factor 0.2); tighten again after a day. Hand tight: with the short end of "
    "the key, by two fingers.",
)
TOOLS = (
    "hexagon keys for the screws of the list (metric; 3/16 inch for the camera's screw), a torque "
    "screwdriver of 0.1 to 2 N m if there is one",
    "drill, drills and tap for M5 and for what the drawings name; saw, file, square, calipers",
    "soldering iron, also for the heat-set inserts; crimping pliers; multimeter",
    "epoxy, alcohol, gloves, matt black paint, tape",
)
# Of parts of a kind, by what they need.
TOOLS_OF_KINDS = {
    "nuts": "open spanner for the nuts of the list: 8 mm for M5",
    "bearings": "hand reamer H7 for the bore of the carrier's hub, as wide as the shaft",
    "sheets": "knife, steel rule and glue for card",
}
FLEXIBLE, OUTSIDE = "flexible, lies as it is laid", "used by hand or outside the shroud"
# Why parts of a kind that have no body have none.
WITHOUT_BODY = {
    "belts": FLEXIBLE,
    "wires": FLEXIBLE,
    "connectors": "hangs on its wires",
    "electronics": OUTSIDE,
    RESISTORS: OUTSIDE,
    "shafts": "the zero pin, in place at angle zero only",
}


def write_page(
    folder: Path,
    out: Path,
    machine: AssembledMachine,
    steps: Sequence[Step],
    *,
    pictures: bool = True,
    force: bool = False,
) -> Path:
    """Write the steps of an assembly as a page, with or without pictures; other files stay.

    InputError: the page exists, a file cannot be read or written, or drawing fails.
    """
    check_file(out / NAME, force)
    drawn = _drawn(folder) if pictures else {}
    text = page(machine, steps, drawn)
    with write_errors_as_input_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    return replace_files(out, {NAME: text.encode("utf-8")})[0]


def page(machine: AssembledMachine, steps: Sequence[Step], pictures: Mapping[str, bytes]) -> str:
    """The page as HTML; pictures: PNG files by keys of steps."""
    what = {int(row["item"] or 0): str(row["what"]) for row in machine.bill.rows}
    body = (
        "<h1>Assembly</h1>",
        *(f"<p>{escape(text)}</p>" for text in ABOUT),
        "<h3>Tools</h3>",
        _list(_tools(machine)),
        "<nav><h3>Steps</h3><ol>",
        *(f'<li><a href="#{step.key}">{escape(step.title)}</a></li>' for step in steps),
        "</ol></nav>",
        *(line for step in steps for line in _step(step, what, pictures)),
        "<section><h2>Not drawn</h2><p>These parts of the list are no bodies of prototype.step, "
        "prototype.glb and the pictures.</p>",
        _list(_not_drawn(machine, steps)),
        "</section>",
    )
    head = f'<meta charset="utf-8"><title>Assembly</title><style>{STYLE}</style>'
    return "\n".join(
        ("<!doctype html>", f'<html lang="en"><head>{head}</head><body>', *body, "</body></html>\n")
    )


def _tools(machine: AssembledMachine) -> Iterator[str]:
    """What is needed beside the parts of the list."""
    kinds = {machine.kind(part) for part in machine.bill.items}
    yield from TOOLS
    yield from (tool for kind, tool in TOOLS_OF_KINDS.items() if kind in kinds)


def _not_drawn(machine: AssembledMachine, steps: Sequence[Step]) -> Iterator[str]:
    """Parts without a body, by the reason."""
    kinds: dict[str, list[str]] = {}
    for use in (use for step in steps for use in step.parts if not use.bodies):
        kinds.setdefault(WITHOUT_BODY[machine.kind(use.part)], []).append(machine.ref(use.part))
    yield from (f"{', '.join(dict.fromkeys(parts))}: {why}" for why, parts in kinds.items())


def _step(step: Step, what: Mapping[int, str], pictures: Mapping[str, bytes]) -> Iterator[str]:
    yield f'<section id="{step.key}"><h2>{step.number}. {escape(step.title)}</h2>'
    if step.parts:
        yield "<table><tr><th>No.</th><th>Qty</th><th>Part</th><th>What it is</th></tr>"
        for use in step.parts:
            cells = (str(use.item), str(use.quantity), use.part, what[use.item])
            yield f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        yield "</table>"
    if step.key in pictures:
        data = base64.b64encode(pictures[step.key]).decode("ascii")
        yield f'<p><img alt="{escape(step.title)}" src="data:image/png;base64,{data}"></p>'
    yield _list(step.does, "ol")
    if step.fits:
        yield f"<h3>Torques and fits</h3>{_list(step.fits)}"
    yield f"<h3>Check</h3>{_list(step.checks, 'ul', ' class=check')}</section>"


def _list(texts: Iterable[str], kind: str = "ul", attribute: str = "") -> str:
    items = "".join(f"<li>{escape(text)}</li>" for text in texts)
    return f"<{kind}{attribute}>{items}</{kind}>"


def _drawn(folder: Path) -> dict[str, bytes]:
    """Pictures by keys of steps."""
    check_drawn_files(folder)
    with tempfile.TemporaryDirectory(prefix="tbcad-assembly-") as place:
        draw_apart(MODULE, str(folder), place)
        return {path.stem: path.read_bytes() for path in sorted(Path(place).glob("*.png"))}
