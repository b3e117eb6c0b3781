"""report.html of a build: verdict, 3D view, map of the virtual cameras, tables, pictures."""

import base64
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from html import escape
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from tbcad_verify.report.as_made import AsMade

from tbcad.cad.formats.checked_files import Row
from tbcad.cad.formats.pictures import visible_files
from tbcad.common.atomic_files import replace_files
from tbcad.common.web_page import web_page
from tbcad.core.geometry.conics import Ellipsoid
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.output.manifest import (
    MANIFEST,
    REPORT,
    REPORT_BEGIN,
    is_report,
    read_manifest,
    written_file,
)
from tbcad.output.single_files import refuse_member
from tbcad.prototype.files.bom import PartsList, read_parts_list
from tbcad.records.design import MISSING
from tbcad.records.document import Manifest
from tbcad.report.page import bodies
from tbcad.report.page.bodies import PackedArrays
from tbcad.report.page.verdict import (
    Verdict,
    checks_html,
    printing_html,
    read_verdict,
    verdict_html,
)
from tbcad.types import Bytes

SUFFIXES = (".png", ".jpg", ".jpeg")
MAX_FILE_BYTES = 40_000_000
MAX_SIDE_PX = 1600
PHOTOGRAPH_SIDE_PX = 2080
QUALITY = 85


class Picture(NamedTuple):
    """A picture as a JPEG: file name, width and height in pixels, bytes."""

    name: str
    width: int
    height: int
    data: bytes

    @property
    def url(self) -> str:
        """The picture itself as an address."""
        return f"data:image/jpeg;base64,{base64.b64encode(self.data).decode('ascii')}"


def read_pictures(folder: Path) -> list[Picture]:
    """The pictures in a folder by name, made smaller where they are large; others are left out."""
    found = (_read(path) for path in visible_files(folder, SUFFIXES) if path.is_file())
    return [one for one in found if one is not None]


def pictures_html(pictures: list[Picture]) -> Iterator[str]:
    """The pictures with their names."""
    if not pictures:
        yield (
            "<p>No pictures in the folder. <code>tbcad picture</code> draws some; then run "
            "<code>tbcad report</code> again.</p>"
        )
    for one in pictures:
        yield (
            f"<figure><img loading=lazy width={one.width} height={one.height} "
            f'alt="{escape(one.name)}" src="{one.url}"><figcaption>{escape(one.name)}'
            "</figcaption></figure>"
        )


def photographs(capture: Path, ids: list[str]) -> dict[str, Any]:
    """Both photographs of a capture for the page, and where each mirror is in them, by camera.

    Of each the picture's address, the factor from its pixels to those of the boxes, and boxes of
    all mirrors by their ids, camera a's first: x0, y0, x1, y1 in pixels of the photograph.
    InputError: the capture cannot be read, or is of another design.
    """
    from tbcad.light.simulate.capture.light_field import LightField

    record = {}
    with LightField.open(capture) as field:
        for camera, frame in field.frames.items():
            wanted = sum(one.startswith(camera) for one in ids)
            if len(frame.u) != wanted:
                raise InputError(
                    f"{capture}: camera {camera} has {len(frame.u)} mirrors, the build {wanted}: "
                    "name a capture of this build"
                )
            picture = _jpeg(camera, frame.image(), PHOTOGRAPH_SIDE_PX)
            x0, x1, y0, y1 = frame.boxes.T
            record[camera] = {
                "url": picture.url,
                "size": [frame.camera.width_px, frame.camera.height_px],
                "boxes": np.column_stack([x0, y0, x1, y1]).tolist(),
            }
    return record


def _read(path: Path) -> Picture | None:
    from PIL import Image

    if path.stat().st_size > MAX_FILE_BYTES:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of a picture that is far too large
            with Image.open(path, formats=("PNG", "JPEG")) as image:
                image.draft("RGB", (MAX_SIDE_PX, MAX_SIDE_PX))
                return _jpeg(path.name, _in_8_bits(_on_white(image)), MAX_SIDE_PX)
    except (OSError, ValueError, SyntaxError, Warning, Image.DecompressionBombError):
        return None


