"""The parts list with its totals, and the files of the export, as HTML."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any
from urllib.parse import quote

from tbcad.cad.formats.checked_files import Row
from tbcad.prototype.files.bom import PartsList

HEADS = ("No.", "Qty", "Part", "What it is", "Material", "Mass, g", "Print, h", "Price", "From")
G_PER_KG, BYTES_PER_KB = 1000.0, 1000.0
# What a file is, by how its name ends.
KINDS = {
    ".step": "solid, STEP",
    ".stl": "mesh, STL",
    ".3mf": "mesh, 3MF",
    ".glb": "mesh to look at, glTF",
    ".pdf": "drawing, PDF",
    ".dxf": "drawing, DXF",
    ".csv": "table",
    ".json": "record",
}


def parts_html(parts: PartsList | None) -> Iterator[str]:
    """Totals, then every row."""
    if parts is None:
        yield "<p>This export has no prototype, and so no parts list.</p>"
        return
    sums = parts.record()["totals"]
    yield "<dl class=totals>"
    for name, value in _totals(sums):
        yield f"<div><dt>{escape(name)}<dd>{escape(value)}</div>"
    yield "</dl><div class=wide><table><thead><tr>"
    yield "".join(f"<th>{head}" for head in HEADS)
    yield "</tr></thead><tbody>"
    yield from (_part(row) for row in parts.rows)
    yield "</tbody></table></div>"


def _totals(sums: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "Mass of all parts", f"{sums['mass_g'] / G_PER_KG:.2f} kg"
    yield "Bought", _money(sums["bought_price"])
    if sums["without_price"]:
        yield "Bought, without a price", f"{sums['without_price']} kinds"
    yield "Material to print", f"{sums['filament_g'] / G_PER_KG:.2f} kg"
    yield "Price of that material", _money(sums["filament_price"])
    yield "Printing", f"{sums['print_hours']:.0f} h"


def _money(prices: Mapping[str, float]) -> str:
    return " + ".join(f"{amount:.2f} {currency}" for currency, amount in prices.items()) or "-"


def _part(row: Row) -> str:
    price = "" if row["total_price"] is None else f"{row['total_price']:.2f} {row['currency']}"
    numbers = (_number(row["total_mass_g"], 1), _number(row["print_hours"], 1), price)
    begin = (_number(row["item"], 0), _number(row["quantity"], 0))
    texts = tuple(escape(str(row[name] or "")) for name in ("part", "what", "material"))
    cells = "".join(f"<td class=n>{escape(cell)}" for cell in begin)
    cells += "".join(f"<td>{cell}" for cell in texts)
    cells += "".join(f"<td class=n>{escape(cell)}" for cell in numbers)
    return f"<tr>{cells}<td>{escape(str(row['from'] or ''))}</tr>"


def _number(value: Any, digits: int) -> str:
    return "" if value is None else f"{float(value):.{digits}f}"


def files_html(sizes: Mapping[str, int], linked: bool) -> Iterator[str]:
    """The files of the export; linked where the page lies beside them."""
    yield "<details><summary>" + f"{len(sizes)} files</summary><ul class=files>"
    for name in sorted(sizes):
        shown = escape(name)
        link = f'<a href="{escape(quote(name))}">{shown}</a>' if linked else shown
        kind = KINDS.get(_suffix(name), "text")
        yield f"<li>{link} <small>{kind}, {_size(sizes[name])}</small>"
    yield "</ul></details>"


def _suffix(name: str) -> str:
    return "." + name.rpartition(".")[2].lower()


def _size(size: int) -> str:
    steps: Sequence[tuple[float, str]] = ((1e6, "MB"), (BYTES_PER_KB, "kB"))
    for factor, unit in steps:
        if size >= factor:
            return f"{size / factor:.1f} {unit}"
    return f"{size} bytes"
