"""The assembly page: one HTML file with its pictures, to read or to print."""

import base64
import tempfile
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from html import escape
from importlib.resources import files
from pathlib import Path

from tbcad.common.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.output.single_files import check_file
from tbcad.prototype.assembly_steps.instructions import Instructions, hours_text
from tbcad.prototype.assembly_steps.steps import Step
from tbcad.report.drawing import check_drawn_files, draw_apart

NAME = "assembly.html"
MODULE = "assembly_pictures"
WORDS = "assembly_page.toml"


def write_page(
    folder: Path,
    out: Path,
    told: Instructions,
    *,
    pictures: bool = True,
    force: bool = False,
) -> Path:
    """Write the steps of an assembly as a page, with or without pictures; other files stay.

    InputError: the page exists, a file cannot be read or written, or drawing fails.
    """
    check_file(out / NAME, force)
    drawn = _drawn(folder) if pictures else {}
    text = page(told, drawn)
    with write_errors_as_input_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    return replace_files(out, {NAME: text.encode("utf-8")})[0]


def page(told: Instructions, pictures: Mapping[str, bytes]) -> str:
    """The page as HTML; pictures: PNG files by keys of steps."""
    words = tomllib.loads((files("tbcad.report") / WORDS).read_text(encoding="utf-8"))
    about = (*told.about, words["pictures"])
    body = (
        "<main><h1>Assembly</h1>",
        *(f"<p>{escape(text)}</p>" for text in about),
        "<h2>Tools</h2>",
        _list(told.tools),
        "<h2>Printing</h2>",
        _table(("Setting", "Value"), told.printing),
        "<nav><h2>Steps</h2><ol>",
        *(f'<li><a href="#{step.key}">{escape(step.title)}</a></li>' for step in told.steps),
        "</ol></nav>",
        *_times(told),
        "<h2>Tested</h2>",
        _table(("What", "Tested"), told.tested),
        *(line for step in told.steps for line in _step(step, told, pictures)),
        "<section><h2>Not drawn</h2><p>These parts of the list are no bodies of prototype.step, "
        "prototype.glb and the pictures.</p>",
        _list(told.not_drawn),
        "</section></main>",
    )
    style = f"<style>\n{words['style']}</style>"
    meta = '<meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    head = f"{meta}<title>Assembly</title>{style}"
    return "\n".join(
        ("<!doctype html>", f'<html lang="en"><head>{head}</head><body>', *body, "</body></html>\n")
    )


def _times(told: Instructions) -> Iterator[str]:
    yield f"<h2>Time</h2><p>{hours_text(sum(told.minutes.values()))} of work in all.</p>"
    yield from (f"<p>{escape(text)}</p>" for text in told.times)


def _table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [f"<tr>{''.join(f'<th>{escape(head)}</th>' for head in heads)}</tr>"]
    lines += [f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows]
    return "\n".join(["<table>", *lines, "</table>"])


def _step(step: Step, told: Instructions, pictures: Mapping[str, bytes]) -> Iterator[str]:
    yield f'<section id="{step.key}"><h2>{step.number}. {escape(step.title)}</h2>'
    tools = ", ".join(told.step_tools[step.key])
    needed = escape(f" Tools: {tools}." if tools else "")
    yield f"<p>About {hours_text(told.minutes[step.key])}.{needed}</p>"
    if step.parts:
        heads = ("No.", "Qty", "Part", "What it is")
        yield _table(heads, told.uses(step))
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
