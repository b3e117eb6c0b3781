"""A small prototype made without tbcad: three balls and a cap on bars, and a plan by hand.

Every mirror has a stop of its own, so nothing has to be planned; the base is made by booleans of
meshes. Angles in degrees, lengths in mm.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass, field
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from tbcad.cad.formats.glb import ColouredMesh, write_glb
from tbcad.cad.kernel.mesh import Mesh
from tests.verify.synthetic_export import (
    PIN,
    B,
    Cells,
    csv_bytes,
    document,
    mirrored,
    poses,
    rows,
    solid,
    stl,
    table,
    unit,
)
from tests.verify.synthetic_export import Design as Shell
from tests.verify.synthetic_export import write as write_files

TILT = np.radians(50.0)
PAD = 2.0
POLAR = (55.0, 80.0, 100.0, 122.0)
AZIMUTH = (30.0, 0.0, -35.0, 40.0)
CAP, EDGE = 3, 5.0  # the last of them, from 0; radius of its front's edge
TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # how parts lie on the bed
# What is not made: no STEP assembly, no parts list, names and balls of its own, no weight, seats
# that are printed with their pads down;
# and its only LED stands where the object is.
NOT_MADE = {
    *("inventory", "leds as designed", "assembly step", "plate holes", "drawings"),
    *("fasteners", "fastener holes", "key access", "homing", "controller settings", "klipper"),
    *("camera mount", "camera gauge", "cap tilt", "plays", "shroud", "radius rule"),
    *("upper lamps", "light ratio of the prototype", "hidden by upper lamps"),
    "glare of upper lamps",
    *("lamps", "light before and after", "light of the lamps", "light from above"),
    *("light in the stage's shadow", "hold ratio", "drive", "motor bearing", "power off"),
    *("fall energy", "axial chain", "object room", "leds seen", "part files"),
}


@dataclass
class SyntheticPrototype:
    """What to make.

    `pads` shifts pads off their balls, by ball and pad; `bump` is how deep a knob of the base
    reaches into the first ball; `grown` grows the cap's front; `more` are boxes (low, high) to be
    added by role and name; `motor` is a box that is bought; `drawn_off` is how far bodies of the
    assembly are drawn beside their places.
    """

    target: float = 25.0
    radius: float = 5.0
    front: float = 10.0
    moved: bool = True
    shell: bool = False
    pads: dict[tuple[int, int], float] = field(default_factory=dict)
    bump: float = 0.0
    grown: float = 0.0
    stage_mm: float = 4.0
    more: dict[str, tuple[str, Any, Any]] = field(default_factory=dict)
    motor: tuple[Any, Any] = ([300, 300, 300], [340, 340, 340])
    drawn_off: dict[str, float] = field(default_factory=dict)


def frame() -> np.ndarray:
    axis = PIN / np.linalg.norm(PIN)
    zero = unit(np.array([0.0, 0, 1]) - axis[2] * axis)
    return np.stack([axis, zero, np.cross(axis, zero)])


def direction(polar: float, azimuth: float) -> np.ndarray:
    p, a = np.radians([polar, azimuth])
    local = [np.cos(p), np.sin(p) * np.cos(a), np.sin(p) * np.sin(a)]
    return np.array(local) @ frame()


def angles(u: np.ndarray) -> np.ndarray:
    along, zero, third = u @ frame().T
    return np.degrees([np.arctan2(np.hypot(zero, third), along), np.arctan2(third, zero)])


def turned(x: np.ndarray, angle: float) -> np.ndarray:
    return np.asarray(Rotation.from_rotvec(np.radians(angle) * frame()[0]).apply(x))


@dataclass
class Ball:
    """One ball: apex, normal, radii, centres and contacts."""

    p: np.ndarray
    n: np.ndarray
    radius: float
    body: float
    c: np.ndarray
    b: np.ndarray
    normals: np.ndarray


def make_balls(spec: SyntheticPrototype) -> list[Ball]:
    half = np.linalg.norm(PIN) / 2
    balls = []
    for k, (polar, azimuth) in enumerate(zip(POLAR, AZIMUTH, strict=True)):
        u = direction(polar, azimuth)
        p = B**2 / (np.hypot(B, half) - half * (u @ unit(PIN))) * u
        n = unit(unit(PIN - p) - u)
        radius, body, depth = spec.radius, spec.radius, spec.radius
        if k == CAP:
            radius = spec.front
            body, depth = np.sqrt(2) * EDGE, radius - np.sqrt(radius**2 - EDGE**2) + EDGE
        side = unit(np.cross(n, [0.3, 0.2, 0.9]))
        across = np.cross(n, side)
        turn = np.radians([0.0, 120, 240])[:, None]
        lean = np.cos(turn) * side + np.sin(turn) * across
        normals = np.cos(TILT) * n - np.sin(TILT) * lean
        balls.append(Ball(p, n, radius, body, p - radius * n, p - depth * n, normals))
    return balls


def cylinder(start: np.ndarray, along: np.ndarray, radius: float, length: float) -> Any:
    """A cylinder from a point on, 48 corners round."""
    z = unit(along)
    x = unit(np.cross(z, [0.31, 0.83, 0.46]))
    axes = np.stack([x, np.cross(z, x), z], axis=1)
    upright = manifold3d.Manifold.cylinder(length, radius, radius, 48)
    return upright.transform(np.hstack([axes, start[:, None]]))


def base(spec: SyntheticPrototype, balls: list[Ball]) -> Any:
    """Bosses with three posts each, and bars between them behind the ellipsoid."""
    bodies = []
    for k, ball in enumerate(balls):
        back = -ball.n
        bodies.append(cylinder(ball.b + (ball.body + 1) * back, back, 1.2 * ball.body + 2, 6.0))
        for j, normal in enumerate(ball.normals):
            away = ball.body + spec.pads.get((k, j), 0.0)
            bodies.append(cylinder(ball.b - away * normal, -normal, PAD / 2, 0.6 * ball.body + 4))
    if spec.bump:
        ball = balls[0]
        start = ball.b + (ball.body - spec.bump) * -ball.n
        bodies.append(cylinder(start, -ball.n, 0.5, 4.0))
    for one, two in pairwise(balls):
        bodies += bars(one.b - (one.body + 4) * one.n, two.b - (two.body + 4) * two.n)
    return manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add)


def bars(start: np.ndarray, end: np.ndarray) -> list[Any]:
    """Bars over an arc that keeps away from the object."""
    share = np.linspace(0, 1, 9)[:, None]
    way = unit((1 - share) * unit(start) + share * unit(end))
    points = way * ((1 - share) * np.linalg.norm(start) + share * np.linalg.norm(end))
    knots = [manifold3d.Manifold.sphere(2.0, 16).translate(point) for point in points]
    return [manifold3d.Manifold.batch_hull(pair) for pair in pairwise(knots)]


def cap(spec: SyntheticPrototype, ball: Ball) -> Any:
    """Body and front turned about the normal, every corner on its sphere."""
    radius = ball.radius + spec.grown
    depth = (ball.p - ball.b) @ ball.n
    rim = np.arcsin(EDGE / radius)
    front = np.linspace(0, rim, 24)[1:]
    start = np.arctan2(EDGE, depth - radius * (1 - np.cos(rim)))
    body = np.linspace(start, np.pi, 60)[1:]
    up = radius * np.cos(front) - ball.radius + depth
    behind = ball.body * np.stack([np.sin(body[:-1]), np.cos(body[:-1])], axis=1)
    line = np.vstack([np.stack([radius * np.sin(front), up], axis=1), behind])
    return lathe(line, depth + spec.grown, -ball.body, ball.b, ball.n)


def lathe(line: np.ndarray, top: float, bottom: float, at: np.ndarray, z: np.ndarray) -> Any:
    """A line of (out, up) turned about z, closed by a point at either end; 60 corners round."""
    x = unit(np.cross(z, [0.31, 0.83, 0.46]))
    profile = np.vstack([[0, bottom], line[::-1], [0, top]])
    mesh = trimesh.creation.revolve(profile, sections=60)
    points = mesh.vertices @ np.stack([x, np.cross(z, x), z]) + at
    return manifold3d.Manifold(manifold3d.Mesh64(points, mesh.faces.astype(np.uint64)))


def box(low: Any, high: Any) -> Any:
    low, high = np.asarray(low, float), np.asarray(high, float)
    return manifold3d.Manifold.cube(high - low).translate(low)


def facets(shape: Any) -> np.ndarray:
    mesh = shape.to_mesh64()
    return mesh.vert_properties[:, :3][mesh.tri_verts]


def pictures(record: list[dict[str, Any]]) -> list[list[Any]]:
    """The plan's rows: every mirror at a stop of its own, the ball of nearest polar angle."""
    shown = []
    for m in record:
        polar, azimuth = angles(m["u"])
        k = int(np.abs(np.array(POLAR) - polar).argmin())
        shown.append((azimuth - AZIMUTH[k], k, m))
    shown.sort(key=lambda one: (one[0], one[2]["number"]))
    stops = sorted({one[0] for one in shown})
    plan: list[list[Any]] = []
    twin = {m["number"]: image(m, record) for m in record}
    for turn in (0, 180):
        for angle, k, m in shown:
            name = f"a{m['number']:04d}" if turn == 0 else f"b{twin[m['number']]:04d}"
            plan.append([len(plan) + 1, turn, stops.index(angle) + 1, angle, k + 1, name])
    return plan


