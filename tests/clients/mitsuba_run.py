"""The light of a run of the prototype, rendered by Mitsuba; by hand, for it takes minutes.

    python -m tests.clients.mitsuba_run BUILD LIGHT.npz --seed 1 --stops 1,4,8

Mitsuba finds what rays meet: spheres and bodies of caps as exact shapes, LEDs' domes, object and
stage as meshes. Rays come from a pupil of finite width through a lens that distorts, are reflected
up to three times, and are summed over pixels with lens blur and veil. No code is shared with
tbcad.

It needs LLVM 16 or newer (DRJIT_LIBLLVM_PATH).
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import mitsuba as mi
import numpy as np
import trimesh
from scipy.ndimage import gaussian_filter

from tests.clients.rendered_photographs import steps
from tests.clients.rendered_rig import (
    DOME_MM,
    Rig,
    built,
    directions,
    form_slopes,
    projected,
    unit,
)

mi.set_variant("llvm_ad_rgb")
import drjit as dr  # noqa: E402 - its backend follows from the variant

PUPIL_MM = 0.5  # radius of the pupil
FINE, COARSE, WINDOW = 8, 2, 6  # rays across a pixel at highlights and elsewhere; half width, px
LENS_PX, VEIL_PX, VEIL = 0.65, 4.0, 0.01  # blur of the lens, and of the share that is scattered
LED_LIGHT, REFLECTANCE, BOUNCES = 1.3, 0.9, 3  # of a full pixel; of a mirror
OFF_MM = 1e-3
VIEW, VIEW_SIZE, MARGIN = (20.0, 45.0), (320, 240), 1.05  # degrees; pixels; room round the object
NOTHING, BALL, BODY, DOME, MATT = range(5)


@dataclass(frozen=True)
class Still:
    """Object and stage in one run, with shadows; the lamps are alike in both."""

    shapes: dict[str, Any]
    scene: Any
    turned: float  # -1 where the object is turned by half a turn, else 1
    lamps: np.ndarray = field(
        default_factory=lambda: np.array(
            [[118.0, y, z] for y in (52, -52) for z in (-90.0, 160.0)]
            + [[-118.0, y, z] for y in (52, -52) for z in (-90.0, 160.0)]
        )
    )


def subject(radius: float = 17.0) -> trimesh.Trimesh:
    """A ball with bumps of no symmetry."""
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=1.0)
    x, y, z = mesh.vertices.T
    bump = 1 + 0.15 * np.sin(3 * x + 1) * np.cos(4 * y) + 0.12 * np.sin(5 * z + 2 * x)
    mesh.vertices *= (radius / 1.27 * bump)[:, None]
    return mesh


def albedo(points: np.ndarray) -> np.ndarray:
    """Diffuse texture of the object at points (n, 3), mm, (n, 3)."""
    x, y, z = points.T / 4.0
    waves = np.stack([np.sin(x + 0.5 * y), np.sin(y - 0.7 * z + 1), np.sin(z + 0.6 * x + 2)])
    return (0.5 + 0.35 * waves.T) * np.where(np.sin(3 * z) > 0.6, 0.4, 1.0)[:, None]


def mesh_shape(mesh: trimesh.Trimesh, folder: Path, name: str) -> dict[str, Any]:
    path = folder / f"{name}.ply"
    mesh.export(path)
    return {"type": "ply", "filename": str(path)}


def still_life(build: Path, folder: Path, turned: bool) -> Still:
    """The scene without balls, in one of the runs; meshes are kept in a folder."""
    record = json.loads((build / "prototype.json").read_text())
    flip = -1.0 if turned else 1.0
    mesh = subject()
    mesh.vertices *= [flip, flip, 1]
    shapes = {"object": mesh_shape(mesh, folder, f"object_{turned}")}
    for part in record["parts"]:
        if part["role"] == "stage":
            solid = trimesh.load(build / part["stl"])
            solid = trimesh.Trimesh(solid.vertices, solid.faces)
            solid.vertices = (solid.vertices - part["origin_mm"]) @ np.array(part["axes"]).T
            shapes[f"stage_{part['name']}"] = mesh_shape(solid, folder, part["name"])
    named = {name: shape | {"id": name} for name, shape in shapes.items()}
    return Still(shapes, mi.load_dict({"type": "scene", **named}), flip)


@dataclass(frozen=True)
class Stage:
    """The scene of one frame, and the balls in it."""

    rig: Rig
    still: Still
    centre: np.ndarray  # (k, 3)
    body: np.ndarray
    across: np.ndarray  # (k, 2, 3)
    scene: Any
    kinds: np.ndarray  # of shapes by Mitsuba's number
    owner: np.ndarray  # ball or LED of each


def staged(rig: Rig, still: Still, frame: int) -> Stage:
    """A frame's scene."""
    centre, body = rig.placed(frame, rig.centre), rig.placed(frame, rig.body)
    shapes: dict[str, tuple[int, int, dict[str, Any]]] = {}

    def ball(name: str, kind: int, number: int, at: np.ndarray, radius: float) -> None:
        shape = {"type": "sphere", "center": at.tolist(), "radius": float(radius)}
        shapes[f"{name}_{number}"] = kind, number, shape

    for k in range(len(centre)):
        ball("ball", BALL, k, centre[k], rig.radius[k])
        if rig.half[k] > 0:
            ball("body", BODY, k, body[k], rig.body_radius[k])
    for led, place in enumerate(rig.leds):
        ball("led", DOME, led, place, DOME_MM)
    for name, shape in still.shapes.items():
        shapes[name] = MATT, int(name == "object"), shape
    told = {name: shape | {"id": name} for name, (_, _, shape) in shapes.items()}
    scene = mi.load_dict({"type": "scene", **told})
    number = np.array(dr.reinterpret_array(mi.UInt32, scene.shapes_dr()))
    kinds, owner = np.zeros((2, number.max() + 1), dtype=np.int64)
    for shape, at in zip(scene.shapes(), number, strict=True):
        kinds[at], owner[at] = shapes[shape.id()][:2]
    axes = rig.attitude(frame)
    across = np.stack([axes.apply(rig.across[:, i]) for i in (0, 1)], axis=1)
    return Stage(rig, still, centre, body, across, scene, kinds, owner)