def _in_8_bits(image: Any) -> Bytes:
    """Grey (h, w) or red, green, blue (h, w, 3)."""
    if image.mode.startswith("I;16"):
        return np.asarray(np.asarray(image) >> 8, np.uint8)
    return np.asarray(image.convert("L" if image.mode in {"1", "L"} else "RGB"))


def _on_white(image: Any) -> Any:
    from PIL import Image

    if "A" not in image.getbands() and "transparency" not in image.info:
        return image
    drawn = image.convert("RGBA")
    return Image.alpha_composite(Image.new("RGBA", drawn.size, "white"), drawn).convert("RGB")


def _jpeg(name: str, pixels: Any, side: int) -> Picture:
    from PIL import Image

    image = Image.fromarray(pixels)
    image.thumbnail((side, side), Image.Resampling.LANCZOS)
    data = BytesIO()
    image.save(data, "jpeg", quality=QUALITY, optimize=True)
    return Picture(name, image.width, image.height, data.getvalue())


MAX_BYTES = 6_000_000
RECORDS = ("design.json", "mirrors.csv")
PROTOTYPE = ("prototype.json", "prototype.glb", "balls.csv", "rotation_plan.csv", "bom.csv")
SCRIPTS = ("data.js", "mesh.js", "viewer.js", "rays.js", "map.js", "page.js")
GROUPS = {
    "shell_a": "Shell of camera a",
    "shell_b": "Shell of camera b",
    "lamps": "Lamps of the shell",
    "base": "Base (turns)",
    "balls": "Balls",
    "stage": "Object stage",
    "frame": "Frame",
    "bought": "Bought parts",
    "shroud": "Shroud",
    "fasteners": "Fasteners",
    "views": "Light cone and object space",
}
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


def write_report(
    folder: Path,
    out: Path | None = None,
    as_made: AsMade | None = None,
    capture: Path | None = None,
    *,
    force: bool = False,
) -> Path:
    """Write the page of a build, by default as its report.html, which may show a capture of it.

    InputError: the file exists, the build or the capture cannot be read, or writing fails.
    """
    file = out or folder / REPORT
    check_writable(file, force)
    text = page(folder, as_made, capture, linked=file.parent.resolve() == folder.resolve())
    return replace_files(file.parent, {file.name: text.encode("utf-8")})[0]


def check_writable(file: Path, force: bool) -> None:
    """Refuse, before any work, a file that cannot be written or is not tbcad's to replace."""
    if file.suffix.lower() != ".html" or not file.parent.is_dir():
        raise InputError(f"{file}: name a .html file in a folder that exists")
    if file.is_dir():
        raise InputError(f"{file} is a folder: choose another name")
    refuse_member(file)
    if file.exists() and not is_report(file) and not force:
        raise InputError(
            f"{file} exists and tbcad did not write it: choose another name with --out, or replace "
            "it with --force"
        )


def page(
    folder: Path,
    as_made: AsMade | None = None,
    capture: Path | None = None,
    *,
    linked: bool = True,
) -> str:
    """The page of a build; linked: with links to its files.

    InputError: the build or the capture cannot be read.
    """
    manifest = _checked_manifest(folder)
    export, verdict = read_export(folder), read_verdict(folder)
    data = _data(folder, export, verdict, manifest, capture)
    parts = read_parts_list(folder) if PROTOTYPE[0] in manifest.files else None
    views = 2 * len(export.reflectors[0]) - int(export.reflectors[0].cells.halved.sum())
    balls = len(data["mirrors"]["balls"])
    static = files("tbcad.report.page") / "static"
    blocks = {
        "style": (static / "page.css").read_text(encoding="utf-8"),
        "script": "\n".join((static / name).read_text(encoding="utf-8") for name in SCRIPTS),
        "subtitle": _subtitle(export, views, balls),
        "verdict": _joined(verdict_html(verdict, as_made, views, balls, export.capture_mm)),
        "checks": _joined(checks_html(verdict)),
        "printing": _joined(printing_html(verdict.printing if verdict else ())),
        "parts": _joined(parts_html(parts)),
        "files": _joined(files_html({n: e.size for n, e in manifest.files.items()}, linked)),
    }
    fixed = partial(
        web_page,
        (static / "page.html").read_text(encoding="utf-8"),
        title=export.spec.name,
        kind=": report",
        data=data,
        begin=REPORT_BEGIN,
        images="data:",
    )
    room = MAX_BYTES - len(fixed({**blocks, "pictures": ""}).encode("utf-8"))
    return fixed({**blocks, "pictures": _pictures(read_pictures(folder), room)})


