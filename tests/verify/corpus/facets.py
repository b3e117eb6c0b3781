"""The triangles of one half, in STL and 3MF alike; those of one mirror, and it elsewhere."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tbcad.types import Floats
from tests.verify.corpus.copies import load, load_mirrors, put
from tests.verify.synthetic_export import facets_of, stl

Corners = NDArray[np.float32]  # (F, 3, 3) facet, corner, axis; mm
MODEL = "3D/3dmodel.model"
VERTEX = '<vertex x="%.6f" y="%.6f" z="%.6f"/>\n'
TRIANGLE = '<triangle v1="%d" v2="%d" v3="%d"/>\n'
HALVES = ("a", "b")
TOUCHES_MM = 2e-5  # float32, 150 mm from the origin
AIM = np.array([0.6, 0.15, 0.6])  # well inside both halves


def read(folder: Path, half: str) -> Corners:
    """Corners from the STL."""
    return facets_of(folder / f"shell_{half}.stl")


def write(folder: Path, half: str, corners: Corners) -> None:
    """The same corners to both files; the synthetic export has no 3MF."""
    write_stl(folder, f"shell_{half}.stl", corners)
    if (folder / f"shell_{half}.3mf").exists():
        write_3mf(folder, f"shell_{half}.3mf", corners)


def write_stl(folder: Path, name: str, corners: Corners, turn: int = 1) -> None:
    """Corners as binary STL; `turn` -1 stores the normals against the corners' order."""
    put(folder, name, stl(corners, turn))


def write_3mf(folder: Path, name: str, corners: Corners) -> None:
    """Corners in place of those of a 3MF."""

    def other(model: str) -> str:
        head, _, rest = model.partition("<vertices>")
        return head + mesh_text(corners) + rest.partition("</triangles>")[2]

    edit_3mf(folder, name, other)


def mesh_text(corners: Corners) -> str:
    """Vertices and triangles as 3MF has them."""
    points, index = shared(corners)
    vertices = VERTEX * len(points) % tuple(points.ravel().tolist())
    triangles = TRIANGLE * len(index) % tuple(index.ravel().tolist())
    return f"<vertices>\n{vertices}</vertices>\n<triangles>\n{triangles}</triangles>"


def shared(corners: Corners) -> tuple[Corners, NDArray[np.intp]]:
    """Points (N, 3), each once, and (F, 3) which of them a facet's corners are."""
    flat = corners.reshape(-1, 3) + np.float32(0)
    points, index = np.unique(flat, axis=0, return_inverse=True)
    return points, index.reshape(-1, 3)


def edit_3mf(folder: Path, name: str, how: Callable[[str], str]) -> None:
    """Change the model's text in a 3MF."""

    def other(members: dict[str, bytes]) -> dict[str, bytes]:
        text = members[MODEL].decode()
        changed = how(text)
        assert changed != text, "nothing was changed"
        return {**members, MODEL: changed.encode()}

    edit_members(folder, name, other)


def edit_members(
    folder: Path, name: str, how: Callable[[dict[str, bytes]], dict[str, bytes]]
) -> None:
    """Change the members of a zip."""
    with zipfile.ZipFile(folder / name) as archive:
        members = {item: archive.read(item) for item in archive.namelist()}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for item, data in how(members).items():
            archive.writestr(item, data)
    put(folder, name, buffer.getvalue())


@dataclass(frozen=True)
class Ball:
    """A mirror's surface in the mesh."""

    id: str
    apex: Floats
    normal: Floats
    centre: Floats
    radius: float
    size: float

    def bent(self, radius: float) -> Ball:
        """Another radius, the apex where it is."""
        return replace(self, centre=self.apex - radius * self.normal, radius=radius)


def balls(folder: Path, half: str) -> list[Ball]:
    """All mirrors of a half, those in the middle of it first."""
    coat = load(folder, "design.json")["coating_mm"]
    found = []
    for row in load_mirrors(folder):
        apex, normal, centre = (np.array([row[k + axis] for axis in "xyz"]) for k in "pnc")
        radius = row["radius_mm"] - coat
        if row["camera"] == half:
            found.append(
                Ball(row["id"], apex - coat * normal, normal, centre, radius, row["size_mm"])
            )
    side = np.array([1 if half == "a" else -1, 1, 1])
    return sorted(found, key=lambda ball: float(-ball.apex @ (AIM * side) / _length(ball.apex)))


