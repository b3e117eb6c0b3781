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
from tests.verify.corpus.copies import change, load, load_mirrors, put, store, store_mirrors
from tests.verify.corpus.facets import balls, read, write
from tests.verify.corpus.mutation import Job, Mutation, failing, refusing

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


def json_file(name: str, how: Callable[[Record], object]) -> Job:
    def job(folder: Path) -> None:
        value = load(folder, name)
        how(value)
        store(folder, name, value)

    return job


def design(how: Callable[[Record], object]) -> Job:
    """Change design.json; no mirror is concerned."""
    return json_file(JSON, how)


def top(**keys: object) -> Job:
    """Other keys of design.json."""
    return design(lambda value: value.update(keys))


def camera(**keys: object) -> Job:
    """Other keys of the first camera."""
    return design(lambda value: value["cameras"][0].update(keys))


def part(**keys: object) -> Job:
    """Other keys of the first part."""
    return design(lambda value: value["parts"][0].update(keys))


def spec(*path: str, **keys: object) -> Job:
    """Other keys of a section of the spec."""

    def how(value: Record) -> None:
        section = value["spec"]
        for name in path:
            section = section[name]
        section.update(keys)

    return design(how)


def manifest(how: Callable[[Record], object]) -> Job:
    """Change the list of files in the manifest."""
    return json_file(MANIFEST, lambda value: how(value["files"]))


def as_text(name: str, how: Callable[[bytes], bytes]) -> Job:
    return lambda folder: change(folder, name, how)


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

    return as_text(TABLE, how)


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
    return as_text(name, lambda data: data.replace(b"{", f'{{"{key}": {value},'.encode(), 1))


def leave_out(rows: list[Record], name: str) -> None:
    rows.remove(row_of(rows, name))


def shift_camera(by: float, echo: bool) -> Job:
    def how(value: Record) -> None:
        for camera in value["cameras"]:
            camera["pinhole_mm"][2] += by
        if echo:
            value["spec"]["optics"]["camera_mm"][2] += by

    return design(how)


def shift_one(value: Record) -> None:
    value["cameras"][1]["pinhole_mm"][1] += 0.1


def turn(value: Record) -> None:
    """Both cameras look elsewhere, by 30 degrees."""
    c, s = cos(radians(30)), sin(radians(30))
    for camera in value["cameras"]:
        forward, right = np.array(camera["forward"]), np.array(camera["right"])
        camera["forward"] = (c * forward + s * np.cross(forward, right)).tolist()


def angle(share: float, echo: bool) -> Job:
    def how(value: Record) -> None:
        for owner in (*value["cameras"], *([value["spec"]["camera"]] if echo else [])):
            owner["hfov_deg"] *= share

    return design(how)


def pixels(value: Record) -> None:
    """A sensor so coarse that some mirrors have no pixel."""
    for owner in (*value["cameras"], value["spec"]["camera"]):
        owner["width_px"], owner["height_px"] = 16, 16


def coat(value: Record) -> None:
    value["coating_mm"] += 0.02
    value["spec"]["mirrors"]["coating_um"] += 20


def above_the_worst(folder: Path) -> None:
    """A target a hundredth of a millimetre above the worst mirror's own coverage."""
    value = load(folder, JSON)
    value["target_mm"] = min(row["coverage_mm"] for row in load_mirrors(folder)) + 0.01
    value["spec"]["optics"]["capture_diameter_mm"] = value["target_mm"]
    store(folder, JSON, value)


def foot(value: Record) -> None:
    value["foot_z_mm"] += 0.01


def subdivision(value: Record) -> None:
    value["spec"]["optics"]["n"] += 1


def without(kind: str) -> Job:
    """The record names no file of a kind, so nobody reads it; the manifest still lists it."""
    return design(lambda value: [part.pop(kind) for part in value["parts"]])


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


