"""The photographs of all stops, merged into the pictures that the shell would have given.

A pixel of the shell's picture belongs to a mirror. Its direction is rotated as the mirror's window
is rotated along with its ball (tbcad.optics.windows); what the photograph of the mirror's stop
shows there is its colour. Its ray comes from the record: ball and base are where the plan has them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tbcad.geometry.vectors import unit
from tbcad.simulate.capture.photograph import (
    CENTRE,
    RowBand,
    Samples,
    Tracer,
    row_bands,
    sample_shifts,
    to_bytes,
)
from tbcad.simulate.parallel import in_batches, in_threads
from tbcad.simulate.prototype.ball_rays import (
    BallHits,
    image_points,
    pixel_rays,
    reflected_colours,
    resampled_photograph,
    trace_balls,
)
from tbcad.simulate.prototype.run import PrototypeRun
from tbcad.simulate.scene.ray_casting import Scene, object_in_front
from tbcad.simulate.scene.rays import ReflectedRays, Shift, exact_tracer, pixel_directions
from tbcad.simulate.scene.reflector import MARGIN_PX
from tbcad.types import Bools, Bytes, Colours, Floats, Ints, Progress

Resample = Literal["photograph", "exact"]

NO_BALL = -1
"""In place of a ball's number: what is on no mirror is shown by no ball."""


@dataclass(frozen=True)
class MergePlan:
    """A run ready to be merged; each array has what is on no mirror first, then the mirrors.

    What is on no mirror is taken from the first photograph as it is.

    Attributes:
        run: the run.
        scene: the object.
        samples: a pixel is the mean of these rays.
        trace_shell: traces rows of the shell's picture.
        boxes: columns x0, x1 and rows y0, y1, ends excluded, of the shell's picture that hold the
            object seen directly, or a mirror's cell, (1 + m, 4).
        rotation: of directions, (1 + m, 3, 3).
        stop: whose photograph is used, (1 + m,).
        ball: in place of the mirror, from 1, (1 + m,).
    """

    run: PrototypeRun
    scene: Scene
    samples: Samples
    trace_shell: Tracer
    boxes: Ints
    rotation: Floats
    stop: Ints
    ball: Ints


def merge_run(
    run: PrototypeRun,
    scene: Scene,
    resample: Resample = "photograph",
    samples: Samples = 1,
    progress: Progress = lambda _: None,
) -> Iterator[RowBand]:
    """Bands of the merged picture from top to bottom, as those of tbcad.simulate.capture.

    Args:
        run: for camera a's mirrors or camera b's.
        scene: the object.
        resample: "photograph": between the four nearest pixels of the stop's photograph, as with
            a real prototype; "exact": traced along the rotated direction itself.
        samples: a pixel, of the photograph or of the picture, is the mean of these rays.
        progress: called with each step.

    Where a rotated direction leaves the photograph, or meets something else than its ball, there
    is no ray and no colour. What is on no mirror shows the object itself, or nothing.
    """
    plan, height = _merge_plan(run, scene, samples), run.reflector.camera.height_px
    picture = _resampled(plan, progress) if resample == "photograph" else None
    yield from in_batches(
        partial(_band, plan, picture),
        row_bands(height),
        lambda rows: progress(f"row {rows.start} of {height}"),
    )


def _merge_plan(run: PrototypeRun, scene: Scene, samples: Samples) -> MergePlan:
    return MergePlan(
        run,
        scene,
        samples,
        exact_tracer(run.reflector),
        np.vstack([_object_box(run, scene), run.reflector.boxes()]),
        np.concatenate([np.eye(3)[None], run.window_rotation]),
        np.append(0, run.stop),
        np.append(NO_BALL, run.ball + 1),
    )


def _object_box(run: PrototypeRun, scene: Scene) -> Ints:
    """Columns and rows that hold the object as the camera sees it directly, (4,)."""
    camera = run.reflector.camera
    corners = scene.radius * np.array(list(product((-1.0, 1.0), repeat=3)))
    size = np.array([camera.width_px, camera.height_px])
    if ((corners - camera.pinhole) @ camera.forward <= 0).any():
        return np.array([0, size[0], 0, size[1]])
    pixels = camera.project(corners)
    low, high = np.floor(pixels.min(axis=0)), np.ceil(pixels.max(axis=0)) + 1
    ends = np.clip([low - MARGIN_PX, high + MARGIN_PX], 0, size)
    return np.asarray(ends.T.ravel(), dtype=np.int64)


