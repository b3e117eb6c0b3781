"""The photographs of all stops, merged into the pictures that the shell would have given.

A pixel of the shell's picture belongs to a mirror. Its direction is turned as the mirror's window
goes along with its ball (tbcad.design.balls); what the photograph of the mirror's stop shows there
is its colour. Its ray comes from the record: ball and base stand where the plan has them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tbcad.geometry.vectors import unit
from tbcad.simulate.capture.light_field import LightField, light_field_in_memory
from tbcad.simulate.capture.photograph import (
    CENTRE,
    Band,
    Shift,
    Tracer,
    row_bands,
    subpixel_shifts,
)
from tbcad.simulate.parallel import THREADS, in_threads
from tbcad.simulate.prototype.ball_rays import (
    BallHits,
    image_points,
    object_in_front,
    pixel_rays,
    reflected_colours,
    trace_balls,
)
from tbcad.simulate.prototype.run import PrototypeRun, ball_reflector
from tbcad.simulate.prototype.stop_photograph import resampled_photograph
from tbcad.simulate.scene.ray_casting import Scene
from tbcad.simulate.scene.rays import ReflectedRays, exact_tracer, pixel_directions
from tbcad.simulate.scene.reflector import MARGIN_PX, project_points
from tbcad.types import Bools, Bytes, Floats, Ints, Progress

Colours = NDArray[np.float32]
Numbers = NDArray[np.uint16]
Resample = Literal["photograph", "exact"]

NOWHERE = -1


@dataclass(frozen=True)
class MergePlan:
    """A run ready to be merged; each array has what is on no mirror first, then the mirrors.

    What is on no mirror is taken from the first photograph as it is, and shows no ball.

    Attributes:
        run: the run.
        shell: gives the rays of rows of the shell's picture.
        boxes: columns x0, x1 and rows y0, y1, ends excluded, of the shell's picture that hold the
            object seen directly, or a mirror's cell, (1 + m, 4).
        turn: of directions, (1 + m, 3, 3).
        stop: whose photograph is used, (1 + m,).
        ball: that stands in, from 1, (1 + m,).
    """

    run: PrototypeRun
    shell: Tracer
    boxes: Ints
    turn: Floats
    stop: Ints
    ball: Ints


@dataclass(frozen=True)
class MergedPixels:
    """n pixels of the merged picture.

    Attributes:
        mirror: that each belongs to, from 1; 0 for none, (n,).
        seen: what it meets; only the ball that stands in for its mirror is a ball here.
        front: whether the object itself stands before that, (n,).
        direct: its colours there, (n, 3).
    """

    mirror: Ints
    seen: BallHits
    front: Bools
    direct: Colours


def merged_light_field(
    both: tuple[PrototypeRun, PrototypeRun],
    scene: Scene,
    capture_mm: float,
    resample: Resample = "photograph",
    samples: int = 1,
    progress: Progress = lambda _: None,
) -> LightField:
    """Both runs merged, in memory; capture_mm is the diameter of the capture sphere.

    The other arguments are those of `merge`.
    """
    captured = {
        run.at.camera_id: (ball_reflector(run), merge_run(run, scene, resample, samples, progress))
        for run in both
    }
    return light_field_in_memory(captured, capture_mm)


def merge_run(
    run: PrototypeRun,
    scene: Scene,
    resample: Resample = "photograph",
    samples: int = 1,
    progress: Progress = lambda _: None,
) -> Iterator[Band]:
    """Bands of the merged picture from top to bottom, as those of tbcad.simulate.capture.

    Args:
        run: for camera a's mirrors or camera b's.
        scene: the object.
        resample: "photograph": between the four nearest pixels of the stop's photograph, as a
            machine must; "exact": traced along the turned direction itself.
        samples: a pixel, of the photograph or of the picture, is the mean of samples x samples.
        progress: told how far it has come.

    Where a turned direction leaves the photograph, or meets something else than its ball, there
    is no ray and no colour. What is on no mirror shows the object itself, or nothing.
    """
    ready = _ready(run, scene)
    photographs = resample == "photograph"
    picture = _resampled(ready, scene, samples, progress) if photographs else None
    work = partial(_band, ready, scene, samples, picture)
    every = row_bands(run.at.camera.height_px)
    for first in range(0, len(every), 2 * THREADS):
        progress(f"row {every[first].start} of {run.at.camera.height_px}")
        yield from in_threads(work, every[first : first + 2 * THREADS])


def _ready(run: PrototypeRun, scene: Scene) -> MergePlan:
    return MergePlan(
        run,
        exact_tracer(run.at),
        np.vstack([_object_box(run, scene), run.at.boxes()]),
        np.concatenate([np.eye(3)[None], run.turn]),
        np.append(0, run.stop),
        np.append(NOWHERE, run.ball + 1),
    )


def _object_box(run: PrototypeRun, scene: Scene) -> Ints:
    """Columns and rows that hold the object as the camera sees it directly, (4,)."""
    view = run.at.camera
    corners = scene.radius * np.array(list(product((-1.0, 1.0), repeat=3)))
    size = np.array([view.width_px, view.height_px])
    if ((corners - view.pinhole) @ view.forward <= 0).any():
        return np.array([0, size[0], 0, size[1]])
    place = project_points(view, corners)
    low, high = np.floor(place.min(axis=0)), np.ceil(place.max(axis=0)) + 1
    ends = np.clip([low - MARGIN_PX, high + MARGIN_PX], 0, size)
    return np.asarray(ends.T.ravel(), dtype=np.int64)


def _resampled(ready: MergePlan, scene: Scene, samples: int, progress: Progress) -> Bytes:
    """The merged picture (h, w, 3), stop after stop."""
    mirror = np.concatenate(
        in_threads(partial(_mirrors, ready), row_bands(ready.run.at.camera.height_px))
    )
    picture = np.zeros((*mirror.shape, 3), dtype=np.uint8)
    work = partial(_fill, ready, scene, samples, mirror, picture)
    for first in range(0, len(ready.run), 4 * THREADS):
        progress(f"stop {first + 1} of {len(ready.run)}")
        in_threads(work, range(first, min(first + 4 * THREADS, len(ready.run))))
    return picture


def _mirrors(ready: MergePlan, rows: range) -> Numbers:
    return ready.shell(rows, CENTRE).mirror.astype(np.uint16)


def _fill(
    ready: MergePlan, scene: Scene, samples: int, mirror: Numbers, picture: Bytes, stop: int
) -> None:
    """Paint the pixels of a stop's mirrors; those of other stops are others."""
    at, view = ready.run.at.camera, ready.run.view
    served = np.flatnonzero(ready.stop == stop)
    parts = [_inside(mirror, ready.boxes[number], number) for number in served.tolist()]
    pixel = np.concatenate(parts)
    turn = ready.turn[np.repeat(served, [len(part) for part in parts])]
    way = np.einsum("nx,nxy->ny", pixel_rays(at, pixel.astype(np.float64)), turn)
    place = image_points(view, way)
    good = np.isfinite(place[:, 0])
    column, row = pixel[good].T
    picture[row, column] = resampled_photograph(ready.run, scene, stop, samples, place[good])


