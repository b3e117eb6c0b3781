"""The assembly page: one HTML file with its pictures, to read or to print."""

import base64
import tempfile
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from tbcad.common.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.output.single_files import check_file
from tbcad.prototype.assembly_steps.machine import AssembledMachine
from tbcad.prototype.assembly_steps.steps import Step
from tbcad.report.drawing import check_drawn_files, draw_apart

NAME = "assembly.html"
MODULE = "assembly_pictures"
WORDS = "assembly_page.toml"


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
    words = tomllib.loads((files("tbcad.report") / WORDS).read_text(encoding="utf-8"))
    what = {int(row["item"] or 0): str(row["what"]) for row in machine.bill.rows}
    kinds = {machine.kind(part) for part in machine.bill.items}
    tools = [tool for kind, tool in words["tools_of_kinds"].items() if kind in kinds]
    body = (
        "<h1>Assembly</h1>",
        *(f"<p>{escape(text)}</p>" for text in words["about"]),
        "<h3>Tools</h3>",
        _list([*words["tools"], *tools]),
        "<nav><h3>Steps</h3><ol>",
        *(f'<li><a href="#{step.key}">{escape(step.title)}</a></li>' for step in steps),
        "</ol></nav>",
        *(line for step in steps for line in _step(step, what, pictures)),
        "<section><h2>Not drawn</h2><p>These parts of the list are no bodies of prototype.step, "
        "prototype.glb and the pictures.</p>",
        _list(_not_drawn(machine, steps, words["without_body"])),
        "</section>",
    )
    style = f"<style>\n{words['style']}</style>"
    head = f'<meta charset="utf-8"><title>Assembly</title>{style}'
    return "\n".join(
        ("<!doctype html>", f'<html lang="en"><head>{head}</head><body>', *body, "</body></html>\n")
    )


def _not_drawn(
    machine: AssembledMachine, steps: Sequence[Step], reasons: Mapping[str, str]
) -> Iterator[str]:
    """Parts without a body, by the reason, which there is for each kind."""
    kinds: dict[str, list[str]] = {}
    for use in (use for step in steps for use in step.parts if not use.bodies):
        kinds.setdefault(reasons[machine.kind(use.part)], []).append(machine.ref(use.part))
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
    check_drawn_files(folder)
    with tempfile.TemporaryDirectory(prefix="tbcad-assembly-") as place:
        draw_apart(MODULE, str(folder), place)
        return {path.stem: path.read_bytes() for path in sorted(Path(place).glob("*.png"))}
