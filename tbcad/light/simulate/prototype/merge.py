"""The photographs of all stops, merged into the pictures that the shell would have given.

A pixel of the shell's picture belongs to a mirror. Its direction is rotated as the mirror's window
is rotated along with its ball (tbcad.core.optics.windows); what the photograph of the mirror's stop
shows there is its colour. Its ray comes from where the run says that ball and camera are.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.camera import without_distortion
from tbcad.light.simulate.capture.photograph import CENTRE, RowBand, Samples, Tracer, row_bands
from tbcad.light.simulate.capture.real import RealOptics
from tbcad.light.simulate.parallel import in_batches, in_threads
from tbcad.light.simulate.prototype.ball_rays import (
    BallHits,
    image_points,
    resampled,
    resampled_photograph,
    trace_balls,
    trace_own_ball,
)
from tbcad.light.simulate.prototype.real_balls import real_pixels
from tbcad.light.simulate.prototype.run import PrototypeRun
from tbcad.light.simulate.scene.ray_casting import Scene, object_in_front
from tbcad.light.simulate.scene.rays import TracedRays, exact_tracer, pixel_directions
from tbcad.light.simulate.scene.reflector import MARGIN_PX
from tbcad.light.simulate.scene.upper_lamps import hidden_rays
from tbcad.types import Bools, Bytes, Floats, Ints, Progress

NO_BALL = -1  # in place of a ball's number: what is on no mirror is shown by no ball


class StopPhotographs(Protocol):
    """The photographs of a run's stops, real or simulated."""

    def colours(self, stop: int, places: Floats) -> Bytes | None:
        """Colours (n, 3) of a stop, from 0, at columns and rows (n, 2); None without one."""


InFront = Callable[[Ints, Floats, Floats], Bools]
"""Where (n,) the object itself is before what a camera ray meets.

Called with the mirror that each ray belongs to, from 1, 0 for none, (n,); its unit direction
(n, 3); and the distance of the ball that it meets, mm, (n,).
"""


@dataclass(frozen=True)
class MergePlan:
    """A run ready to be merged; each array has what is on no mirror first, then the mirrors."""

    run: PrototypeRun  # the run
    in_front: InFront  # where the object hides what is behind
    trace_shell: Tracer  # traces rows of the shell's picture
    # columns x0, x1 and rows y0, y1, ends excluded, of the shell's picture that hold the object
    # seen directly, or a mirror's cell, (1 + m, 4)
    boxes: Ints
    rotation: Floats  # of directions, (1 + m, 3, 3)
    stop: Ints  # whose photograph is used, (1 + m,)
    ball: Ints  # in place of the mirror, from 1, (1 + m,)
    screen: Any | None = None  # bodies, with their tolerance, that hide rays; None without any


def merge_plan(
    run: PrototypeRun,
    object_radius: float,
    in_front: InFront,
    direct_stop: int = 0,
    screen: Any | None = None,
) -> MergePlan:
    """Prepare a merge of a run.

    The object is in a sphere about the origin of `object_radius`, mm; the photograph of
    `direct_stop`, from 0, shows it itself. A screen, as of `upper_screen`, hides rays.
    """
    return MergePlan(
        run,
        in_front,
        exact_tracer(run.reflector),
        np.vstack([_object_box(run, object_radius), run.reflector.boxes()]),
        np.concatenate([np.eye(3)[None], run.window_rotation]),
        np.append(direct_stop, run.stop),
        np.append(NO_BALL, run.ball + 1),
        screen,
    )


def merge_photographs(
    plan: MergePlan, photographs: StopPhotographs, progress: Progress = lambda _: None
) -> Iterator[RowBand]:
    """Bands of the merged picture from top to bottom, as those of tbcad.light.simulate.capture.

    Where a rotated direction leaves the photograph, or meets something else than its ball, and
    where a stop has no photograph, there is no ray and no colour. What is on no mirror shows the
    object itself, or nothing.
    """
    picture, shown = _resampled(plan, photographs, progress)
    known = replace(plan, ball=np.where(shown[plan.stop], plan.ball, NO_BALL))
    yield from in_batches(
        partial(_band, known, picture),
        row_bands(len(picture)),
        lambda rows: progress(f"row {rows.start} of {len(picture)}"),
    )


def merged_pixels(plan: MergePlan, rows: range) -> tuple[Ints, BallHits, Bools]:
    """The n pixels of a band, each rotated with its mirror's window.

    Returns the mirror that each belongs to, from 1, 0 for none, (n,); what it meets, where only the
    ball in place of its mirror is a ball; and whether the object itself is in front of that, (n,).
    """
    run = plan.run
    mirror = plan.trace_shell(rows, CENTRE).mirror.ravel().astype(np.int64)
    straight = unit(pixel_directions(run.reflector.camera, rows).reshape(-1, 3))
    direction = np.einsum("nx,nxy->ny", straight, plan.rotation[mirror])
    hits = (
        trace_own_ball(run, direction, plan.stop[mirror], plan.ball[mirror])
        if run.parted
        else trace_balls(run, direction, plan.stop[mirror])
    )
    inside = np.isfinite(image_points(run.camera, direction)[:, 0])
    ball = np.where(inside & (hits.ball == plan.ball[mirror]), hits.ball, 0)
    on = np.flatnonzero(ball)
    hidden = hidden_rays(plan.screen, run.camera.pinhole, hits.origin[on], hits.direction[on])
    ball[on[hidden]] = 0
    front = inside & plan.in_front(mirror, direction, hits.distance)
    return mirror, replace(hits, ball=ball), front


