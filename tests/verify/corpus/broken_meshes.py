"""Broken meshes: the same in STL and 3MF, so that no comparison of the two gives them away."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.verify.corpus.copies import change, load, store
from tests.verify.corpus.facets import (
    HALVES,
    Ball,
    Corners,
    balls,
    fan,
    inner,
    patch,
    pushed,
    read,
    replaced,
    reshaped,
    write,
    write_3mf,
    write_stl,
)
from tests.verify.corpus.mutation import Job, Mutation, failing, refusing
from tests.verify.synthetic_export import mirrored

# Takes a half's corners and its balls, those well inside first.
Change = Callable[[Corners, list[Ball]], Corners]
STL = "shell_a.stl"
MICROMETRES_20 = 0.02
INCH = np.float32(25.4)
ASCII = b"solid shell_a\nfacet normal 0 0 1\n outer loop\n" + 3 * b"  vertex 1 2 3\n"


def mesh(how: Change, named: int = 0, halves: Sequence[str] = "a") -> Job:
    """Change the mesh of halves in both files; the first so many balls must be named."""

    def job(folder: Path) -> Sequence[str]:
        for array in halves:
            write(folder, array, how(read(folder, array), balls(folder, array)))
        return [ball.id for ball in balls(folder, "a")[:named]]

    return job


def only_stl(how: Change) -> Job:
    return lambda folder: write_stl(folder, STL, how(read(folder, "a"), balls(folder, "a")))


def only_3mf(how: Change) -> Job:
    return lambda folder: write_3mf(
        folder, "shell_a.3mf", how(read(folder, "a"), balls(folder, "a"))
    )


def stl_bytes(how: Callable[[bytes], bytes]) -> Job:
    return lambda folder: change(folder, STL, how)


def other_ball(how: Callable[[Ball], Ball]) -> Job:
    """The first mirror with another sphere, its neighbours joined to it."""
    return mesh(lambda corners, every: reshaped(corners, every, how(every[0])), 1)


def moved(ball: Ball) -> Ball:
    across = np.cross(ball.normal, [0, 0, 1])
    way = across / np.linalg.norm(across)
    return replace(ball, centre=ball.centre + MICROMETRES_20 * way)


def swapped(folder: Path) -> Sequence[str]:
    """Two mirrors with each other's radius: those most alike of which it can be told."""
    every = balls(folder, "a")
    some = every[: len(every) // 3]
    pairs = [(one, two) for one in some for two in some if two.radius - one.radius > 0.05]
    one, two = min(pairs, key=lambda pair: pair[1].radius - pair[0].radius)
    new = one.bent(two.radius), two.bent(one.radius)
    write(folder, "a", reshaped(read(folder, "a"), every, *new))
    return one.id, two.id


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


def flattened(points: Corners, ball: Ball) -> Corners:
    """The mirror becomes a plane through its apex."""
    height = (points - ball.apex) @ ball.normal
    return (points - height[:, None] * ball.normal).astype(np.float32)


def hollow(points: Corners, ball: Ball) -> Corners:
    """The mirror becomes concave: every point as deep below the rim as it was above."""
    height = (points - ball.apex) @ ball.normal
    return (points - 2 * (height - height.min())[:, None] * ball.normal).astype(np.float32)


def first_facet(how: Callable[[np.ndarray], object]) -> Change:
    """Change the corners (3, 3) of a mirror's first facet in place."""

    def job(corners: Corners, every: list[Ball]) -> Corners:
        how(corners[np.flatnonzero(patch(corners, every[0]))[0]])
        return corners

    return job


def cracked(facet: np.ndarray) -> None:
    """A corner off by the last place of float32."""
    facet[0, 2] = np.nextafter(facet[0, 2], np.float32(1e6))


def turned_one(facet: np.ndarray) -> None:
    facet[:] = facet[::-1].copy()


def number(value: float) -> Job:
    return mesh(first_facet(lambda facet: facet.__setitem__((1, 1), value)))


def one_missing(corners: Corners, every: list[Ball]) -> Corners:
    return np.delete(corners, np.flatnonzero(patch(corners, every[0]))[0], axis=0)


def doubled(corners: Corners, every: list[Ball]) -> Corners:
    return np.concatenate([corners, corners[patch(corners, every[0])][:1]])


def splinter(corners: Corners, _: list[Ball]) -> Corners:
    """A facet without area on an edge."""
    a, b = corners[0, :2]
    return np.concatenate([corners, [[a, b, a]]])


def tetrahedron(place: np.ndarray, size: float) -> Corners:
    points = place + size * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return points[[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].astype(np.float32)


def loose(way: float, size: float) -> Job:
    """A tetrahedron in front of a mirror, or behind it where `way` is negative, mm."""

    def job(corners: Corners, every: list[Ball]) -> Corners:
        place = every[0].apex + way * every[0].normal
        return np.concatenate([corners, tetrahedron(place, size)])

    return mesh(job)


def rotated(corners: Corners, _: list[Ball]) -> Corners:
    """Turned by a ten thousandth of a radian about z."""
    c, s = np.cos(1e-4), np.sin(1e-4)
    return (corners @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])).astype(np.float32)