def met(scene: Any, start: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, ...]:
    """Numbers of shapes, points and normals that rays (n, 3) meet first; shape 0 for none."""
    ray = mi.Ray3f(mi.Point3f(*start.T), mi.Vector3f(*way.T))
    found = scene.ray_intersect(ray, mi.RayFlags.Minimal, True)
    shape = np.array(dr.reinterpret_array(mi.UInt32, found.shape))
    return shape, start + np.array(found.t, float)[:, None] * way, np.array(found.n, float).T


@dataclass
class Light:
    """What n rays end at."""

    kind: np.ndarray
    owner: np.ndarray
    first: np.ndarray  # ball that they meet first, -1 for none
    bounces: np.ndarray
    point: np.ndarray
    normal: np.ndarray


def traced(stage: Stage, start: np.ndarray, way: np.ndarray) -> Light:
    """Rays (n, 3) followed over mirrors. A cap is what is inside of both its spheres."""
    n, rig = len(start), stage.rig
    start, way = start.copy(), way.copy()
    end = Light(*np.zeros((2, n), int), np.full(n, -1), np.zeros(n, int), *np.zeros((2, n, 3)))
    going = np.arange(n)
    for _ in range(40):
        if not len(going):
            break
        shape, point, normal = met(stage.scene, start[going], way[going])
        kind, owner = stage.kinds[shape], stage.owner[shape]
        heading = way[going]
        k = np.where((kind == BALL) | (kind == BODY), owner, 0)
        cap = rig.half[k] > 0
        own = point - stage.centre[k]
        front = (np.linalg.norm(point - stage.body[k], axis=1) < rig.body_radius[k]) | ~cap
        behind = np.linalg.norm(own, axis=1) < rig.radius[k]
        mirror = (kind == BALL) & front & ((own * heading).sum(axis=1) < 0)
        through = (kind == BALL) & ~mirror | (kind == BODY) & ~behind
        below = (kind == DOME) & (point[:, 2] < rig.leds[np.where(kind == DOME, owner, 0), 2])
        ends = ~mirror & ~through
        at = going[ends]
        end.kind[at] = np.where(below, MATT, kind)[ends]
        end.owner[at] = np.where(below, 0, owner)[ends]
        end.point[at], end.normal[at] = point[ends], normal[ends]
        at, ball = going[mirror], k[mirror]
        outward = unit(own[mirror])
        slopes = form_slopes(rig, ball, own[mirror], stage.across[ball])
        lit = unit(outward - slopes)
        turned = heading[mirror]
        way[at] = unit(turned - 2 * (turned * lit).sum(axis=1, keepdims=True) * lit)
        start[at] = stage.centre[ball] + (rig.radius[ball] + OFF_MM)[:, None] * outward
        end.first[at] = np.where(end.first[at] < 0, ball, end.first[at])
        end.bounces[at] += 1
        at = going[through]
        start[at] = point[through] + OFF_MM * heading[through]
        spent = np.zeros(n, bool)
        spent[going[ends]] = True
        going = going[~spent[going] & (end.bounces[going] <= BOUNCES)]
    return end


