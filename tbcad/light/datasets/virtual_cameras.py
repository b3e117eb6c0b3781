"""Virtual cameras as central ones: the best common point of each mirror's rays, and its errors.

A crop of the photographs, the pixels of one mirror, is one virtual camera's picture. The rays after
a curved mirror pass no common point. Nearest to all of them is one point, the centre of the pinhole
camera that stands for the mirror. A pixel is given the place where its ray meets the plane through
the middle of the capture sphere: there the pinhole is right, and before and behind that plane it is
off by the ray's distance from the centre times depth over distance.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.parallel import in_batches
from tbcad.light.simulate.scene.rays import meets_sphere
from tbcad.light.simulate.views.mirror_tiles import convergence_point, mirror_pixels
from tbcad.types import Bools, Bytes, Floats, Ints, Progress

UP = np.array([0.0, 0.0, 1.0])
# Straight down, where "up" says nothing about the rows, they run along this.
ROWS_AT_ZENITH = np.array([1.0, 0.0, 0.0])
MIN_UP = 1e-6
# Fewer rays, or none side by side, are no picture.
MIN_RAYS = 16
# A centre in the capture sphere or at its border is none of a camera that looks at all of it.
MIN_DISTANCE = 1.05


@dataclass(frozen=True)
class MirrorId:
    """A mirror of a light field."""

    frame: str  # "a" or "b"
    index: int  # its place in the frame, from 0

    @property
    def name(self) -> str:
        """As mirrors.csv names it: a0001."""
        return f"{self.frame}{self.index + 1:04d}"


@dataclass(frozen=True)
class Crop:
    """A rectangle of h x w pixels that holds all of a mirror's."""

    colour: Bytes  # (h, w, 3)
    origin: Floats  # where rays leave the mirror, mm, (h, w, 3)
    direction: Floats  # unit vectors, (h, w, 3)
    valid: Bools  # whether a pixel is of this mirror, (h, w)
    meets: Bools  # whether it is, and its ray meets the capture sphere, (h, w)

    @property
    def rays(self) -> tuple[Floats, Floats]:
        """Origins and directions of the rays that meet the capture sphere, (n, 3) each."""
        return self.origin[self.meets], self.direction[self.meets]

    def flipped(self) -> "Crop":
        """The crop with its columns reversed: a mirror shows everything the wrong way round."""
        return Crop(*(getattr(self, one.name)[:, ::-1] for one in fields(self)))


def read_crop(source: LightField, mirror: MirrorId) -> Crop | None:
    """Read the pixels of a mirror; None where it has none."""
    found = mirror_pixels(source.frames[mirror.frame], mirror.index)
    if found is None:
        return None
    valid, (colour, *rays) = found
    origin, direction = (one.astype(np.float64) for one in rays)
    flat = origin.reshape(-1, 3), direction.reshape(-1, 3)
    meets = meets_sphere(*flat, source.capture_mm / 2).reshape(valid.shape)
    return Crop(colour, origin, direction, valid, valid & meets)