def _resampled(plan: MergePlan, progress: Progress) -> Bytes:
    """The merged picture (h, w, 3), stop after stop."""
    bands = row_bands(plan.run.reflector.camera.height_px)
    mirror = np.concatenate(
        in_threads(lambda rows: plan.trace_shell(rows, CENTRE).mirror.astype(np.uint16), bands)
    )
    picture = np.zeros((*mirror.shape, 3), dtype=np.uint8)
    stops = range(len(plan.run))
    for _ in in_batches(
        partial(_fill, plan, mirror, picture),
        stops,
        lambda stop: progress(f"stop {stop + 1} of {len(stops)}"),
    ):
        pass
    return picture


def _fill(plan: MergePlan, mirror: NDArray[np.uint16], picture: Bytes, stop: int) -> None:
    """Paint the pixels of a stop's mirrors; other stops paint other pixels."""
    run, mirrors = plan.run, np.flatnonzero(plan.stop == stop)
    parts = [_pixels_of(mirror, plan.boxes[number], number) for number in mirrors.tolist()]
    pixels = np.concatenate(parts)
    rotation = plan.rotation[np.repeat(mirrors, [len(part) for part in parts])]
    straight = pixel_rays(run.reflector.camera, pixels.astype(np.float64))
    places = image_points(run.camera, np.einsum("nx,nxy->ny", straight, rotation))
    inside = np.isfinite(places[:, 0])
    column, row = pixels[inside].T
    picture[row, column] = resampled_photograph(run, plan.scene, stop, plan.samples, places[inside])


def _pixels_of(mirror: NDArray[np.uint16], box: Ints, number: int) -> Ints:
    """Columns and rows (n, 2) in a box that belong to a mirror."""
    x0, x1, y0, y1 = box.tolist()
    row, column = np.nonzero(mirror[y0:y1, x0:x1] == number)
    return np.column_stack([column + x0, row + y0])


def _band(plan: MergePlan, picture: Bytes | None, rows: range) -> RowBand:
    mirror, hits, front, _ = _merged_pixels(plan, rows, CENTRE)
    shape = (len(rows), plan.run.reflector.camera.width_px)
    if picture is None:
        colour = _traced(plan, rows)
    else:
        shown = (hits.ball > 0) | front
        colour = picture[rows.start : rows.stop].reshape(-1, 3) * shown[:, None]
    rays = ReflectedRays(
        mirror.astype(np.int32).reshape(shape),
        hits.origin.reshape(*shape, 3),
        hits.direction.reshape(*shape, 3),
    )
    removed = (hits.ball == 0) | front
    return RowBand(rows, rays.without(removed.reshape(shape)), colour.reshape(*shape, 3))


def _traced(plan: MergePlan, rows: range) -> Bytes:
    """Colours (n, 3) along the rotated directions themselves."""
    total = np.zeros((len(rows) * plan.run.reflector.camera.width_px, 3), dtype=np.float32)
    shifts = sample_shifts(plan.samples)
    for shift in shifts:
        _, hits, front, direct = _merged_pixels(plan, rows, shift)
        total += np.where(front[:, None], direct, reflected_colours(plan.scene, hits))
    return to_bytes(total / np.float32(len(shifts)))


def _merged_pixels(
    plan: MergePlan, rows: range, shift: Shift
) -> tuple[Ints, BallHits, Bools, Colours]:
    """The n pixels of a band, each rotated with its mirror's window.

    Returns:
        The mirror that each belongs to, from 1, 0 for none, (n,); what it meets, where only the
        ball in place of its mirror is a ball; whether the object itself is in front of that, (n,);
        and its colours there, (n, 3).
    """
    run, camera = plan.run, plan.run.camera
    mirror = plan.trace_shell(rows, shift).mirror.ravel().astype(np.int64)
    straight = unit(pixel_directions(run.reflector.camera, rows, shift).reshape(-1, 3))
    direction = np.einsum("nx,nxy->ny", straight, plan.rotation[mirror])
    hits = trace_balls(run, direction, plan.stop[mirror])
    inside = np.isfinite(image_points(camera, direction)[:, 0])
    ball = np.where(inside & (hits.ball == plan.ball[mirror]), hits.ball, 0)
    front, direct = object_in_front(plan.scene, camera.pinhole, direction, hits.distance)
    return mirror, replace(hits, ball=ball), front & inside, direct