def pupil_rays(
    rig: Rig, pixels: np.ndarray, focus: float, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Rays (n, 3) through pixels from places of the pupil, all sharp at a depth, mm."""
    way = directions(rig, pixels)
    radius, turn = PUPIL_MM * np.sqrt(random.random(len(way))), 2 * np.pi * random.random(len(way))
    beside = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1) @ rig.axes[:2]
    aim = way * (focus / (way @ rig.axes[2]))[:, None]
    return rig.pinhole + beside, unit(aim - beside)


def shadowed(still: Still, point: np.ndarray, normal: np.ndarray, lamp: np.ndarray) -> np.ndarray:
    """Cosine over squared distance of a lamp at points (n, 3), 1/mm^2; 0 in shadow."""
    toward = lamp - point
    far = np.linalg.norm(toward, axis=1)
    cosine = (normal * toward).sum(axis=1) / far
    start = point + 0.01 * normal
    ray = mi.Ray3f(mi.Point3f(*start.T), mi.Vector3f(*(toward / far[:, None]).T))
    ray.maxt = mi.Float(far - DOME_MM - 0.1)
    return np.where(np.array(still.scene.ray_test(ray)), 0.0, np.maximum(cosine, 0) / far**2)


def lit_object(still: Still, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Light (n, 3) of the object in the light of the lamps, 1 for white where it is lit well."""
    sun = sum(shadowed(still, point, normal, lamp) for lamp in still.lamps)
    colour = albedo(point * [still.turned, still.turned, 1])
    return colour * (0.25 + 0.3 * 170.0**2 * np.asarray(sun))[:, None]


@dataclass(frozen=True)
class Pictures:
    """Light of one frame before the sensor, 1 fills a pixel: (l, h, w) and (h, w, 3)."""

    leds: np.ndarray
    lit: np.ndarray


def grid(first: np.ndarray, size: tuple[int, int], fine: int) -> np.ndarray:
    """Middles of so many rays across each pixel of a box of columns and rows, (h, w, 2)."""
    y, x = np.mgrid[: fine * size[1], : fine * size[0]]
    return first - 0.5 + (np.stack([x, y], axis=-1) + 0.5) / fine


def blurred(light: np.ndarray, fine: int) -> np.ndarray:
    """Fine light (H, W, ...) behind the lens, on pixels (h, w, ...)."""
    rest = (0,) * (light.ndim - 2)
    sharp = gaussian_filter(light, (fine * LENS_PX,) * 2 + rest, mode="constant", truncate=6)
    h, w = light.shape[0] // fine, light.shape[1] // fine
    return sharp.reshape(h, fine, w, fine, *light.shape[2:]).mean(axis=(1, 3))


def pictures(stage: Stage, focus: float, random: np.random.Generator, lit: bool) -> Pictures:
    """What the camera sees in a frame, LED by LED and of the lit object."""
    rig, (w, h) = stage.rig, stage.rig.size
    leds, side = _elsewhere(stage, focus, random, lit), 2 * WINDOW + 1
    led, ball, place = (np.array(one) for one in zip(*highlights(stage), strict=True))
    corner = np.rint(place).astype(int) - WINDOW
    near = corner[:, None] + grid(np.zeros(2), (side, side), FINE).reshape(-1, 2)
    shaken = near + (random.random(near.shape) - 0.5) / FINE
    end = traced(stage, *pupil_rays(rig, shaken.reshape(-1, 2), focus, random))
    led_of, ball_of = (np.repeat(one, near.shape[1]) for one in (led, ball))
    own = (end.kind == DOME) & (end.owner == led_of) & (end.first == ball_of) & (end.bounces == 1)
    for number, first, shown in zip(led, corner, own.reshape(len(near), -1), strict=True):
        light = LED_LIGHT * REFLECTANCE * shown.reshape(side * FINE, side * FINE)
        low, high = np.maximum(first, 0), np.minimum(first + side, [w, h])
        if (low >= high).any():
            continue
        here = np.s_[low[1] - first[1] : high[1] - first[1], low[0] - first[0] : high[0] - first[0]]
        leds.leds[number, low[1] : high[1], low[0] : high[0]] += blurred(light, FINE)[here]
    cosine = directions(rig, grid(np.zeros(2), (w, h), 1).reshape(-1, 2)) @ rig.axes[2]
    falls = (cosine**4).reshape(h, w)
    veiled = [(1 - VEIL) * one + VEIL * gaussian_filter(one, VEIL_PX) for one in leds.leds]
    return Pictures(np.array(veiled) * falls, leds.lit * falls[..., None])


def _elsewhere(stage: Stage, focus: float, random: np.random.Generator, lit: bool) -> Pictures:
    """All but LEDs that are reflected once."""
    rig, (w, h), still = stage.rig, stage.rig.size, stage.still
    coarse = COARSE if lit else 1
    pixels = grid(np.zeros(2), (w, h), coarse)
    flat = pixels.reshape(-1, 2)
    seen = np.zeros(len(flat), bool)
    rough = directions(rig, grid(np.zeros(2), (w, h), 1).reshape(-1, 2)).reshape(h, w, 3)
    for body, radius in zip(stage.body, rig.body_radius, strict=True):
        toward = body - rig.pinhole
        near = rough @ unit(toward) > np.cos(np.arcsin(radius / np.linalg.norm(toward)) + 0.01)
        seen |= near.repeat(coarse, 0).repeat(coarse, 1).ravel()
    at = np.flatnonzero(seen)
    spread = flat[at] + (random.random((len(at), 2)) - 0.5) / coarse
    end = traced(stage, *pupil_rays(rig, spread, focus, random))
    loss = REFLECTANCE**end.bounces
    shows = np.flatnonzero((end.kind == MATT) & (end.owner == 1))
    point, normal = end.point[shows], end.normal[shows]
    colour = albedo(point * [still.turned, still.turned, 1]).mean(axis=1)
    leds = np.zeros((len(rig.leds), h, w))
    for led, place in enumerate(rig.leds):
        fine = np.zeros(len(flat))
        other = (end.kind == DOME) & (end.owner == led) & (end.bounces > 1)
        fine[at[other]] = LED_LIGHT * loss[other]
        # An LED of a radiance L and a radius a lights a matt surface by L a^2 albedo cos / d^2.
        shone = DOME_MM**2 * shadowed(still, point, normal, place)
        fine[at[shows]] += LED_LIGHT * loss[shows] * colour * shone
        leds[led] = blurred(fine.reshape(pixels.shape[:2]), coarse)
    whole = np.zeros((len(flat), 3))
    if lit:
        whole[at[shows]] = loss[shows, None] * lit_object(still, point, normal)
    return Pictures(leds, blurred(whole.reshape(*pixels.shape[:2], 3), coarse))


def highlights(stage: Stage) -> Iterator[tuple[int, int, np.ndarray]]:
    """LED, ball and about where it is seen, by repeated halving of the angle at the mirror."""
    rig = stage.rig
    for led, place in enumerate(rig.leds):
        normal = unit(place - stage.centre)
        for _ in range(300):
            point = stage.centre + rig.radius[:, None] * normal
            toward = unit(unit(place - point) + unit(rig.pinhole - point))
            step = np.where(rig.radius > 500, 0.02, 0.2)[:, None]
            normal = unit(normal + step * (toward - normal))
        for ball, pixel in enumerate(projected(rig, stage.centre + rig.radius[:, None] * normal)):
            if ((pixel > -WINDOW) & (pixel < np.array(rig.size) + WINDOW)).all():
                yield led, ball, pixel


def view(still: Still, azimuth: float, elevation: float, size: tuple[int, int]) -> np.ndarray:
    """The object from a distance of 640 mm at angles in degrees, without balls, (h, w, 3).

    The capture sphere of 60 mm fills the shorter side but for 5 %, as in pictures of tbcad view.
    """
    turn, rise = np.radians([azimuth, elevation])
    level = np.array([np.cos(turn), np.sin(turn), 0.0])
    back = np.cos(rise) * level + [0, 0, np.sin(rise)]
    right = np.array([-np.sin(turn), np.cos(turn), 0.0])
    axes = np.stack([right, np.cross(-back, right)])
    pixels = grid(np.zeros(2), size, 4)
    half = MARGIN * np.tan(np.arcsin(30 / 640)) / min(size)
    place = (2 * pixels.reshape(-1, 2) - (np.array(size) - 1)) * half
    way = unit(place @ axes - back)
    shape, point, normal = met(still.scene, np.broadcast_to(640 * back, way.shape), way)
    number = np.array(dr.reinterpret_array(mi.UInt32, still.scene.shapes_dr()))
    of_object = number[[one.id() for one in still.scene.shapes()].index("object")]
    shows = np.flatnonzero(shape == of_object)
    light = np.zeros((len(way), 3))
    light[shows] = lit_object(still, point[shows], normal[shows])
    return light.reshape(size[1], 4, size[0], 4, 3).mean(axis=(1, 3))


def render(build: Path, out: Path, seed: int, stops: list[int], lit: bool = True) -> None:
    """Write the light of all photographs of some stops of a build, in both runs."""
    frames = [(turn, stop) for turn in (0, 180) for stop in stops]
    rig, random = built(build, frames, seed), np.random.default_rng([41, seed])
    focus = json.loads((build / "camera.json").read_text())["requirements"]["focus_mm"]
    with TemporaryDirectory() as folder:
        still = {turn: still_life(build, Path(folder), turn > 0) for turn in (0, 180)}
        seen = [
            pictures(staged(rig, still[turn], number), focus, random, lit)
            for number, (turn, _) in enumerate(frames)
        ]
        shown = view(still[0], *VIEW, VIEW_SIZE)
    leds = steps(np.array([one.leds for one in seen]))
    more = {"lit": steps(np.array([one.lit for one in seen]))} if lit else {}
    if lit:
        more["view"] = steps(shown)
    np.savez_compressed(out, seed=seed, frames=np.array(frames), leds=leds, **more)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stops", default="1")
    parser.add_argument("--no-lit", action="store_true")
    asked = parser.parse_args()
    stops = [int(one) for one in asked.stops.split(",")]
    render(asked.build, asked.out, asked.seed, stops, not asked.no_lit)