SEAM = ("shell", "seam_flange")
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
        ("cameras 0.1 mm lower", shift_camera(-0.1, False), "requirements", "pinhole"),
        ("cameras and spec 0.1 mm lower", shift_camera(-0.1, True), "poses"),
        ("camera b 0.1 mm aside", design(shift_one), "requirements", "camera b pinhole 1"),
        ("cameras turned by 30 degrees", design(turn), "frame margin"),
        ("another view angle", angle(0.99, False), "requirements", "hfov"),
        ("a view angle half as wide, spec too", angle(0.5, True), "frame margin"),
        ("a sensor of 16 x 16 pixels, spec too", design(pixels), "pixels, minimum"),
        ("a coat that is not there, by STEP", design(coat), "step surfaces", "0.02 mm"),
        ("a target not met", above_the_worst, "coverage, spheres"),
        ("a lower target than the spec's", top(target_mm=30.0), "requirements", "target_mm"),
        ("the foot 10 um higher", design(foot), "step cells"),
        ("another n in the spec", design(subdivision), "directions", "without a mirror"),
        ("the foot 10 um higher, by mesh", design(foot), "mesh seam and foot", "beyond the foot"),
        *(
            (f"a wall of 2.9 mm, by {file}", spec("shell", wall_mm=2.9), f"{file} wall", "3.000 mm")
            for file in ("step", "mesh")
        ),
        *(
            (f"20 bolts, by {file}", spec(*SEAM, bolts=20), f"{file} holes", "not 20")
            for file in ("step", "mesh")
        ),
        ("another radius rule", spec("mirrors", radius_rule="paper"), "radius rule", "by rule"),
        ("a mesh error", spec("mesh", structure_error_mm=5.0), "requirements", "mesh error"),
        ("a part forgotten", design(lambda one: one["parts"].pop()), "mirrors found", "b0001"),
        ("no STEP", without("step"), "part files", "shell_a has none"),
        ("no 3MF", without("3mf"), "part files", "shell_a has none"),
        ("a part for the other camera", part(camera="b"), "mirrors found", "missing"),
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
        ("a second column", as_text(TABLE, second_column), "column radius_mm is there twice"),
        ("NaN", word(b"nan"), TABLE, "line 6: px is nan: it should"),
        ("a field empty", word(b""), TABLE, "line 6: px is ''"),
        ("a field too many", word(b"1.0,2.0"), TABLE, "line 6 has"),
        ("cut in a line", as_text(TABLE, lambda b: b[:-30]), TABLE, "truncated"),
        ("no heading", as_text(TABLE, lambda b: b.partition(b"\n")[2]), TABLE, "first line"),
    ),
    *refusing(
        JSON,
        ("a spec that asks nothing", design(lambda value: value["spec"].pop("optics")), OPTICS),
        ("a second target", second_key(JSON, "target_mm", "1.0"), "key target_mm is"),
        ("cut short", as_text(JSON, lambda b: b[: len(b) // 2]), JSON, "broken JSON"),
        ("not UTF-8", as_text(JSON, lambda b: b"\xff" + b), JSON, "UTF-8"),
        ("the version before", top(schema="tbcad-design/1"), "verifies tbcad-design/2"),
        ("a table outside", top(mirrors="../m.csv"), "../m.csv"),
        ("axes that are no axes", camera(forward=[0.0, 0.1, 1.0]), JSON, "forward and right"),
        ("a sensor without columns", camera(width_px=0), "width_px"),
        ("a target in words", top(target_mm="60"), "target_mm"),
        ("no parts", top(parts=[]), "parts"),
        ("a part outside", part(stl="../shell_a.stl"), "stl is ../shell_a.stl"),
        ("a part that is not there", part(**{"3mf": "x.3mf"}), "x.3mf", "missing"),
    ),
    *refusing(
        MANIFEST,
        ("a second list", second_key(MANIFEST, "files", "{}"), "key files is there twice"),
        ("that of a capture", json_file(MANIFEST, lambda v: v.update(kind="capture")), "kind"),
        signed=False,
    ),
)
