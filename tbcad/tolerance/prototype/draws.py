"""Random prototypes: how far base, balls and camera of each of many are off."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tbcad.tolerance.montecarlo.draws import Error, Errors, generator
from tbcad.types import Bools, Floats

# Streams of one machine begin here, beyond those of its shells (tbcad.tolerance.draws).
FIRST_STREAM = 1000


@dataclass(frozen=True)
class PrototypeDraws:
    """How far s prototypes of k balls and t stops are off, in the order of the machines.

    The base goes through its stops twice, for camera a's mirrors and for camera b's. A point x of
    the base as designed comes to lie at R(tilt) R(axis, stop's angle + angle) x + runout.

    Attributes:
        radius: by which balls are too large, mm, (s, k).
        seat: of the balls' centres on the base, mm, (s, k, 3).
        angle: of the base at each stop of each run, radians, (s, 2, t).
        runout: of the axis there, along azimuth zero and across it, mm, (s, 2, t, 2).
        tilt: of the axis about azimuth zero and across it, both through the object's middle,
            radians, (s, 2).
        camera_shift: of the pinhole, mm, (s, 3).
        camera_tilt: rotation vectors about the pinhole, radians, (s, 3).
        focal: focal length over the designed one, (s,).
    """

    radius: Floats
    seat: Floats
    angle: Floats
    runout: Floats
    tilt: Floats
    camera_shift: Floats
    camera_tilt: Floats
    focal: Floats

    def __len__(self) -> int:
        """Number of machines."""
        return len(self.focal)


def draw(
    errors: Errors, seed: int, machines: Iterable[int], cap: Bools, stops: int
) -> PrototypeDraws:
    """Some prototypes out of endlessly many.

    A machine follows from the seed and its number alone, and each kind of error has a stream of
    its own, as in tbcad.tolerance.draws.draw. Bought balls are off as their grade allows, caps as
    the process makes spheres, each with its centre held.

    Args:
        errors: how exactly things are made.
        seed: of all machines.
        machines: their numbers.
        cap: which of the balls are made, (k,).
        stops: t of one run.
    """
    numbers = list(machines)
    ball, made, seat, angle, runout, tilt, shift, turn, focal = (
        _drawn(getattr(errors, kind), seed, numbers, FIRST_STREAM + stream, shape)
        for stream, (kind, shape) in enumerate(_shapes(len(cap), stops).items())
    )
    radius = np.where(cap, made, ball)
    return PrototypeDraws(radius, seat, angle, runout, tilt, shift, turn, 1 + focal)


def _shapes(k: int, t: int) -> dict[str, tuple[int, ...]]:
    """Numbers to be drawn of each kind, in the order of their streams; only append to it."""
    return {
        "ball_radius": (k,),
        "sphere_radius": (k,),
        "seat": (k, 3),
        "rotation_angle": (2, t),
        "axis_runout": (2, t, 2),
        "axis_tilt": (2,),
        "camera_shift": (3,),
        "camera_tilt": (3,),
        "camera_focal": (),
    }


def _drawn(
    error: Error, seed: int, numbers: list[int], stream: int, shape: tuple[int, ...]
) -> Floats:
    """Errors of one kind of all machines, (s, ...)."""
    drawn = np.full((len(numbers), *shape), error.mean)
    if error.spread != 0:
        for row, number in enumerate(numbers):
            drawn[row] = error.of(generator(seed, number, stream), *shape)
    return drawn