def _inside(mirror: Numbers, box: Ints, number: int) -> Ints:
    """Columns and rows (n, 2) in a box that belong to a mirror."""
    x0, x1, y0, y1 = box.tolist()
    row, column = np.nonzero(mirror[y0:y1, x0:x1] == number)
    return np.column_stack([column + x0, row + y0])


def _band(ready: MergePlan, scene: Scene, samples: int, picture: Bytes | None, rows: range) -> Band:
    part = _part(ready, scene, rows, CENTRE)
    shape = (len(rows), ready.run.at.camera.width_px)
    if picture is None:
        colour = _traced(ready, scene, samples, rows)
    else:
        shown = (part.seen.ball > 0) | part.front
        colour = picture[rows.start : rows.stop].reshape(-1, 3) * shown[:, None]
    rays = ReflectedRays(
        part.mirror.astype(np.int32).reshape(shape),
        part.seen.origin.reshape(*shape, 3),
        part.seen.direction.reshape(*shape, 3),
    )
    gone = (part.seen.ball == 0) | part.front
    return Band(rows, rays.without(gone.reshape(shape)), colour.reshape(*shape, 3))


def _traced(ready: MergePlan, scene: Scene, samples: int, rows: range) -> Bytes:
    """Colours (n, 3) along the turned directions themselves."""
    total = np.zeros((len(rows) * ready.run.at.camera.width_px, 3), dtype=np.float32)
    for shift in subpixel_shifts(samples):
        part = _part(ready, scene, rows, shift)
        total += np.where(part.front[:, None], part.direct, reflected_colours(scene, part.seen))
    return np.asarray(np.rint(total / np.float32(samples**2)), dtype=np.uint8)


def _part(ready: MergePlan, scene: Scene, rows: range, shift: Shift) -> MergedPixels:
    """The pixels of a band, each turned with its mirror's window."""
    run = ready.run
    mirror = ready.shell(rows, shift).mirror.ravel().astype(np.int64)
    straight = unit(pixel_directions(run.at.camera, rows, shift).reshape(-1, 3))
    way = np.einsum("nx,nxy->ny", straight, ready.turn[mirror])
    seen = trace_balls(run, way, ready.stop[mirror])
    taken = np.isfinite(image_points(run.view, way)[:, 0])
    own = taken & (seen.ball == ready.ball[mirror])
    front, direct = object_in_front(scene, run.view, way, seen.reach)
    seen = replace(seen, ball=np.where(own, seen.ball, 0))
    return MergedPixels(mirror, seen, front & taken, direct)
