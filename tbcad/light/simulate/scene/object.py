"""The object before the cameras: its shape and its colours; and the built-in one."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import unit
from tbcad.light.simulate.object_files.finish import Finish
from tbcad.types import Bytes, Floats, Ints

GREY = 0.8
CELL_MM = 6.0  # side of the built-in pattern's cubes
KNOT = (2, 3)  # turns about the axis and through the hole: a trefoil
KNOT_FACETS = (240, 40)
BALL_DIVISIONS = 5  # of an icosahedron: 20,480 facets


@dataclass(frozen=True)
class Reading:
    """How an object's file was taken: unit, axis, colours, and what was left out of it."""

    unit: str
    up: str
    colours: str
    left_out: tuple[str, ...] = ()
    gloss: str = ""  # that of its materials, for --optics real; "" where it is matt

    def line(self, name: str) -> str:
        """One line for the user."""
        gloss = f", gloss in real optics: {self.gloss}" if self.gloss else ""
        return f"{name}: unit {self.unit}, {self.up} up, colours: {self.colours}{gloss}"


@dataclass(frozen=True)
class SceneObject:
    """A triangle mesh with a colour at each corner of each facet, or pictures on it."""

    name: str  # what it is, for records
    points: Floats  # corners, mm, (v, 3), z up, in the frame of the design
    faces: Ints  # corners of the facets, (f, 3)
    normals: Floats  # unit normals at the corners, for shading, on either side, (v, 3)
    albedo: Floats  # red, green, blue at each facet's corners, 0 to 1, (f, 3, 3)
    # where each facet's corners lie on its picture, 0 to 1 from its lower left, (f, 3, 2)
    uv: Floats | None = None
    # pictures below each other, (h, w, 3), which albedo multiplies; None where `albedo` says it all
    texture: Bytes | None = None
    # first row, height and width of each facet's picture in `texture`, (f, 3); height 0 where it
    # has none
    tiles: Ints | None = None
    patterned: bool = False  # whether the built-in pattern is painted over it
    # on each corner, 0 to 1, on the side of the normal and behind it, (v, 2); None for the built-in
    # light
    light: Floats | None = None
    finish: Finish | None = None  # by its materials; None: it is matt
    reading: Reading | None = None  # how its file was taken; None without a file

    @property
    def radius(self) -> float:
        """Distance of the farthest point from the origin, mm."""
        return float(np.linalg.norm(self.points, axis=1).max())


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
