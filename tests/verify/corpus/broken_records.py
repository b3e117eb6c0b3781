"""Records that are broken while the files they describe are good, and halves of other designs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, radians, sin
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np

from tbcad.core.mirrors.array import design as mirrors_of
from tbcad.core.mirrors.radii import RadiusProblem
from tbcad.core.optics.windows import seam_gaps
from tbcad.core.spec.design import Spec
from tbcad.output.build import write_export
from tests.verify.corpus import part21
from tests.verify.corpus.copies import load, load_mirrors, put, store, store_mirrors
from tests.verify.corpus.facets import balls, read, write
from tests.verify.corpus.mutation import (
    Job,
    Mutation,
    as_bytes,
    at,
    failing,
    plus,
    refusing,
    together,
)

Record = dict[str, Any]
JSON, TABLE, MANIFEST = "design.json", "mirrors.csv", "manifest.json"


def mirrors(how: Callable[[list[Record], str], object], named: int = 0) -> Job:
    """Change the rows of mirrors.csv, given the id of a mirror."""

    def job(folder: Path) -> Sequence[str]:
        rows, name = load_mirrors(folder), balls(folder, "a")[0].id
        how(rows, name)
        store_mirrors(folder, rows)
        return [name][:named]

    return job


def mirror(how: Callable[[Record], object]) -> Job:
    """Change one row of mirrors.csv."""
    return mirrors(lambda rows, name: how(row_of(rows, name)), 1)


def row_of(rows: list[Record], name: str) -> Record:
    return next(row for row in rows if row["id"] == name)


def exchange(folder: Path) -> Sequence[str]:
    """Two ids exchanged, the STEP's names as they were."""
    names = [ball.id for ball in balls(folder, "a")[:2]]

    def how(rows: list[Record], _: str) -> None:
        one, two = (row_of(rows, name) for name in names)
        one["id"], two["id"] = two["id"], one["id"]

    mirrors(how)(folder)
    return names


def word(new: bytes) -> Job:
    """A cell of mirrors.csv, px in its sixth line."""

    def how(data: bytes) -> bytes:
        rows = data.split(b"\n")
        cells = rows[5].split(b",")
        cells[5] = new
        return b"\n".join([*rows[:5], b",".join(cells), *rows[6:]])

    return as_bytes(TABLE, how)


def radius(by: float) -> Job:
    """A radius, and the centre with it."""

    def how(one: Record) -> None:
        one["radius_mm"] += by
        for axis in "xyz":
            one["c" + axis] -= by * one["n" + axis]

    return mirror(how)


def apex(one: Record) -> None:
    """A mirror a micrometre further out."""
    for k in "pc":
        for axis in "xyz":
            one[k + axis] += 1e-3 * one["u" + axis]


def times(key: str, share: float) -> Job:
    """A figure of a mirror times a share."""
    return mirror(lambda one: one.update({key: one[key] * share}))


def second_column(data: bytes) -> bytes:
    """Radii once more, of which another program may read the last."""
    head, *rows = data.splitlines()
    return b"\n".join([head + b",radius_mm", *(row + b",99.0" for row in rows)]) + b"\n"


def second_key(name: str, key: str, value: str) -> Job:
    """A key of a JSON object once more, before the others."""
    return as_bytes(name, lambda data: data.replace(b"{", f'{{"{key}": {value},'.encode(), 1))


def leave_out(rows: list[Record], name: str) -> None:
    rows.remove(row_of(rows, name))


def lower(*keys: str) -> Job:
    """Cameras 0.1 mm lower, by these keys."""
    return together(*(at(f"{key}/2", plus(-0.1)) for key in keys))


def view(share: float, *keys: str) -> Job:
    """Another view angle, by these keys."""
    return together(*(at(f"{key}/hfov_deg", lambda value: value * share) for key in keys))


def turned(cameras: list[Record]) -> list[Record]:
    """Both cameras look elsewhere, by 30 degrees."""
    c, s = cos(radians(30)), sin(radians(30))
    for camera in cameras:
        forward, right = np.array(camera["forward"]), np.array(camera["right"])
        camera["forward"] = (c * forward + s * np.cross(forward, right)).tolist()
    return cameras