def patch(corners: Corners, ball: Ball) -> NDArray[np.bool_]:
    """(F,) facets of a mirror: all three corners are on its sphere, near its apex."""
    near = np.abs(corners - ball.apex.astype(np.float32)).max(axis=(1, 2)) < 4 * ball.size
    mine = np.zeros(len(corners), bool)
    mine[near] = (np.abs(off(corners[near], ball)) < TOUCHES_MM).all(axis=1)
    return mine


def off(points: NDArray[np.floating], ball: Ball) -> Floats:
    """(...) how far points (..., 3) are outside a ball."""
    return np.asarray(_length(points - ball.centre) - ball.radius)


def inner(corners: Corners, ball: Ball) -> Corners:
    """(N, 3) points of a mirror's patch that no other facet has."""
    mine = patch(corners, ball)
    return _only(corners[mine], corners[~mine])


def replaced(corners: Corners, before: Corners, after: NDArray[np.floating]) -> Corners:
    """Every corner that is one of `before` (N, 3) put where `after` has it."""
    where = {point.tobytes(): k for k, point in enumerate(before)}
    flat = corners.reshape(-1, 3).copy()
    low, high = before.min(axis=0), before.max(axis=0)
    for k in np.flatnonzero(((flat >= low) & (flat <= high)).all(axis=1)).tolist():
        found = where.get(flat[k].tobytes())
        if found is not None:
            flat[k] = after[found]
    return flat.reshape(-1, 3, 3)


def reshaped(corners: Corners, every: Iterable[Ball], *new: Ball) -> Corners:
    """The mesh with some balls in place of those of the same id.

    A point stays on all the balls that it was on, so neighbours meet the new ones exactly.
    """
    now = {ball.id: ball for ball in every}
    for ball in new:
        old = now[ball.id]
        points = np.unique(corners[patch(corners, old)].reshape(-1, 3), axis=0)
        near = [one for one in now.values() if _length(one.apex - old.apex) < 6 * old.size]
        moved = np.array([_settled(point, near, ball) for point in points])
        corners = replaced(corners, points, moved)
        now[ball.id] = ball
    return corners


def _settled(point: NDArray[np.floating], every: list[Ball], new: Ball) -> Floats:
    """The nearest point on all the balls that a point is on, the new one moved, by Newton."""
    x = point.astype(np.float64)
    mine = [new if ball.id == new.id else ball for ball in every if abs(off(x, ball)) < TOUCHES_MM]
    for _ in range(6):
        slopes = np.array([(x - ball.centre) / _length(x - ball.centre) for ball in mine])
        rest = np.array([off(x, ball) for ball in mine])
        x = x - np.linalg.lstsq(slopes, rest, rcond=1e-6)[0]
    return x


def pushed(how: Callable[[Corners, Ball], NDArray[np.floating]]) -> Callable[..., Corners]:
    """A change to the inner points of one mirror."""

    def job(corners: Corners, every: list[Ball]) -> Corners:
        points = inner(corners, every[0])
        return replaced(corners, points, how(points, every[0]))

    return job


def fan(corners: Corners, ball: Ball) -> Corners:
    """The mirror with as few facets as its outline allows, all corners still on its sphere."""
    mine = patch(corners, ball)
    edges = {(a.tobytes(), b.tobytes()) for a, b in _edges(corners[mine])}
    rim = [(a, b) for a, b in edges if (b, a) not in edges]
    hub = ball.apex.astype(np.float32).tobytes()
    facets = np.frombuffer(b"".join(a + b + hub for a, b in sorted(rim)), np.float32)
    return np.concatenate([corners[~mine], facets.reshape(-1, 3, 3)])


def _edges(corners: Corners) -> list[tuple[Corners, Corners]]:
    return [(facet[k], facet[(k + 1) % 3]) for facet in corners for k in range(3)]


def _only(mine: Corners, others: Corners) -> Corners:
    """Points of some facets that are none of others'."""
    points = np.unique(mine.reshape(-1, 3), axis=0)
    low, high = points.min(axis=0), points.max(axis=0)
    flat = others.reshape(-1, 3)
    taken = {p.tobytes() for p in flat[((flat >= low) & (flat <= high)).all(axis=1)]}
    return points[[p.tobytes() not in taken for p in points]]


def _length(vectors: NDArray[np.floating]) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=-1))
