"""Changes to a prototype's record, tables, program and assembly."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import ezdxf
import trimesh

from tests.exported_files import Rows, edit_csv
from tests.verify.corpus.copies import change, load, put, store
from tests.verify.corpus.mutation import Job

RECORD, DESIGN, PROGRAM = "prototype.json", "design.json", "rotation_plan.nc"
STEP, GLB = "prototype.step", "prototype.glb"
BALLS, HOLES = "balls.csv", "plate_holes.csv"
SETTINGS = "grbl_settings.txt"
PLATE, WHEEL, UPRIGHT, LAMP = (
    f"drawing_{name}.dxf" for name in ("plate", "wheel", "upright", "lamp")
)
KLIPPER, KLIPPER_CONFIG = "rotation_plan_klipper.gcode", "klipper.cfg"


DROP = object()


def at(path: str, to: object = DROP, file: str = RECORD) -> Job:
    """Another value at a path of keys, or what a function makes of it; or none.

    Items of a list are named by number, or by what the first one's name or part begins with.
    """

    def job(folder: Path) -> Sequence[str]:
        value = inside = load(folder, file)
        *keys, last = path.split("/")
        for key in keys:
            inside = inside[_place(inside, key)]
        place = _place(inside, last)
        if to is DROP:
            del inside[place]
        else:
            inside[place] = to(inside[place]) if callable(to) else to
        store(folder, file, value)
        return ()

    return job


def _place(value: Any, key: str) -> str | int:
    if isinstance(value, dict):
        return key
    if re.fullmatch(r"-?\d+", key):
        return int(key)
    names = [(one.get("name", ""), one.get("part", "")) for one in value]
    return next(k for k, some in enumerate(names) if any(name.startswith(key) for name in some))


def plus(by: float) -> Callable[[float], float]:
    return lambda value: value + by


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


def redrawn(name: str, how: Callable[[Any], object]) -> Job:
    """Change the entities of a DXF."""

    def job(folder: Path) -> Sequence[str]:
        document = ezdxf.filemanagement.readfile(folder / name)
        how(document.modelspace())
        text = io.StringIO()
        document.write(text)
        put(folder, name, text.getvalue().encode())
        return ()

    return job


def circles(space: Any) -> list[Any]:
    """Circles to be cut, the smallest first."""
    found = [one for one in space.query("CIRCLE") if one.dxf.layer == "cut"]
    return sorted(found, key=lambda one: one.dxf.radius)


def shifted_circle(space: Any) -> None:
    x, y, _ = circles(space)[0].dxf.center
    circles(space)[0].dxf.center = (x + 0.01, y)


def wider_circle(space: Any) -> None:
    circles(space)[0].dxf.radius += 0.1


def fewer_circles(space: Any) -> None:
    space.delete_entity(circles(space)[0])


def longer_outline(space: Any) -> None:
    for line in space.query("LWPOLYLINE"):
        if line.dxf.layer == "cut":
            line.set_points([(1.001 * x, y, *rest) for x, y, *rest in line.get_points()])


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


def mounted_in(body: str, key: str | None) -> Job:
    """The first fastener that presses on a body is mounted in another step, or in none."""

    def job(folder: Path) -> Sequence[str]:
        value = load(folder, RECORD)
        name = next(one["name"] for one in value["fasteners"] if one["through"][0] == body)
        for step in value["assembly_steps"]:
            step["mounts"] = [one for one in step["mounts"] if one != name]
            if step["key"] == key:
                step["mounts"].append(name)
        store(folder, RECORD, value)
        return ()

    return job


def spigot(cap: str, by: float) -> Job:
    """Make the widest cylinder of a cap's own STEP file thinner, mm."""
    name, pattern = f"{cap}.step", re.compile(r"(CYLINDRICAL_SURFACE\('[^']*',#\d+,)([-+\d.E]+)")

    def job(folder: Path) -> Sequence[str]:
        def how(data: bytes) -> bytes:
            text = data.decode()
            widest = max(float(found[2]) for found in pattern.finditer(text))
            return pattern.sub(
                lambda m: f"{m[1]}{widest - by}" if float(m[2]) == widest else m[0], text
            ).encode()

        return change(folder, name, how) or ()

    return job


def flat_fold(space: Any) -> None:
    space.delete_entity(next(one for one in space.query("LINE") if one.dxf.layer == "fold"))


def drawn_away(name: str, x: float, y: float = 0.0, z: float = 0.0) -> Job:
    """Draw a body of the GLB elsewhere, mm."""

    def how(scene: trimesh.Scene) -> None:
        scene.geometry[scene.graph[name][1]].apply_translation([x, y, z])

    return glb(how)


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


def shifted(key: str, by: float) -> Callable[[Rows], None]:
    def how(rows: Rows) -> None:
        for one in rows:
            one[key] = repr(float(one[key]) + by)

    return how


def compact(folder: Path) -> Sequence[str]:
    """prototype.json in one line."""
    put(folder, RECORD, json.dumps(load(folder, RECORD)).encode())
    return ()