def chosen_mirrors(source: LightField, wanted: str | None, every: int) -> list[MirrorId]:
    """The mirrors to export, in the order of their names.

    `wanted` has cameras and mirrors by name, apart by commas, as "a" or "a0001,b0007"; None: all.
    Of `every` so many virtual cameras one is kept, the kept ones spread evenly. InputError: a name
    is of no mirror of the light field.
    """
    mirrors = list(_all_mirrors(source)) if wanted is None else _named(source, wanted)
    if every == 1:
        return mirrors
    u = np.array([source.frames[one.frame].u[one.index] for one in mirrors])
    return [mirrors[k] for k in spread_evenly(u, -(-len(mirrors) // every))]


def _all_mirrors(source: LightField) -> Iterator[MirrorId]:
    for name, frame in source.frames.items():
        yield from (MirrorId(name, index) for index in range(len(frame.u)))


def _named(source: LightField, wanted: str) -> list[MirrorId]:
    every = {one.name: one for one in _all_mirrors(source)}
    names: set[str] = set()
    for word in (part.strip() for part in wanted.split(",")):
        if word in source.frames:
            names |= {name for name, one in every.items() if one.frame == word}
        elif word in every:
            names.add(word)
        else:
            raise InputError(
                f"--cameras: {word!r} is no virtual camera of the capture: allowed are "
                f"{' and '.join(source.frames)} for all of one camera, or names from "
                f"{min(every)} to {max(every)}, apart by commas"
            )
    return [every[name] for name in sorted(names)]


def reading_order(source: LightField, mirrors: Sequence[MirrorId]) -> Ints:
    """Indices (m,) of mirrors from the top of each picture down: parts of it are read once."""
    frames = [one.frame for one in mirrors]
    tops = [source.frames[one.frame].boxes[one.index, 2] for one in mirrors]
    return np.lexsort([tops, frames])


def spread_evenly(u: Floats, count: int) -> Ints:
    """A number of directions of (m, 3) far from each other, as indices in ascending order.

    Each is the one farthest from those before it, from the first one on (T. F. Gonzalez,
    Theoretical Computer Science 38, 293, 1985): no two are nearer than half the best possible.
    """
    distance, chosen = np.full(len(u), np.inf), [0]
    while len(chosen) < count:
        np.minimum(distance, np.linalg.norm(u - u[chosen[-1]], axis=1), out=distance)
        chosen.append(int(distance.argmax()))
    return np.sort(np.array(chosen))


@dataclass(frozen=True)
class FittedCameras:
    """m virtual cameras of a light field, and how well each is central."""

    mirrors: tuple[MirrorId, ...]  # which mirrors they are
    centre: Floats  # best common points of their rays, mm, (m, 3)
    rays: Floats  # how many rays of each meet the capture sphere, (m,)
    pitch_mm: Floats  # distance of neighbouring rays in the plane through the origin, (m,)
    rms_mm: Floats  # root mean square distance of the rays from the centre, (m,)
    worst_mm: Floats  # largest distance of a ray from the centre, (m,)
    # most that a ray of the pinhole is off the captured one a capture radius before and behind the
    # middle, (m,)
    central_error_mm: Floats
    left_out: dict[str, str]  # reason by name of each mirror that gives no camera

    def __len__(self) -> int:
        return len(self.mirrors)

    def pinhole_cameras(self, capture_mm: float, size_px: int) -> list[Camera]:
        """The pinhole cameras, whose square pictures the capture sphere just fills."""
        return [camera_at(centre, capture_mm, size_px) for centre in self.centre]


def virtual_cameras(
    source: LightField, mirrors: list[MirrorId], progress: Progress = lambda _: None
) -> FittedCameras:
    """Measure the virtual cameras of some mirrors of a light field."""
    radius = source.capture_mm / 2

    def measured(mirror: MirrorId) -> Floats | str:
        crop = read_crop(source, mirror)
        return "no pixels" if crop is None else _measured(crop, radius)

    order = reading_order(source, mirrors)
    read = in_batches(measured, [mirrors[k] for k in order], lambda one: progress(one.name))
    rows = [row for _, row in sorted(zip(order, read, strict=True), key=lambda pair: pair[0])]
    left_out = {
        mirror.name: row for mirror, row in zip(mirrors, rows, strict=True) if isinstance(row, str)
    }
    kept = tuple(one for one in mirrors if one.name not in left_out)
    table = np.array([row for row in rows if not isinstance(row, str)]).reshape(-1, 8)
    rays, pitch, rms, worst, error = table[:, 3:].T
    return FittedCameras(kept, table[:, :3], rays, pitch, rms, worst, error, left_out)


def _measured(crop: Crop, radius: float) -> Floats | str:
    """Centre, rays, pitch, RMS, worst and central error of a crop; or why it is no camera."""
    if crop.meets.sum() < MIN_RAYS:
        return f"fewer than {MIN_RAYS} rays meet the capture sphere"
    origin, direction = crop.rays
    centre, worst = convergence_point(origin, direction)
    distance = float(np.linalg.norm(centre))
    if distance < MIN_DISTANCE * radius:
        return "its rays have no common point outside the capture sphere"
    pitch = _pitch(crop, centre)
    if pitch is None:
        return "no four rays side by side meet the capture sphere"
    offset = origin - centre
    off = norm(offset - dot(offset, direction)[:, None] * direction)
    rms = np.sqrt(np.mean(off**2))
    error = _central_errors(origin, direction, centre, radius).max()
    return np.array([*centre, len(origin), pitch, rms, worst, error])


def at_middle(origin: Floats, direction: Floats, forward: Floats, depth: float = 0.0) -> Floats:
    """Where rays (..., 3) meet the plane across `forward` at a depth (mm) behind the origin.

    NaN where there is no ray: its direction is zero.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (depth - dot(origin, forward)) / dot(direction, forward)
    return np.asarray(origin + along[..., None] * direction)


def _central_errors(origin: Floats, direction: Floats, centre: Floats, radius: float) -> Floats:
    """How far the pinhole's rays are off (n,), mm, at the worse of both ends of the sphere."""
    forward, distance = -unit(centre), float(np.linalg.norm(centre))
    central = at_middle(origin, direction, forward) - centre
    errors = []
    for depth in (-radius, radius):
        captured = at_middle(origin, direction, forward, depth)
        pinhole = centre + central * (distance + depth) / distance
        errors.append(norm(captured - pinhole))
    return np.maximum(*errors)


def _pitch(crop: Crop, centre: Floats) -> float | None:
    """Side of the square that is as large as four neighbouring rays span, in the middle, mm."""
    forward = -unit(centre)
    points = at_middle(crop.origin, crop.direction, forward)
    across, down = neighbour_steps(points, crop.meets)
    return float(np.sqrt(np.median(norm(np.cross(across, down))))) if len(across) else None


def neighbour_steps(places: Floats, known: Bools) -> tuple[Floats, Floats]:
    """Steps to the next column and row, (n, k), where places (h, w, k) of all three are known."""
    inside = known[:-1, :-1] & known[:-1, 1:] & known[1:, :-1]
    corner = places[:-1, :-1]
    return (places[:-1, 1:] - corner)[inside], (places[1:, :-1] - corner)[inside]


def camera_at(centre: Floats, capture_mm: float, size_px: int) -> Camera:
    """A pinhole camera that looks at the origin, z up, its picture filled by the capture sphere."""
    forward = -unit(centre)
    across = np.cross(forward, UP)
    right = unit(across) if np.linalg.norm(across) > MIN_UP else ROWS_AT_ZENITH
    right = unit(right - (right @ forward) * forward)
    half = np.arcsin(capture_mm / 2 / np.linalg.norm(centre))
    return Camera(centre, forward, right, size_px, size_px, float(2 * half))
