"""Changes to the record, and halves of other designs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import numpy as np

from tests.verify.corpus import part21
from tests.verify.corpus.copies import change, load, load_mirrors, store, store_mirrors
from tests.verify.corpus.facets import read, write
from tests.verify.corpus.mutation import Job
from tests.verify.corpus.patches import balls

Design = dict[str, Any]
Row = dict[str, Any]
JSON, TABLE, MANIFEST = "design.json", "mirrors.csv", "manifest.json"


def mirrors(how: Callable[[list[Row], str], object], named: int = 1) -> Job:
    """Change the rows of mirrors.csv, given the id of a mirror."""

    def job(folder: Path) -> Sequence[str]:
        rows, name = load_mirrors(folder), balls(folder, "a")[0].id
        how(rows, name)
        store_mirrors(folder, rows)
        return [name][:named]

    return job


def mirror(how: Callable[[Row], object]) -> Job:
    """Change one row of mirrors.csv."""
    return mirrors(lambda rows, name: how(row_of(rows, name)))


def design(how: Callable[[Design], object]) -> Job:
    """Change design.json; no mirror is concerned."""
    return json_file(JSON, how)


def manifest(how: Callable[[dict[str, Any]], object]) -> Job:
    """Change the list of files in the manifest."""
    return json_file("manifest.json", lambda value: how(value["files"]))


def json_file(name: str, how: Callable[[dict[str, Any]], object]) -> Job:
    def job(folder: Path) -> Sequence[str]:
        value = load(folder, name)
        how(value)
        store(folder, name, value)
        return ()

    return job


def row_of(rows: list[Row], name: str) -> Row:
    return next(row for row in rows if row["id"] == name)


def exchange(folder: Path) -> Sequence[str]:
    """Two ids exchanged, the STEP's names as they were."""
    names = [ball.id for ball in balls(folder, "a")[:2]]

    def how(rows: list[Row], _: str) -> None:
        one, two = (row_of(rows, name) for name in names)
        one["id"], two["id"] = two["id"], one["id"]

    mirrors(how)(folder)
    return names


def lines(how: Callable[[list[bytes]], list[bytes]]) -> Job:
    """Change the lines of mirrors.csv only."""

    def job(folder: Path) -> Sequence[str]:
        change(folder, TABLE, lambda data: b"\n".join(how(data.split(b"\n"))))
        return ()

    return job


def word(new: bytes) -> Callable[[list[bytes]], list[bytes]]:
    def how(rows: list[bytes]) -> list[bytes]:
        cells = rows[5].split(b",")
        cells[5] = new
        return [*rows[:5], b",".join(cells), *rows[6:]]

    return how


def radius(by: float) -> Callable[[Row], None]:
    """A radius, and the centre with it."""

    def how(one: Row) -> None:
        one["radius_mm"] += by
        for axis in "xyz":
            one["c" + axis] -= by * one["n" + axis]

    return how


def centre(one: Row) -> None:
    """A centre 10 nm off the normal, the radius as it was."""
    one["cy"] += 1e-5


def apex(one: Row) -> None:
    """A mirror a micrometre further out."""
    for k in "pc":
        for axis in "xyz":
            one[k + axis] += 1e-3 * one["u" + axis]


def figure(key: str) -> Callable[[Row], None]:
    """A figure that follows from others, wrong by a millionth."""

    def how(one: Row) -> None:
        one[key] *= 1 + 1e-6

    return how


def loose(mesh_error_mm: float) -> Callable[[Design], None]:
    """A mesh error in the spec, which would widen what STEP and mesh may differ by."""

    def how(value: Design) -> None:
        value["spec"]["mesh"]["structure_error_mm"] = mesh_error_mm

    return how


def second_column(data: bytes) -> bytes:
    """Radii once more, of which another program may read the last."""
    head, *rows = data.splitlines()
    return b"\n".join([head + b",radius_mm", *(row + b",99.0" for row in rows)]) + b"\n"


def second_key(key: str, value: str) -> Callable[[bytes], bytes]:
    """A key of a JSON object once more, before the others."""
    return lambda data: data.replace(b"{", f'{{"{key}": {value},'.encode(), 1)


def shell_spec(**keys: object) -> Callable[[Design], None]:
    """Keys of the section [shell]."""
    return lambda value: value["spec"]["shell"].update(keys)


