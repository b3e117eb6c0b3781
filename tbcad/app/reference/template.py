"""A design file that names every key: those not set are comments, told from the models."""

import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, field

from tbcad.app.reference.keys import Key, KeySection, key_sections
from tbcad.cad.formats.checked_files import toml_text
from tbcad.core.spec.csv_rows import Table, read_text, read_toml
from tbcad.core.spec.load import PAPER, shipped_designs

WIDTH = 100
# Set in the file, so that they are seen; all others are comments until a user takes the # away.
MAIN = ("name", "schema", "optics", "camera", "mirrors.radius_rule", "mirrors.margin_mm")
HEAD = """\
Every key of a design, with what it may be. A key that begins with # has its default, which is
shown: take the # away to set it. "auto": tbcad chooses, and design.json says what.
  tbcad build FILE                 builds and verifies it
  tbcad explain mirrors.margin_mm  explains a key, or any other word"""

# What a design says of keys that it leaves out; here they are all.
ELSEWHERE = "All keys, with units and ranges: tbcad init. What is not set here has its default."


@dataclass
class Remarks:
    """Comments of a design: of the whole, and by the dotted name of a key or section."""

    whole: list[str] = field(default_factory=list)
    by_name: dict[str, list[str]] = field(default_factory=dict)


def design_template(name: str = PAPER) -> str:
    """A TOML file that gives the design of a name, with every key of a design.

    Args:
        name: of a design that comes with tbcad.
    """
    file = shipped_designs()[name]
    values = _dotted(read_toml(file, name, "design"))
    remarks = _remarks(read_text(file, name, "design"))
    whole = "\n".join(remarks.whole).removesuffix(ELSEWHERE).rstrip()
    lines = [f"# {line}".rstrip() for line in (*whole.splitlines(), "", *HEAD.splitlines())]
    for section in key_sections():
        lines += _section_lines(section, values, remarks)
    return "\n".join(lines) + "\n"


def _section_lines(section: KeySection, values: Table, remarks: Remarks) -> Iterator[str]:
    if section.name:
        yield ""
        yield from _comment(section.description)
        yield from (f"# {line}" for line in remarks.by_name.get(section.name, ()))
        yield f"[{section.name}]"
    for key in section.keys:
        yield ""
        yield from _key_lines(key, values, remarks.by_name.get(key.name, []))


def _key_lines(key: Key, values: Table, remarks: list[str]) -> Iterator[str]:
    unit = f", {key.unit}" if key.unit else ""
    yield from _comment(key.description)
    yield from _comment(f"Allowed: {key.allowed}{unit}. Default: {key.default}.")
    yield from (f"# {line}" for line in remarks)
    value = toml_text(values[key.name]) if key.name in values else key.default
    mark = "" if key.name in values or _is_main(key.name) else "# "
    yield from _fitting(f"{mark}{key.name.rpartition('.')[2]} = {value}")


def _fitting(line: str) -> Iterator[str]:
    """A line, or several where it ends with a list that does not fit."""
    start, bracket, items = line.partition("[")
    if len(line) <= WIDTH or not bracket:
        yield line
        return
    yield start + bracket
    yield from textwrap.wrap(
        items.removesuffix("]"), WIDTH, initial_indent="    ", subsequent_indent="    "
    )
    yield "]"


def _is_main(key: str) -> bool:
    return any(key == main or key.startswith(main + ".") for main in MAIN)


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# ")


def _dotted(table: Table, prefix: str = "") -> Table:
    """The values of a table by dotted key."""
    values: Table = {}
    for key, value in table.items():
        values |= _dotted(value, f"{prefix}{key}.") if isinstance(value, dict) else {}
        values |= {} if isinstance(value, dict) else {prefix + key: value}
    return values


def _remarks(text: str) -> Remarks:
    """The comments of a design: a block belongs to the line below it, else to the whole."""
    remarks, section, block = Remarks(), "", list[str]()
    for line in [*text.splitlines(), ""]:
        if line.startswith("#"):
            block.append(line.removeprefix("#").removeprefix(" "))
            continue
        if header := re.fullmatch(r"\[(.+)\]", line):
            section = header[1] + "."
        key = re.match(r"(\w+) = ", line)
        name = header[1] if header else section + key[1] if key else ""
        if name and block:
            remarks.by_name[name] = block
        elif block:
            remarks.whole += ["", *block] if remarks.whole else block
        block = []
    return remarks