def image(m: dict[str, Any], record: list[dict[str, Any]]) -> int:
    """Number of camera b's mirror in the direction turned by 180 degrees about z."""
    # Camera b's mirror number j looks along (-x, y, z) of camera a's number j.
    wanted = m["u"] * np.array([1.0, -1, 1])
    return min(record, key=lambda one: float(np.linalg.norm(one["u"] - wanted)))["number"]


def stop_rows(plan: list[list[Any]]) -> list[list[Any]]:
    return [[stop, angle] for stop, angle in sorted({(row[2], row[3]) for row in plan})]


def switch_angle(stops: list[list[Any]]) -> float:
    """Base angle at which the switch trips, below all stops."""
    return float(np.floor(min(stops[0][1], 0.0))) - 8.0


def program(stops: list[list[Any]]) -> str:
    """As tbcad writes it, by hand: times and speeds are those of the paper's design."""
    at = [f"X{np.trunc(row[1] * 1e4) / 1e4:.4f}" for row in stops]
    expose = ["G4 P0.100", "M8", "G4 P0.200", "M9", "G4 P1.000"]
    lights = [expose, ["M64 P1", *expose, "M65 P1"], ["M64 P0", *expose, "M65 P0"]]
    lines = [
        f"(rotation plan: {len(stops)} stops, twice, about 1 min)",
        "M0 (MSG, zero pin out, object straight? Then resume)",
        "$H",
        "G21 G90 G94 G54 (a degree for a millimetre, absolute, units a minute)",
        f"G92 X{switch_angle(stops) + 2:.4f}",
        "M65 P1",
        "M65 P0",
    ]
    for run in range(2):
        lines.append(f"G1 {at[0]} F900")
        for k in range(len(stops)):
            lines.append(f"(stop {k + 1} of {len(stops)}: 1 mirrors)")
            lines += [f"G1 {at[k]}", "G4 P0.500", *chain.from_iterable(lights)]
        if run == 0:
            lines.append(f"G1 {at[0]}")
            lines.append("M0 (MSG, turn the object by 180 degrees about z, then resume)")
    return "\n".join([*lines, "G1 X0.0000", "G92.1", "M2"]) + "\n"


