"""Crops of the photographs: the pixels of one mirror, which are one virtual camera's picture."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.rays import meets_sphere
from tbcad.light.simulate.views.mirror_tiles import mirror_pixels
from tbcad.types import Bools, Bytes, Floats, Ints


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
        return Crop(
            self.colour[:, ::-1],
            self.origin[:, ::-1],
            self.direction[:, ::-1],
            self.valid[:, ::-1],
            self.meets[:, ::-1],
        )


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

    Args:
        source: the light field.
        wanted: cameras and mirrors by name, apart by commas, as "a" or "a0001,b0007"; None: all.
        every: one virtual camera of so many is kept, the kept ones spread evenly.

    Raises:
        InputError: a name is of no mirror of the light field.
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
