"""Changes to the record, and halves of other designs."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import numpy as np

from tests.verify.corpus import part21
from tests.verify.corpus.copies import change, load, put, store
from tests.verify.corpus.facets import read, write
from tests.verify.corpus.mutation import Job
from tests.verify.corpus.patches import balls

Design = dict[str, Any]
JSON, TABLE = "design.json", "mirrors.csv"
RECORD = "record"


def record(how: Callable[[Design, str], None], named: int = 1) -> Job:
    """Change design.json, told a mirror's id, and let mirrors.csv follow."""

    def job(folder: Path) -> Sequence[str]:
        design, name = load(folder, JSON), balls(folder, "a")[0].id
        how(design, name)
        store(folder, JSON, design)
        put(folder, TABLE, table(design["mirrors"]))
        return [name][:named]

    return job


def design(how: Callable[[Design], object]) -> Job:
    """Change design.json, mirrors.csv with it; no mirror is concerned."""
    return record(lambda value, _: how(value) and None, named=0)


def table(rows: list[Design]) -> bytes:
    names = list(rows[0])
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([["" if row[k] is None else _field(row[k]) for k in names] for row in rows])
    return stream.getvalue().encode()


def _field(value: object) -> str:
    return repr(value) if isinstance(value, float) else str(value)


def row(value: Design, name: str) -> Design:
    return next(one for one in value["mirrors"] if one["id"] == name)


def exchange(folder: Path) -> Sequence[str]:
    """Two ids exchanged in both records, the STEP's names as they were."""
    names = [ball.id for ball in balls(folder, "a")[:2]]

    def how(value: Design, _: str) -> None:
        one, two = (row(value, name) for name in names)
        one["id"], two["id"] = two["id"], one["id"]
        places = [value["mirrors"].index(one), value["mirrors"].index(two)]
        value["mirrors"][places[0]], value["mirrors"][places[1]] = two, one

    record(how)(folder)
    return names


def lines(how: Callable[[list[bytes]], list[bytes]]) -> Job:
    """Change the lines of mirrors.csv only."""

    def job(folder: Path) -> Sequence[str]:
        change(folder, TABLE, lambda data: b"\n".join(how(data.split(b"\n"))))
        return ()

    return job


def swap_lines(rows: list[bytes]) -> list[bytes]:
    return [rows[0], rows[2], rows[1], *rows[3:]]


def swap_words(rows: list[bytes]) -> list[bytes]:
    """Ids of two lines exchanged."""
    one, two = (line.split(b",", 1) for line in rows[3:5])
    return [*rows[:3], two[0] + b"," + one[1], one[0] + b"," + two[1], *rows[5:]]


def last_digit(rows: list[bytes]) -> list[bytes]:
    """One number off by its last digit."""
    cells = rows[5].split(b",")
    value = float(cells[5])
    cells[5] = repr(float(np.nextafter(value, 1e3))).encode()
    return [*rows[:5], b",".join(cells), *rows[6:]]


def word(new: bytes) -> Callable[[list[bytes]], list[bytes]]:
    def how(rows: list[bytes]) -> list[bytes]:
        cells = rows[5].split(b",")
        cells[5] = new
        return [*rows[:5], b",".join(cells), *rows[6:]]

    return how


def radius(by: float) -> Callable[[Design, str], None]:
    """A radius in both records, the centre with it."""

    def how(value: Design, name: str) -> None:
        one = row(value, name)
        one["radius_mm"] += by
        for axis in "xyz":
            one["c" + axis] -= by * one["n" + axis]

    return how


def apex(value: Design, name: str) -> None:
    """A mirror a micrometre further out."""
    one = row(value, name)
    for k in "pc":
        for axis in "xyz":
            one[k + axis] += 1e-3 * one["u" + axis]


def leave_out(value: Design, name: str) -> None:
    value["mirrors"] = [one for one in value["mirrors"] if one["id"] != name]


def twin(value: Design, name: str) -> None:
    value["mirrors"].append(dict(row(value, name), id="a9999"))


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
        owner["width_px"], owner["height_px"] = 16, 12


def coat(value: Design) -> None:
    value["coating_mm"] += 0.02
    value["spec"]["mirrors"]["coating_um"] += 20


def target(to: Callable[[Design], float], echo: bool) -> Callable[[Design], None]:
    def how(value: Design) -> None:
        value["target_mm"] = to(value)
        if echo:
            value["spec"]["optics"]["capture_diameter_mm"] = to(value)

    return how


def least(value: Design) -> float:
    """A hundredth of a millimetre more than the worst mirror's own coverage."""
    return min(one["coverage_mm"] for one in value["mirrors"]) + 0.01


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


def cell(value: Design, name: str) -> None:
    """A cell's area wrong by a ten thousandth."""
    row(value, name)["cell_area_mm2"] *= 1.0001