def _checked_manifest(folder: Path) -> Manifest:
    """The manifest; refuses a build in which a file that is shown is not as it was written."""
    manifest = read_manifest(folder)
    if manifest is None:
        raise InputError(f"{folder / MANIFEST} is not there: {MISSING}")
    for name in (*RECORDS, *(PROTOTYPE if PROTOTYPE[0] in manifest.files else ())):
        written_file(folder, manifest, name, MISSING)
    return manifest


def _data(
    folder: Path,
    export: ExportedDesign,
    verdict: Verdict | None,
    manifest: Manifest,
    capture: Path | None,
) -> dict[str, Any]:
    arrays = PackedArrays()
    table = bodies.packed_mirrors(folder, verdict, arrays)
    facets = bodies.coarse_facets(export)
    shells = "shell_a.stl" in manifest.files
    drawn = bodies.packed_shells(export, facets, arrays) if shells else []
    drawn += [bodies.packed_body(one, arrays) for one in bodies.lamp_bodies(folder)]
    if PROTOTYPE[0] in manifest.files:
        drawn += [bodies.packed_body(one, arrays) for one in bodies.prototype_bodies(folder)]
    pinhole = export.reflectors[0].camera.pinhole
    ellipsoid = Ellipsoid(pinhole, export.spec.optics.semi_minor_mm)
    record = {
        "target": export.capture_mm,
        "axis": ellipsoid.axis.tolist(),
        "distance": ellipsoid.camera_distance,
        "cameras": [
            {"id": one.camera_id, "pinhole": one.camera.pinhole.tolist()}
            for one in export.reflectors
        ],
        "mirrors": table,
        "outlines": bodies.packed_outlines(facets, arrays),
        "bodies": drawn,
        "groups": {one["group"]: GROUPS.get(one["group"], one["group"]) for one in drawn},
        "photographs": photographs(capture, table["ids"]) if capture else {},
    }
    return record | {"arrays": arrays.text()}


def _subtitle(export: ExportedDesign, views: int, balls: int) -> str:
    prototype = f"; prototype with {balls} balls" if balls else ""
    return (
        f"n = {export.spec.optics.n}: {views} virtual cameras round an object of "
        f"{export.capture_mm:g} mm, two cameras of {export.spec.camera.width_px} x "
        f"{export.spec.camera.height_px} pixels{prototype}"
    )


def _pictures(pictures: list[Picture], room: int) -> str:
    """As many pictures as there is room for, and which are left out."""
    shown, left_out = [], []
    for one in pictures:
        size = len(_joined(pictures_html([one])).encode("utf-8"))
        if size > room:
            left_out.append(one.name)
            continue
        room -= size
        shown.append(one)
    text = _joined(pictures_html(shown)) if shown or not left_out else ""
    if left_out:
        text += f"<p>Left out, to keep this file small: {escape(', '.join(left_out))}.</p>"
    return text


def _joined(lines: Iterable[str]) -> str:
    return "\n".join(lines)


def parts_html(parts: PartsList | None) -> Iterator[str]:
    """Totals, then every row."""
    if parts is None:
        yield "<p>This build has no prototype, and so no parts list.</p>"
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
    yield "Tools", _money(sums["tools_price"])
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
    """The files of the build; linked where the page lies beside them."""
    yield "<details><summary>" + f"{len(sizes)} files</summary><ul class=files>"
    for name in sorted(sizes):
        shown = escape(name)
        link = f'<a href="{escape(quote(name))}">{shown}</a>' if linked else shown
        kind = KINDS.get("." + name.rpartition(".")[2].lower(), "text")
        yield f"<li>{link} <small>{kind}, {_size(sizes[name])}</small>"
    yield "</ul></details>"


def _size(size: int) -> str:
    steps: Sequence[tuple[float, str]] = ((1e6, "MB"), (BYTES_PER_KB, "kB"))
    for factor, unit in steps:
        if size >= factor:
            return f"{size / factor:.1f} {unit}"
    return f"{size} bytes"