def flange(name: str, **keys: object) -> Callable[[Design], None]:
    """Keys of a flange's section."""
    return lambda value: value["spec"]["shell"][name].update(keys)


def mirror_spec(**keys: object) -> Callable[[Design], None]:
    """Keys of the section [mirrors]."""
    return lambda value: value["spec"]["mirrors"].update(keys)


def coverage(one: Row) -> None:
    """What a mirror is said to see, 5 per cent too much."""
    one["coverage_mm"] *= 1.05


def cell(one: Row) -> None:
    """A cell's area wrong by a ten thousandth."""
    one["cell_area_mm2"] *= 1.0001


def leave_out(rows: list[Row], name: str) -> None:
    rows.remove(row_of(rows, name))


def twin(rows: list[Row], name: str) -> None:
    rows.append(dict(row_of(rows, name), id="a9999"))


def shift_camera(by: float, echo: bool) -> Callable[[Design], None]:
    def how(value: Design) -> None:
        for camera in value["cameras"]:
            camera["pinhole_mm"][2] += by
        if echo:
            value["spec"]["optics"]["camera_mm"][2] += by

    return how


def shift_one(value: Design) -> None:
    value["cameras"][1]["pinhole_mm"][1] += 0.1


def turn(angle_deg: float) -> Callable[[Design], None]:
    """Both cameras look elsewhere, up or down."""

    def how(value: Design) -> None:
        c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
        for camera in value["cameras"]:
            forward, right = np.array(camera["forward"]), np.array(camera["right"])
            camera["forward"] = (c * forward + s * np.cross(forward, right)).tolist()

    return how


def skew(value: Design) -> None:
    value["cameras"][0]["forward"] = [0.0, 0.1, 1.0]


def angle(share: float, echo: bool) -> Callable[[Design], None]:
    def how(value: Design) -> None:
        for owner in (*value["cameras"], *([value["spec"]["camera"]] if echo else [])):
            owner["hfov_deg"] *= share

    return how


def pixels(value: Design) -> None:
    """A sensor so coarse that some mirrors have no pixel."""
    for owner in (*value["cameras"], value["spec"]["camera"]):
        owner["width_px"], owner["height_px"] = 16, 16


def coat(value: Design) -> None:
    value["coating_mm"] += 0.02
    value["spec"]["mirrors"]["coating_um"] += 20


def target(to: Callable[[Path], float], echo: bool) -> Job:
    def job(folder: Path) -> Sequence[str]:
        value = load(folder, JSON)
        value["target_mm"] = to(folder)
        if echo:
            value["spec"]["optics"]["capture_diameter_mm"] = to(folder)
        store(folder, JSON, value)
        return ()

    return job


def beyond_the_worst(folder: Path) -> float:
    """A hundredth of a millimetre more than the worst mirror's own coverage."""
    return min(row["coverage_mm"] for row in load_mirrors(folder)) + 0.01


def foot(value: Design) -> None:
    value["foot_z_mm"] += 0.01


def subdivision(value: Design) -> None:
    value["spec"]["optics"]["n"] += 1


def nothing_asked(value: Design) -> None:
    del value["spec"]["optics"]


def no_meshes(value: Design) -> None:
    """One part only, so that the other half is never looked at."""
    value["parts"].pop()


def without(kind: str) -> Callable[[Design], None]:
    """The record names no file of a kind, so nobody reads it; the manifest still lists it."""

    def how(value: Design) -> None:
        for part in value["parts"]:
            del part[kind]

    return how


def first_part(**keys: object) -> Job:
    return design(lambda value: value["parts"][0].update(keys))


def other_design(folder: Path) -> Sequence[str]:
    """All of one half's files are, consistently, those of a design larger by a thousandth."""
    share = 1.001
    write(folder, "a", (read(folder, "a") * np.float32(share)).astype(np.float32))
    part21.edit(folder, "shell_a.step", lambda entities: part21.scale(entities, share))
    return ["a0001"][:0]


def as_text(name: str, how: Callable[[bytes], bytes]) -> Job:
    return lambda folder: change(folder, name, how) or ()


def cut_line(data: bytes) -> bytes:
    """Up to the middle of a line."""
    return data[: data.index(b"\n", len(data) // 2) + 30]


def half(data: bytes) -> bytes:
    return data[: len(data) // 2]
