"""The object before the cameras: its shape and its colours, from a file or built in."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tbcad.errors import InputError
from tbcad.geometry.vectors import unit
from tbcad.simulate.plausibility import warn_of_small_object
from tbcad.types import Bytes, Floats, Ints

Paint = Literal["own", "pattern", "plain"]

MAX_FILE_BYTES = 1 << 30  # bytes
MAX_FACETS = 20_000_000
# Larger than the capture sphere by less than rounding in a file: not too large.
ROUNDING = 1e-6
GREY = 0.8
CELL_MM = 6.0  # side of the built-in pattern's cubes
KNOT = (2, 3)  # turns about the axis and through the hole: a trefoil
KNOT_FACETS = (240, 40)
BALL_DIVISIONS = 5  # of an icosahedron: 20,480 facets


@dataclass(frozen=True)
class SceneObject:
    """A triangle mesh with a colour at each corner of each facet, or a picture on it.

    Attributes:
        name: what it is, for records.
        points: corners, mm, (v, 3), z up, in the frame of the design.
        faces: corners of the facets, (f, 3).
        normals: unit normals at the corners, for shading, (v, 3).
        albedo: red, green, blue at each facet's corners, 0 to 1, (f, 3, 3).
        uv: where each facet's corners lie on `texture`, 0 to 1 from its lower left, (f, 3, 2).
        texture: the picture, (h, w, 3); None where `albedo` says it all.
        patterned: whether the built-in pattern is painted over it.
        light: on each corner, 0 to 1, (v,); None for the built-in light.
    """

    name: str
    points: Floats
    faces: Ints
    normals: Floats
    albedo: Floats
    uv: Floats | None = None
    texture: Bytes | None = None
    patterned: bool = False
    light: Floats | None = None

    @property
    def radius(self) -> float:
        """Distance of the farthest point from the origin, mm."""
        return float(np.linalg.norm(self.points, axis=1).max())


def load_object(
    path: Path, capture_mm: float, fit: bool = False, paint: Paint = "own"
) -> SceneObject:
    """Read a triangle mesh in millimetres, z up, about the origin.

    Args:
        path: any file that trimesh reads; its textures must be in the same folder.
        capture_mm: diameter of the capture sphere.
        fit: move and scale it so that it just fits that sphere.
        paint: its own colours, or the built-in pattern where the file has none; the pattern in any
            case; or plain grey.

    Raises:
        InputError: it cannot be read, is empty, has no facets or is too large; it names the size.

    Warns:
        PlausibilityWarning: it is so small that its unit is likely to be another one.
    """
    mesh = _read(path)
    points = np.asarray(mesh.vertices, dtype=np.float64)
    faces = np.asarray(mesh.faces, dtype=np.int64)
    _check(path, points, faces)
    points = _fitted(points, faces, capture_mm) if fit else points
    colours = _colours(mesh, faces) if paint == "own" else {}
    patterned = not colours and paint != "plain"
    normals = np.asarray(mesh.vertex_normals, dtype=np.float64)
    plain = np.full((len(faces), 3, 3), GREY)
    fields = {"albedo": plain, "patterned": patterned, **colours}
    subject = SceneObject(path.name, points, faces, normals, **fields)
    _check_size(path, subject, capture_mm)
    return subject


def load_or_built_in(
    path: Path | str | None, capture_mm: float, fit: bool = False, paint: Paint = "own"
) -> SceneObject:
    """The object of a file, as `load` reads it, or without one the built-in one."""
    if path is None:
        return built_in_object(capture_mm)
    return load_object(Path(path), capture_mm, fit, paint)


def built_in_object(capture_mm: float) -> SceneObject:
    """A trefoil knot with a hue that runs along it: it hides parts of itself from every side."""
    t, s = (np.linspace(0, 2 * np.pi, k, endpoint=False) for k in KNOT_FACETS)
    middle = _knot(t)
    points = middle[:, None] + 0.55 * _ring(t, s)
    points *= 0.98 * capture_mm / 2 / np.linalg.norm(points, axis=2).max()
    faces = _grid(*KNOT_FACETS)
    normals = _ring(t, s).reshape(-1, 3)
    hue = np.broadcast_to((t / (2 * np.pi))[:, None], KNOT_FACETS).ravel()
    return SceneObject(
        "trefoil knot", points.reshape(-1, 3), faces, normals, rainbow(hue)[faces], patterned=False
    )


def patterned_ball(radius: float) -> SceneObject:
    """A ball about the origin of this radius (mm) with the built-in pattern."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=BALL_DIVISIONS, radius=radius)
    points, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces)
    white = np.ones((len(faces), 3, 3))
    return SceneObject(f"ball of {radius:g} mm", points, faces, unit(points), white, patterned=True)


def rainbow(hue: Floats) -> Floats:
    """Red, green, blue (..., 3) of hues (...) in turns, bright and of nearly even weight."""
    phase = 2 * np.pi * (hue[..., None] - np.array([0, 1, 2]) / 3)
    return np.asarray(0.55 + 0.4 * np.cos(phase))