def above_the_worst(folder: Path) -> None:
    """A target a hundredth of a millimetre above the worst mirror's own coverage."""
    value = load(folder, JSON)
    value["target_mm"] = min(row["coverage_mm"] for row in load_mirrors(folder)) + 0.01
    value["spec"]["optics"]["capture_diameter_mm"] = value["target_mm"]
    store(folder, JSON, value)


def other_design(folder: Path) -> None:
    """All of one half's files are, consistently, those of a design larger by a thousandth."""
    share = 1.001
    write(folder, "a", (read(folder, "a") * np.float32(share)).astype(np.float32))
    part21.edit(folder, "shell_a.step", lambda entities: part21.scale(entities, share))


def not_aimed(folder: Path) -> Sequence[str]:
    """All files are those of a design whose halves are aimed at the origin; the worst half."""
    asked = Spec.model_validate(load(folder, JSON)["spec"])
    with patch.object(RadiusProblem, "missing_aim", lambda _, cells: np.zeros(cells.mirrors)):
        made = mirrors_of(asked)  # with the radii of outlines alone
    with TemporaryDirectory() as other:
        write_export(made, Path(other), ["shell"])
        for file in Path(other).iterdir():
            put(folder, file.name, file.read_bytes())
    array = made.arrays[0]
    gap = seam_gaps(array.cells, array.ellipsoid.pinhole, made.spec.optics.capture_diameter_mm / 2)
    return [array.ids[int(gap.argmax())]]