OWN_IMAGE = mesh(lambda corners, _: mirrored(corners))


def exchanged(folder: Path) -> None:
    one, two = (read(folder, half) for half in HALVES)
    write(folder, "a", two)
    write(folder, "b", one)


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


def lies(count: int) -> Callable[[bytes], bytes]:
    return lambda data: data[:80] + np.uint32(count).tobytes() + data[84:]


def both(how: Callable[[Corners], Corners]) -> Job:
    return mesh(lambda corners, _: how(corners), 0, HALVES)


FOUND = ("mirrors found", "surface error")
MESHES: tuple[Mutation, ...] = (
    *failing(
        "mesh",
        ("a mirror moved 20 um sideways", other_ball(moved), "centre error", "0.0200 mm"),
        (
            "a mirror's radius 20 um too large",
            other_ball(lambda b: replace(b, radius=b.radius + MICROMETRES_20)),
            *("radius error", "0.0200 mm"),
        ),
        ("two mirrors' radii swapped", swapped, "radius error"),
        ("a mirror missing", mesh(lost, 1), FOUND),
        ("a mirror flattened", mesh(pushed(flattened), 1), FOUND),
        ("a mirror hollow", mesh(pushed(hollow), 1), FOUND),
        ("a mirror dented by 10 um", mesh(dented, 1), "surface error"),
        ("a mirror warped by 3 um", mesh(pushed(warped), 1), "form error", "RMS"),
        ("a mirror of too few facets", mesh(lambda c, e: fan(c, e[0]), 1), "coverage, facets"),
        ("a crack, one last place wide", mesh(first_facet(cracked)), "watertight", "open"),
        ("a facet missing", mesh(one_missing), "watertight", "3 open"),
        (
            "a mirror's facets missing",
            mesh(lambda c, e: c[~patch(c, e[0])], 1),
            *("mirrors found", "missing"),
        ),
        ("a facet doubled", mesh(doubled), "watertight", "3 with more than two facets"),
        ("a facet turned", mesh(first_facet(turned_one)), "watertight", "turned against"),
        ("a facet without area", only_stl(splinter), "facets", "1 without area"),
        ("inside out", both(lambda c: c[:, ::-1]), "signed volume", "inside out"),
        (
            "stored normals turned",
            lambda folder: write_stl(folder, STL, read(folder, "a"), turn=-1),
            *("facets", "stored normal"),
        ),
        ("in inches", both(lambda c: c / INCH), "mirrors found", "x the record's size"),
        ("shrunk by 0.05 %", mesh(lambda c, _: c * np.float32(1.0005)), "centre error"),
        (
            "shifted by 20 um",
            mesh(lambda c, _: c + np.array([0, 0, 0.02], np.float32)),
            *("centre error", "0.020"),
        ),
        ("one half turned by 0.1 mrad", mesh(rotated), "centre error"),
        ("one half its own mirror image", OWN_IMAGE, "mirrors found", "missing"),
        ("the halves exchanged", exchanged, "mirrors found", "missing"),
        ("a loose piece in the light", loose(15, 3), "light paths"),
        ("a loose piece in the wall", loose(-1.5, 0.2), "components", "one piece"),
        ("a post in the light", post, "light paths"),
        (
            "20 um off in the STL only",
            only_stl(lambda c, e: reshaped(c, e, moved(e[0]))),
            *("3MF", "elsewhere in the STL"),
        ),
        ("a facet more in the 3MF", only_3mf(doubled), "3MF", "facets, the STL has"),
    ),
    *refusing(
        "mesh",
        ("NaN in a facet", number(np.nan), STL, "not finite"),
        ("an ASCII STL", stl_bytes(lambda _: ASCII), STL, "ASCII"),
        ("an STL cut short", stl_bytes(lambda b: b[:-70]), STL, "truncated"),
        ("an STL of 4 G facets", stl_bytes(lies(2**32 - 1)), "4294967295 facets"),
        ("an STL of no facets", stl_bytes(lambda b: b[:80] + bytes(4)), "0 facets"),
        ("an empty STL", stl_bytes(lambda _: b""), STL, "0 bytes"),
    ),
)