def ball_rows(balls: list[Ball]) -> list[dict[str, Any]]:
    out = []
    for k, ball in enumerate(balls):
        row: dict[str, Any] = {"number": k + 1, "kind": "cap" if k == CAP else "ball"}
        row |= {"diameter_mm": 2 * float(ball.body), "mass_g": None if k == CAP else 4.0}
        row["grade"] = "" if k == CAP else "G10"
        row |= {"radius_mm": float(ball.radius), "body_radius_mm": float(ball.body)}
        polar, azimuth = angles(unit(ball.p)).tolist()
        row |= {"polar_deg": polar, "azimuth_deg": azimuth}
        for name, v in {"p": ball.p, "n": ball.n, "c": ball.c, "b": ball.b}.items():
            row |= {name + axis: x for axis, x in zip("xyz", (v + 0.0).tolist(), strict=True)}
        row |= dict.fromkeys(("sag_x_mm", "sag_y_mm", "sag_z_mm"), 0.0)
        out.append(row)
    return out


def parts(
    spec: SyntheticPrototype, balls: list[Ball]
) -> dict[str, tuple[str, int | None, np.ndarray]]:
    """Facets in the frame of the shell, by name, with role and ball."""
    r = spec.stage_mm
    shapes = {
        "carrier": ("base", None, base(spec, balls)),
        "cap_4": ("cap", CAP + 1, cap(spec, balls[CAP])),
        "stage": ("stage", None, box([-r, -r, -8.0], [r, r, -6.0])),
        "foot": ("frame", None, box([-140, -40, -300], [140, 40, -290])),
        "coupon": ("tool", None, box([0, 0, 0], [20, 10, 5])),
    }
    shapes |= {name: (role, None, box(*ends)) for name, (role, *ends) in spec.more.items()}
    return {name: (role, ball, facets(shape)) for name, (role, ball, shape) in shapes.items()}


