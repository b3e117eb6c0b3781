"""Changes to a prototype's record, tables, program and assembly."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from tests.exported_files import Rows, edit_csv
from tests.verify.corpus.copies import change, load, put, store
from tests.verify.corpus.mutation import Job

Record = dict[str, Any]
RECORD, DESIGN, PROGRAM = "prototype.json", "design.json", "rotation_plan.nc"
STEP, GLB = "prototype.step", "prototype.glb"
BALLS, BILL, HOLES = "balls.csv", "bom.csv", "plate_holes.csv"
WIRING, SETTINGS = "wiring.csv", "grbl_settings.txt"
KLIPPER = "rotation_plan_klipper.gcode"


def record(
    how: Callable[[Record], object], design: Callable[[Record], object] | None = None
) -> Job:
    """Change prototype.json, and design.json too."""

    def job(folder: Path) -> Sequence[str]:
        for name, one in ((RECORD, how), (DESIGN, design)):
            if one:
                value = load(folder, name)
                one(value)
                store(folder, name, value)
        return ()

    return job


def table(name: str, how: Callable[[Rows], object]) -> Job:
    """Change the rows of a table."""

    def job(folder: Path) -> Sequence[str]:
        put(folder, name, (folder / name).read_bytes())  # a file of its own
        edit_csv(folder / name, how)
        return ()

    return job


def row(name: str, number: int, **cells: object) -> Job:
    """Other cells in one row of a table."""
    return table(name, lambda rows: rows[number].update({k: str(v) for k, v in cells.items()}))


def program(pattern: str, new: str, count: int = 0) -> Job:
    """Change the program, with a regular expression."""
    return text_of(PROGRAM, pattern, new, count)


def text_of(name: str, pattern: str, new: str, count: int = 0) -> Job:
    """Change a text, with a regular expression."""

    def how(data: bytes) -> bytes:
        text = re.sub(pattern, new, data.decode(), count=count)
        assert text.encode() != data
        return text.encode()

    return lambda folder: change(folder, name, how) or ()


def together(*jobs: Job) -> Job:
    """Several changes, in order."""
    return lambda folder: [word for job in jobs for word in job(folder)]


def without_part(name: str) -> Job:
    """A part that is in no list, no assembly and no file; the manifest forgets its files too."""

    def job(folder: Path) -> Sequence[str]:
        for kind in ("stl", "step", "3mf"):
            (folder / f"{name}.{kind}").unlink()
        if not name.startswith("coupon"):
            undrawn(name)(folder)
        unlisted(name)(folder)
        return ()

    def forget(value: Record) -> None:
        value["parts"] = [part for part in value["parts"] if part["name"] != name]

    return together(record(forget), job)


def unlisted(name: str) -> Job:
    """A part that the parts list has not; items are numbered anew."""

    def how(rows: Rows) -> None:
        rows[:] = [one for one in rows if one["part"] != name]
        for item, one in enumerate(rows, 1):
            one["item"] = str(item)

    return table(BILL, how)


def undrawn(name: str) -> Job:
    """A body that the assembly has not, neither as STEP nor as GLB."""

    def other(scene: trimesh.Scene) -> None:
        scene.delete_geometry(scene.graph[name][1])

    return together(step_text(lambda text: text.replace(f"'{name}'", "'thing'")), glb(other))


def step_text(how: Callable[[str], str]) -> Job:
    """Change the text of the STEP assembly."""

    def job(data: bytes) -> bytes:
        text = how(data.decode())
        assert text.encode() != data
        return text.encode()

    return lambda folder: change(folder, STEP, job) or ()


def glb(how: Callable[[trimesh.Scene], object]) -> Job:
    """Change the scene of the GLB."""

    def job(folder: Path) -> Sequence[str]:
        scene = trimesh.load_scene(io.BytesIO((folder / GLB).read_bytes()), file_type="glb")
        how(scene)
        put(folder, GLB, bytes(trimesh.exchange.gltf.export_glb(scene)))
        return ()

    return job


def drive(**figures: object) -> Job:
    return record(lambda value: value["drive"].update(figures))


def scaled(key: str, by: float) -> Job:
    return record(lambda value: value["drive"].update({key: value["drive"][key] * by}))


def led(by: float, *, spec: bool) -> Job:
    """An LED elsewhere in the record, and in the spec too."""

    def how(value: Record) -> None:
        value["leds"][0]["position_mm"][0] += by

    def design(value: Record) -> None:
        value["spec"]["prototype"]["stage"]["leds_mm"][0][0] += by

    return record(how, design if spec else None)


def stage_key(**values: object) -> Job:
    """Other keys of the stage in the spec."""
    return record(lambda _: None, lambda d: d["spec"]["prototype"]["stage"].update(values))


def leds_on_one_side(value: Record) -> None:
    for k, led in enumerate(value["leds"]):
        led["position_mm"] = [-23.0, float(k), -5.0]


def better_calibration(value: Record) -> None:
    value["calibration"]["centre_um_median"] /= 2


def no_led(value: Record) -> None:
    value["leds"].pop()


def no_spec_led(value: Record) -> None:
    value["spec"]["prototype"]["stage"]["leds_mm"].pop()


def not_bought(name: str) -> Callable[[Record], None]:
    def how(value: Record) -> None:
        value["bought"] = [one for one in value["bought"] if one["name"] != name]

    return how


def empty_step(text: str) -> str:
    """A STEP file without any entity."""
    return text[: text.index("DATA;")] + "DATA;\nENDSEC;\nEND-ISO-10303-21;\n"


def moved_point(text: str) -> str:
    """The plate's box a millimetre longer: one coordinate of its corners."""
    start = text.index("PRODUCT('plate'")
    head, tail = text[:start], text[start:]
    values = re.findall(r"CARTESIAN_POINT\('',\(([-\d.E+]+),", tail)
    return head + tail.replace(f"({values[3]},", f"({float(values[3]) + 1.0!r},")


def moved_part(text: str) -> str:
    """The assembly moves a part by 5 mm."""
    start = text.index("ITEM_DEFINED_TRANSFORMATION")
    place = re.search(r"#(\d+),#(\d+)\)", text[start:])
    assert place
    point = re.search(rf"#{place[2]} = AXIS2_PLACEMENT_3D\('',#(\d+)", text)
    assert point
    old = f"#{point[1]} = CARTESIAN_POINT('',(0.,0.,0.))"
    assert old in text
    return text.replace(old, f"#{point[1]} = CARTESIAN_POINT('',(5.,0.,0.))")


def exchange(key: str) -> Callable[[Rows], None]:
    """Two rows take each other's cell."""

    def how(rows: Rows) -> None:
        rows[0][key], rows[1][key] = rows[1][key], rows[0][key]

    return how


def shifted(key: str, by: float) -> Callable[[Rows], None]:
    def how(rows: Rows) -> None:
        for one in rows:
            one[key] = repr(float(one[key]) + by)

    return how


def nudged(node: str, by_mm: float) -> Callable[[trimesh.Scene], None]:
    """One body of the GLB elsewhere."""

    def how(scene: trimesh.Scene) -> None:
        mesh = scene.geometry[scene.graph[node][1]]
        mesh.vertices = mesh.vertices + np.array([by_mm, 0, 0])

    return how


def compact(folder: Path) -> Sequence[str]:
    """prototype.json in one line."""
    put(folder, RECORD, json.dumps(load(folder, RECORD)).encode())
    return ()
