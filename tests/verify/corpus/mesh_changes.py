"""Changes to meshes: in STL and 3MF alike, or in one of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tests.verify.corpus.copies import change, load, put, store
from tests.verify.corpus.facets import HALVES, Corners, read, write, write_3mf, write_stl
from tests.verify.corpus.mutation import Job
from tests.verify.corpus.patches import Ball, balls, inner, patch, replaced, reshaped
from tests.verify.synthetic_export import normals

# Takes a half's corners and its balls, those well inside first.
Change = Callable[[Corners, list[Ball]], Corners]
MICROMETRES_20 = 0.02
INCH = np.float32(25.4)


def mesh(how: Change, named: int = 0, halves: Sequence[str] = "a") -> Job:
    """Change the mesh of halves in both files; the first so many balls must be named."""

    def job(folder: Path) -> Sequence[str]:
        for array in halves:
            write(folder, array, how(read(folder, array), balls(folder, array)))
        return [ball.id for ball in balls(folder, "a")[:named]]

    return job


def moved(corners: Corners, every: list[Ball]) -> Corners:
    ball, across = every[0], np.cross(every[0].normal, [0, 0, 1])
    way = across / np.linalg.norm(across)
    return reshaped(corners, every, ball.at(ball.centre + MICROMETRES_20 * way, ball.radius))


def lowered(corners: Corners, every: list[Ball]) -> Corners:
    ball = every[0]
    return reshaped(
        corners, every, ball.at(ball.centre - MICROMETRES_20 * ball.normal, ball.radius)
    )


def grown(corners: Corners, every: list[Ball]) -> Corners:
    ball = every[0]
    return reshaped(corners, every, ball.at(ball.centre, ball.radius + MICROMETRES_20))


def bent(corners: Corners, every: list[Ball]) -> Corners:
    return reshaped(corners, every, every[0].bent(every[0].radius + MICROMETRES_20))


def swapped(folder: Path) -> Sequence[str]:
    """Two mirrors with each other's radius: those most alike of which it can be told."""
    every = balls(folder, "a")
    one, two = _alike(every)
    new = one.bent(two.radius), two.bent(one.radius)
    write(folder, "a", reshaped(read(folder, "a"), every, *new))
    return one.id, two.id


def _alike(every: list[Ball]) -> tuple[Ball, Ball]:
    some = every[: len(every) // 3]
    pairs = [(one, two) for one in some for two in some if two.radius - one.radius > 0.05]
    return min(pairs, key=lambda pair: pair[1].radius - pair[0].radius)


def lost(corners: Corners, every: list[Ball]) -> Corners:
    """A mirror is not there: its neighbours go on, at most as deep as a cone of two millimetres."""
    ball = every[0]
    near = [other for other in every[1:] if np.linalg.norm(other.apex - ball.apex) < 6 * ball.size]
    points = inner(corners, ball)
    away = np.linalg.norm(points - ball.apex, axis=1)
    cone = 2.0 * (1 - away / away.max())
    deep = np.min([cone, *(depth(points, ball.normal, other) for other in near)], axis=0)
    return replaced(corners, points, (points - deep[:, None] * ball.normal).astype(np.float32))


def depth(points: Corners, normal: np.ndarray, ball: Ball) -> np.ndarray:
    """(N,) how far behind points a ball begins; infinite where it does not."""
    way = points - ball.centre
    along = way @ normal
    root = along**2 - (way**2).sum(axis=1) + ball.radius**2
    found = along - np.sqrt(np.maximum(root, 0))
    return np.where((root > 0) & (found > 0), found, np.inf)


def dented(corners: Corners, every: list[Ball]) -> Corners:
    """One point of a mirror ten micrometres too deep."""
    ball = every[0]
    points = inner(corners, ball)
    point = points[[np.argmin(np.linalg.norm(points - ball.apex, axis=1))]]
    return replaced(corners, point, point - 0.01 * ball.normal)


def warped(points: Corners, ball: Ball) -> Corners:
    """A saddle some three micrometres high that fades towards the rim."""
    way = np.cross(ball.normal, [0, 0, 1])
    across = np.stack([way, np.cross(ball.normal, way)], axis=1) / np.linalg.norm(way)
    x, y = ((points - ball.apex) @ across).T
    away = (x**2 + y**2) / (x**2 + y**2).max()
    height = 0.02 * away * (1 - away) ** 2 * np.cos(2 * np.arctan2(y, x))
    return points + (height[:, None] * ball.normal).astype(np.float32)


def sunk(points: Corners, ball: Ball) -> Corners:
    """The mirror in a pit of a millimetre."""
    return points - ball.normal.astype(np.float32)


def flattened(points: Corners, ball: Ball) -> Corners:
    """The mirror becomes a plane through its apex."""
    height = (points - ball.apex) @ ball.normal
    return (points - height[:, None] * ball.normal).astype(np.float32)


def hollow(points: Corners, ball: Ball) -> Corners:
    """The mirror becomes concave: every point as deep below the rim as it was above."""
    height = (points - ball.apex) @ ball.normal
    return (points - 2 * (height - height.min())[:, None] * ball.normal).astype(np.float32)


def cracked(corners: Corners, every: list[Ball]) -> Corners:
    """One corner of one facet off by the last place of float32."""
    facet = np.flatnonzero(patch(corners, every[0]))[0]
    corners[facet, 0, 2] = np.nextafter(corners[facet, 0, 2], np.float32(1e6))
    return corners


def turned_one(corners: Corners, every: list[Ball]) -> Corners:
    facet = np.flatnonzero(patch(corners, every[0]))[0]
    corners[facet] = corners[facet, ::-1]
    return corners


def without(count: int) -> Change:
    def job(corners: Corners, every: list[Ball]) -> Corners:
        return np.delete(corners, np.flatnonzero(patch(corners, every[0]))[:count], axis=0)

    return job


def opened(corners: Corners, every: list[Ball]) -> Corners:
    return corners[~patch(corners, every[0])]


def doubled(corners: Corners, every: list[Ball]) -> Corners:
    return np.concatenate([corners, corners[patch(corners, every[0])][:1]])


def splinter(corners: Corners, _: list[Ball]) -> Corners:
    """A facet without area on an edge."""
    a, b = corners[0, :2]
    return np.concatenate([corners, [[a, b, a]]])


def tetrahedron(place: np.ndarray, size: float) -> Corners:
    points = place + size * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return points[[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].astype(np.float32)


def loose(way: float, size: float, turn: int = 1) -> Change:
    """A tetrahedron in front of a mirror, or behind it where `way` is negative, mm."""

    def job(corners: Corners, every: list[Ball]) -> Corners:
        place = every[0].apex + way * every[0].normal
        return np.concatenate([corners, tetrahedron(place, size)[:, ::turn]])

    return job


def shifted(x: float, y: float, z: float) -> Change:
    return lambda corners, _: corners + np.array([x, y, z], np.float32)


def rotated(corners: Corners, _: list[Ball]) -> Corners:
    """Turned by a ten thousandth of a radian about z."""
    c, s = np.cos(1e-4), np.sin(1e-4)
    return (corners @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])).astype(np.float32)