def prototype(spec: SyntheticPrototype) -> tuple[dict[str, Any], dict[str, bytes]]:
    """prototype.json as a value, and all other files of the prototype."""
    record, balls = poses(shell_of(spec)), make_balls(spec)
    plan = [
        [float(x) if isinstance(x, np.floating) else x for x in row] for row in pictures(record)
    ]
    stops = stop_rows(plan)
    table_ = ball_rows(balls)
    files = {
        "balls.csv": csv_bytes(",".join(table_[0]), [list(row.values()) for row in table_]),
        "rotation_plan.csv": csv_bytes(
            "order,object_turn_deg,stop,base_angle_deg,ball,mirror", plan
        ),
        "stops.csv": csv_bytes("stop,base_angle_deg", stops),
        "rotation_plan.nc": program(stops).encode(),
        "grbl_settings.txt": b"($1)\n",
    }
    entries = []
    drawn = {"motor": facets(box(*spec.motor))}
    for name, (role, ball, corners) in parts(spec, balls).items():
        if role != "tool":
            drawn[name] = corners
        low = float((corners @ TURN)[..., 2].min())
        origin = np.array([3.0, -2.0, -low])
        files[f"{name}.stl"] = stl((corners @ TURN + origin).astype(np.float32))
        entry = {"name": name, "stl": f"{name}.stl", "role": role, "finish": None, "ball": ball}
        entries.append(entry | {"axes": TURN.tolist(), "origin_mm": origin.tolist()})
    for k, ball_ in enumerate(balls):
        if k != CAP:
            whole = trimesh.creation.uv_sphere(ball_.body, count=[32, 32])
            drawn[f"ball_{k + 1}"] = whole.triangles + ball_.b
    files["whole.glb"] = glb(spec, drawn)
    found = {
        "schema": "tbcad-prototype/2",
        "camera": "a",
        "swing_deg": [switch_angle(stops), stops[-1][1]],
        "balls": "balls.csv",
        "seats": [
            {
                "ball": k + 1,
                "axis": (-ball.n).tolist(),
                "normals": ball.normals.tolist(),
                "contacts_mm": (ball.b - ball.body * ball.normals).tolist(),
                "pad_diameter_mm": PAD,
            }
            for k, ball in enumerate(balls)
        ],
        "parts": entries,
        "leds": [{"name": "led_1", "position_mm": [1.0, 1.0, -5.0]}],
        "controller": {"board": "OCTOPUS-PRO-1.1"},
        "home": {
            "switch_deg": switch_angle(stops),
            "homed_deg": switch_angle(stops) + 2,
            "travel_deg": 200.0,
            "pin": "ROD-4x40",
            "zero_error_deg": 0.7,
        },
        **{key: [] for key in ("fasteners", "assembly_steps", "drawings", "caps")},
        "bought": [{"name": "motor", "part": "NEMA17-40", "turns": False, "finish": None}],
        **dict.fromkeys(("lamps", "shroud")),
        "assembly": {"glb": "whole.glb"},
    }
    return found, files


def glb(spec: SyntheticPrototype, drawn: dict[str, np.ndarray]) -> bytes:
    """Triangles (F, 3, 3) in mm as a build draws them."""
    bodies = []
    for name, corners in drawn.items():
        points = np.add(corners, [spec.drawn_off.get(name, 0.0), 0, 0]).reshape(-1, 3)
        mesh = Mesh(points, np.arange(len(points)).reshape(-1, 3))
        bodies.append(ColouredMesh(name, "all", mesh, (0.5, 0.5, 0.5, 1.0)))
    with tempfile.TemporaryDirectory() as room:
        write_glb(Path(room) / "whole.glb", "prototype", bodies)
        return (Path(room) / "whole.glb").read_bytes()


def shell_of(spec: SyntheticPrototype) -> Shell:
    return Shell(target=spec.target)


def export(folder: Path, spec: SyntheticPrototype) -> Path:
    """Write a whole export; without a shell unless asked."""
    design = shell_of(spec)
    record = poses(design)
    mirrors = rows(design, record)
    found = document(design)
    found["spec"]["prototype"]["picture"] = "moved" if spec.moved else "fixed"
    files = {"mirrors.csv": table(mirrors), "camera.json": b"for people"}
    if spec.shell:
        a = solid(Cells(design, record))
        files |= {"shell_a.stl": stl(a), "shell_b.stl": stl(mirrored(a))}
    else:
        found["parts"] = []
    files["design.json"] = json.dumps(found).encode()
    value, more = prototype(spec)
    files |= {"prototype.json": json.dumps(value, indent=1).encode(), **more}
    return write_files(folder, files)