SIDES = ("width", "height")
CAMERAS = ("cameras/0", "cameras/1")
PINHOLES = ("cameras/0/pinhole_mm", "cameras/1/pinhole_mm")
PIXELS = together(  # so few that some mirrors have none
    *(at(f"{key}/{side}_px", 16) for key in (*CAMERAS, "spec/camera") for side in SIDES)
)
FOOT = at("foot_z_mm", plus(0.01))
COAT = together(at("coating_mm", plus(0.02)), at("spec/mirrors/coating_um", plus(20)))
OPTICS = "spec.optics is missing"
RECORDS: tuple[Mutation, ...] = (
    *failing(
        TABLE,
        ("two ids exchanged", exchange, "step surfaces"),
        ("a radius 1 nm off", radius(1e-6), "step surfaces"),
        ("a centre 10 nm off the normal", times("cy", 1 + 1e-7), "poses"),
        ("a cell's area", times("cell_area_mm2", 1.0001), "cell areas"),
        ("a mirror's polar_deg", times("polar_deg", 1 + 1e-6), "figures"),
        ("a mirror 1 um further out", mirror(apex), "poses"),
        ("a mirror not in the record", mirrors(leave_out), "mirrors found", "1 not in the record"),
        ("a direction without its mirror", mirrors(leave_out), "directions", "1 vert"),
        ("an id twice", mirrors(lambda rows, _: rows[3].update(id="a0010")), "ids", "a0010"),
        ("an odd id", mirrors(lambda rows, _: rows[3].update(id="m 4")), "ids", "m 4"),
        ("a mirror's coverage", times("coverage_mm", 1.05), "recorded coverage"),
    ),
    *failing(
        JSON,
        ("an LED 5 mm aside", at("lamps/places/0/position_mm/1", plus(5)), "lamp ring", "LED 1"),
        ("LEDs of camera a dark", at("lamps/places", lambda all_: all_[6:]), "light ratio"),
        ("cameras 0.1 mm lower", lower(*PINHOLES), "requirements", "pinhole"),
        ("cameras and spec 0.1 mm lower", lower(*PINHOLES, "spec/optics/camera_mm"), "poses"),
        ("camera b 0.1 mm aside", at(f"{PINHOLES[1]}/1", plus(0.1)), "requirements", "b pinhole 1"),
        ("cameras turned by 30 degrees", at("cameras", turned), "frame margin"),
        ("another view angle", view(0.99, *CAMERAS), "requirements", "hfov"),
        ("a view angle half as wide, spec too", view(0.5, *CAMERAS, "spec/camera"), "frame margin"),
        ("a sensor of 16 x 16 pixels, spec too", PIXELS, "pixels, minimum"),
        ("a coat that is not there, by STEP", COAT, "step surfaces", "0.02 mm"),
        ("a target not met", above_the_worst, "coverage, spheres"),
        ("a lower target than the spec's", at("target_mm", 30.0), "requirements", "target_mm"),
        ("the foot 10 um higher", FOOT, "step cells"),
        ("another n in the spec", at("spec/optics/n", plus(1)), "directions", "without a mirror"),
        ("the foot 10 um higher, by mesh", FOOT, "mesh seam and foot", "beyond the foot"),
        *(
            (f"{name}, by {file}", at(f"spec/shell/{key}", value), f"{file} {check}", told)
            for file in ("step", "mesh")
            for name, key, value, check, told in (
                ("a wall of 2.9 mm", "wall_mm", 2.9, "wall", "3.000 mm"),
                ("20 bolts", "seam_flange/bolts", 20, "holes", "not 20"),
            )
        ),
        ("another radius rule", at("spec/mirrors/radius_rule", "paper"), "radius rule", "by rule"),
        ("a mesh error", at("spec/mesh/structure_error_mm", 5.0), "requirements", "mesh error"),
        ("a part forgotten", at("parts/-1"), "mirrors found", "b0001"),
        *(
            # so nobody reads it; the manifest still lists it
            (f"no {kind}", together(*(at(f"parts/{k}/{kind}") for k in (0, 1))), "part files", told)
            for kind, told in (("step", "shell_a has none"), ("3mf", "shell_a has none"))
        ),
        ("a part for the other camera", at("parts/0/camera", "b"), "mirrors found", "missing"),
    ),
    *failing(
        "all",
        ("seam mirrors with the old radii", not_aimed, "seam gap", "neither half sees"),
        ("seam mirrors with the old radii, by coverage", not_aimed, "coverage, spheres"),
        ("one half of another design", other_design, "centre error"),
        ("one half of another design, by STEP", other_design, "step surfaces"),
    ),
    *refusing(
        TABLE,
        ("a second column", as_bytes(TABLE, second_column), "column radius_mm is there twice"),
        ("NaN", word(b"nan"), TABLE, "line 6: px is nan: it should"),
        ("a field empty", word(b""), TABLE, "line 6: px is ''"),
        ("a field too many", word(b"1.0,2.0"), TABLE, "line 6 has"),
        ("cut in a line", as_bytes(TABLE, lambda b: b[:-30]), TABLE, "truncated"),
        ("no heading", as_bytes(TABLE, lambda b: b.partition(b"\n")[2]), TABLE, "first line"),
    ),
    *refusing(
        JSON,
        ("a spec that asks nothing", at("spec/optics"), OPTICS),
        ("a second target", second_key(JSON, "target_mm", "1.0"), "key target_mm is"),
        ("cut short", as_bytes(JSON, lambda b: b[: len(b) // 2]), JSON, "broken JSON"),
        ("not UTF-8", as_bytes(JSON, lambda b: b"\xff" + b), JSON, "UTF-8"),
        ("the version before", at("schema", "tbcad-design/1"), "verifies tbcad-design/2"),
        ("a table outside", at("mirrors", "../m.csv"), "../m.csv"),
        ("axes that are no axes", at("cameras/0/forward", [0.0, 0.1, 1.0]), "forward and right"),
        ("a sensor without columns", at("cameras/0/width_px", 0), "width_px"),
        ("a target in words", at("target_mm", "60"), "target_mm"),
        ("no parts", at("parts", []), "parts"),
        ("a part outside", at("parts/0/stl", "../shell_a.stl"), "stl is ../shell_a.stl"),
        ("a part that is not there", at("parts/0/3mf", "x.3mf"), "x.3mf", "missing"),
    ),
    *refusing(
        MANIFEST,
        ("a second list", second_key(MANIFEST, "files", "{}"), "key files is there twice"),
        ("that of a capture", at("kind", "capture", MANIFEST), "kind"),
        signed=False,
    ),
)