def _object_box(run: PrototypeRun, radius: float) -> Ints:
    """Columns and rows that hold the object as the camera sees it directly, (4,)."""
    camera = run.reflector.camera
    corners = radius * np.array(list(product((-1.0, 1.0), repeat=3)))
    size = np.array([camera.width_px, camera.height_px])
    if ((corners - camera.pinhole) @ camera.forward <= 0).any():
        return np.array([0, size[0], 0, size[1]])
    pixels = camera.project(corners)
    low, high = np.floor(pixels.min(axis=0)), np.ceil(pixels.max(axis=0)) + 1
    ends = np.clip([low - MARGIN_PX, high + MARGIN_PX], 0, size)
    return np.asarray(ends.T.ravel(), dtype=np.int64)


def _resampled(
    plan: MergePlan, photographs: StopPhotographs, progress: Progress
) -> tuple[Bytes, Bools]:
    """The merged picture (h, w, 3), stop after stop, and which stops have a photograph, (s,)."""
    bands = row_bands(plan.run.reflector.camera.height_px)
    mirror = np.concatenate(
        in_threads(lambda rows: plan.trace_shell(rows, CENTRE).mirror.astype(np.uint16), bands)
    )
    picture = np.zeros((*mirror.shape, 3), dtype=np.uint8)
    stops = range(len(plan.run))
    shown = in_batches(
        partial(_fill, plan, photographs, mirror, picture),
        stops,
        lambda stop: progress(f"stop {stop + 1} of {len(stops)}"),
    )
    return picture, np.array(list(shown), dtype=bool)


def _fill(
    plan: MergePlan,
    photographs: StopPhotographs,
    mirror: NDArray[np.uint16],
    picture: Bytes,
    stop: int,
) -> bool:
    """Paint the pixels of a stop's mirrors; other stops paint other pixels."""
    run, mirrors = plan.run, np.flatnonzero(plan.stop == stop)
    if len(mirrors) == 0:
        return True
    parts = [_pixels_of(mirror, plan.boxes[number], number) for number in mirrors.tolist()]
    pixels = np.concatenate(parts)
    rotation = plan.rotation[np.repeat(mirrors, [len(part) for part in parts])]
    straight = without_distortion(run.reflector.camera).directions(pixels.astype(np.float64))
    places = image_points(run.camera, np.einsum("nx,nxy->ny", straight, rotation))
    inside = np.isfinite(places[:, 0])
    column, row = pixels[inside].T
    colours = photographs.colours(stop, places[inside])
    if colours is not None:
        picture[row, column] = colours
    return colours is not None


def _pixels_of(mirror: NDArray[np.uint16], box: Ints, number: int) -> Ints:
    """Columns and rows (n, 2) in a box that belong to a mirror."""
    x0, x1, y0, y1 = box.tolist()
    row, column = np.nonzero(mirror[y0:y1, x0:x1] == number)
    return np.column_stack([column + x0, row + y0])


def _band(plan: MergePlan, picture: Bytes, rows: range) -> RowBand:
    mirror, hits, front = merged_pixels(plan, rows)
    colour = picture[rows.start : rows.stop]
    shape = colour.shape[:2]
    rays = TracedRays(
        mirror.astype(np.int32).reshape(shape),
        hits.origin.reshape(colour.shape),
        hits.direction.reshape(colour.shape),
    )
    on, front = (hits.ball > 0).reshape(shape), front.reshape(shape)
    return RowBand(rows, rays.without(~on | front), colour * (on | front)[..., None])


@dataclass(frozen=True)
class SimulatedPhotographs:
    """What the photographs of a run's stops show of a scene."""

    run: PrototypeRun  # the run
    scene: Scene  # the object
    # a pixel is the mean of these rays, or what a real camera makes of it
    samples: Samples | RealOptics = 1

    def colours(self, stop: int, places: Floats) -> Bytes:
        """Colours (n, 3) of a stop's photograph at columns and rows (n, 2)."""
        if not isinstance(self.samples, RealOptics):
            return resampled_photograph(self.run, self.scene, stop, self.samples, places)
        taken = partial(real_pixels, self.run, self.scene, stop, self.samples)
        return resampled(self.run.camera.width_px, places, taken)

    def in_front(self, mirror: Ints, direction: Floats, distance: Floats) -> Bools:
        """Where (n,) the object is before what camera rays meet at distances (n,), mm."""
        del mirror
        return object_in_front(self.scene, self.run.camera.pinhole, direction, distance)[0]


def merge_run(
    run: PrototypeRun,
    scene: Scene,
    samples: Samples | RealOptics = 1,
    progress: Progress = lambda _: None,
    screen: Any | None = None,
) -> Iterator[RowBand]:
    """Bands of the merged picture; pixels of photographs are means of `samples`, or real.

    The scene has bodies before the object as they are, the screen with their tolerance.
    """
    photographs = SimulatedPhotographs(run, scene, samples)
    plan = merge_plan(run, scene.radius, photographs.in_front, screen=screen)
    yield from merge_photographs(plan, photographs, progress)