def stretched(corners: Corners, _: list[Ball]) -> Corners:
    """A printer's shrinkage of half a thousandth."""
    return corners * np.float32(1.0005)


def mirrored(corners: Corners, _: list[Ball]) -> Corners:
    return (corners * np.array([-1, 1, 1], np.float32))[:, ::-1]


def exchanged(folder: Path) -> Sequence[str]:
    one, two = (read(folder, half) for half in HALVES)
    write(folder, "a", two)
    write(folder, "b", one)
    return ["missing"]


def number(value: float) -> Change:
    def job(corners: Corners, every: list[Ball]) -> Corners:
        corners[np.flatnonzero(patch(corners, every[0]))[0], 1, 1] = value
        return corners

    return job


def backs(folder: Path) -> Sequence[str]:
    write_stl(folder, "shell_a.stl", read(folder, "a"), turn=-1)
    return ()


def ascii_stl(folder: Path) -> Sequence[str]:
    """Some of the mesh as text, which is all that is read of it."""
    corners = read(folder, "a")[:2000]
    lines = ["solid shell_a"]
    for normal, facet in zip(normals(corners), corners, strict=True):
        lines += [f"facet normal {_three(normal)}", " outer loop"]
        lines += [*(f"  vertex {_three(corner)}" for corner in facet), " endloop", "endfacet"]
    put(folder, "shell_a.stl", "\n".join([*lines, "endsolid", ""]).encode())
    return ()


def _three(values: np.ndarray) -> str:
    return " ".join(f"{value:e}" for value in values)


def post(folder: Path) -> Sequence[str]:
    """A further part, rightly listed: it stands between a mirror and its camera."""
    ball = balls(folder, "a")[0]
    pinhole = np.array(load(folder, "design.json")["cameras"][0]["pinhole_mm"])
    way = (pinhole - ball.apex) / np.linalg.norm(pinhole - ball.apex)
    return part(folder, "post", tetrahedron(ball.apex + 20 * way - 2, 4))


def part(folder: Path, name: str, corners: Corners) -> Sequence[str]:
    design, manifest = load(folder, "design.json"), load(folder, "manifest.json")
    design["parts"].append({"name": name, "stl": f"{name}.stl"})
    manifest["files"][f"{name}.stl"] = {}
    write_stl(folder, f"{name}.stl", corners)
    store(folder, "design.json", design)
    store(folder, "manifest.json", manifest)
    return [name]


def only_stl(how: Change) -> Job:
    def job(folder: Path) -> Sequence[str]:
        write_stl(folder, "shell_a.stl", how(read(folder, "a"), balls(folder, "a")))
        return ()

    return job


def only_3mf(how: Change) -> Job:
    def job(folder: Path) -> Sequence[str]:
        write_3mf(folder, "shell_a.3mf", how(read(folder, "a"), balls(folder, "a")))
        return ()

    return job


def lies(count: int) -> Callable[[bytes], bytes]:
    return lambda data: data[:80] + np.uint32(count).tobytes() + data[84:]


def stl_bytes(how: Callable[[bytes], bytes]) -> Job:
    return lambda folder: change(folder, "shell_a.stl", how) or ()