def pattern(points: Floats) -> Floats:
    """Colours (..., 3) of the built-in pattern: cubes in space, each of its own hue and weight."""
    cube = np.floor(points / CELL_MM).astype(np.int64)
    mixed = (cube * np.array([73_856_093, 19_349_663, 83_492_791])).sum(axis=-1)
    hue = (mixed % 17) / 17
    weight = 0.55 + 0.45 * (cube.sum(axis=-1) % 2)
    return np.asarray(rainbow(hue) * weight[..., None])


def _knot(t: Floats) -> Floats:
    about, through = KNOT
    out = 2 + np.cos(through * t)
    return np.stack([out * np.cos(about * t), out * np.sin(about * t), np.sin(through * t)], -1)


def _ring(t: Floats, s: Floats) -> Floats:
    """Unit vectors (k, j, 3) across the knot at t (k,), around it at s (j,)."""
    step = 1e-4
    along = unit(_knot(t + step) - _knot(t - step))
    across = unit(np.cross(along, [0.0, 0.0, 1.0]))
    other = np.cross(along, across)
    cosine, sine = np.cos(s)[None, :, None], np.sin(s)[None, :, None]
    return np.asarray(cosine * across[:, None] + sine * other[:, None])


def _grid(rows: int, columns: int) -> Ints:
    """Facets of a grid that is closed in both directions."""
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = (i + 1) % rows * columns + (j + 1) % columns, (i + 1) % rows * columns + j
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def _read(path: Path) -> Any:
    import trimesh

    if not path.is_file():
        raise InputError(f"{path}: no such file; give a triangle mesh (PLY, STL, OBJ, GLB ...)")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise InputError(f"{path} is over 1 GiB: reduce the mesh first")
    try:
        return trimesh.load_mesh(path, process=False)
    except Exception as error:  # trimesh's readers raise whatever their libraries do
        reason = str(error) or type(error).__name__
        raise InputError(f"{path} cannot be read as a mesh: {reason}: name another") from error


def _check(path: Path, points: Floats, faces: Ints) -> None:
    if len(points) == 0:
        raise InputError(f"{path} is empty: name a mesh with facets")
    if len(faces) == 0:
        raise InputError(f"{path} has points but no facets: name a triangle mesh")
    if len(faces) > MAX_FACETS:
        raise InputError(f"{path} has {len(faces)} facets, allowed are {MAX_FACETS}: reduce it")
    if not np.isfinite(points).all():
        raise InputError(f"{path} has points that are not finite: repair the mesh")


def _check_size(path: Path, subject: SceneObject, capture_mm: float) -> None:
    used = subject.points[np.unique(subject.faces)]
    size, reach = np.ptp(used, axis=0), 2 * float(np.linalg.norm(used, axis=1).max())
    if size.max() == 0:
        raise InputError(f"{path} has no extent: all its points are one: name another")
    if reach > capture_mm * (1 + ROUNDING):
        raise InputError(
            f"{path} does not fit the capture sphere: it is {size[0]:.4g} x {size[1]:.4g} x "
            f"{size[2]:.4g} mm and reaches {reach / 2:.4g} mm from the origin, allowed is "
            f"{capture_mm / 2:g}: move or scale it, or use --fit"
        )
    warn_of_small_object(path.name, float(size.max()), capture_mm)


def _fitted(points: Floats, faces: Ints, capture_mm: float) -> Floats:
    """Points moved and scaled so that the smallest sphere about them is the capture sphere."""
    import trimesh

    used = points[np.unique(faces)]
    if np.ptp(used, axis=0).max() == 0:
        return points
    centre, _ = trimesh.nsphere.minimum_nsphere(used)
    reach = np.linalg.norm(used - centre, axis=1).max()
    return np.asarray((points - centre) * (capture_mm / 2 / reach))


def _colours(mesh: Any, faces: Ints) -> dict[str, Any]:
    """What the file says of colours, as fields of Subject; nothing where it says nothing."""
    visual = mesh.visual
    if visual.kind == "texture" and visual.uv is not None:
        picture = _picture(visual.material)
        if picture is not None:
            return {"uv": np.asarray(visual.uv, dtype=np.float64)[faces], "texture": picture}
        colour = np.asarray(visual.material.main_color, dtype=np.float64)[:3] / 255
        return {"albedo": np.broadcast_to(colour, (len(faces), 3, 3)).copy()}
    if visual.kind == "vertex":
        return {"albedo": np.asarray(visual.vertex_colors)[:, :3][faces] / 255}
    if visual.kind == "face":
        return {"albedo": np.repeat(np.asarray(visual.face_colors)[:, None, :3] / 255, 3, axis=1)}
    return {}


def _picture(material: Any) -> Bytes | None:
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    return None if image is None else np.asarray(image.convert("RGB"))
