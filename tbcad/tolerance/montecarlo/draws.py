"""Random machines: how far each of many made machines is off, as arrays over machines."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tbcad.types import Floats

Distribution = Literal["normal", "uniform"]


@dataclass(frozen=True)
class Error:
    """One kind of error.

    Attributes:
        spread: standard deviation if normal, half width if uniform; in mm, radians or as a share.
        mean: what is off in every machine, in the same unit.
        distribution: of what is off beside the mean.
    """

    spread: float = 0.0
    mean: float = 0.0
    distribution: Distribution = "normal"

    def of(self, generator: np.random.Generator, *shape: int) -> Floats:
        """Errors of a shape, drawn."""
        normal = self.distribution == "normal"
        drawn = generator.standard_normal(shape) if normal else generator.uniform(-1, 1, shape)
        result: Floats = self.mean + self.spread * drawn
        return result


NONE = Error()


@dataclass(frozen=True)
class Errors:
    """How exactly a process makes things, one kind a field, mm, radians and shares (1 = 100 %).

    Attributes:
        sphere_centre: of each mirror's centre along each axis, mm.
        sphere_radius: of each mirror's radius, mm.
        scale_isotropic: share by which a shell is too large, one for each shell.
        scale_axis: share by which both shells are too large along each axis of the frame.
        shell_shift: of a whole shell along each axis, mm.
        shell_tilt: of a whole shell about each axis through the object's middle, radians.
        camera_shift: of each pinhole along each axis, mm.
        camera_tilt: of each camera about each axis through its pinhole, radians.
        camera_focal: share by which each camera's focal length is too long.
        coating: by which a shell's coat is too thick, mm.
        facets: coverage lost where a mirror is cut from flat facets, mm.
        rotation_angle: of the prototype's base at each stop, radians.
        axis_runout: of its axis, sideways, at each stop, mm.
        axis_tilt: of its axis, radians.
        ball_radius: of each ball's radius, mm.
        seat: of each ball's centre along each axis, mm.
    """

    sphere_centre: Error = NONE
    sphere_radius: Error = NONE
    scale_isotropic: Error = NONE
    scale_axis: Error = NONE
    shell_shift: Error = NONE
    shell_tilt: Error = NONE
    camera_shift: Error = NONE
    camera_tilt: Error = NONE
    camera_focal: Error = NONE
    coating: Error = NONE
    facets: Error = NONE
    rotation_angle: Error = NONE
    axis_runout: Error = NONE
    axis_tilt: Error = NONE
    ball_radius: Error = NONE
    seat: Error = NONE


@dataclass(frozen=True)
class Draws:
    """One camera's half of s machines: how far each is off, in the order of the machines.

    A point x of the shell as designed comes to lie at R(shell_tilt) (scale * x) + shell_shift.

    Attributes:
        centre: of the spheres, mm, (s, m, 3).
        radius: by which the spheres are too large, coat included, mm, (s, m).
        scale: size over the designed size along each axis, (s, 3).
        shell_shift: mm, (s, 3).
        shell_tilt: rotation vectors about the object's middle, radians, (s, 3).
        camera_shift: of the pinhole, mm, (s, 3).
        camera_tilt: rotation vectors about the pinhole, radians, (s, 3).
        focal: focal length over the designed one, (s,).
        facets: coverage lost on facets, mm, (s,).
    """

    centre: Floats
    radius: Floats
    scale: Floats
    shell_shift: Floats
    shell_tilt: Floats
    camera_shift: Floats
    camera_tilt: Floats
    focal: Floats
    facets: Floats

    def __len__(self) -> int:
        """Number of machines."""
        return len(self.focal)


def draw(errors: Errors, seed: int, machines: range, mirrors: int) -> tuple[Draws, Draws]:
    """Both halves of some machines out of endlessly many.

    A machine follows from the seed and its number alone, whoever draws it and with which others.
    Each kind of error has a stream of its own: with one kind made smaller the others stay.

    Args:
        errors: how exactly things are made.
        seed: of all machines.
        machines: their numbers.
        mirrors: m of each half.
    """
    rows = [_machine(errors, seed, number, mirrors) for number in machines]
    a, b = (_stacked([row[side] for row in rows], mirrors) for side in range(2))
    return a, b


def _machine(errors: Errors, seed: int, number: int, m: int) -> tuple[dict[str, Floats], ...]:
    """Both halves of one machine by the names of Draws."""
    both = {kind: _drawn(errors, kind, seed, number, shape) for kind, shape in _shapes(m).items()}
    return tuple(_half(both, side) for side in range(2))


def _shapes(m: int) -> dict[str, tuple[int, ...]]:
    """Numbers to be drawn of each kind, in the order of their streams; only append to it."""
    return {
        "sphere_centre": (2, m, 3),
        "sphere_radius": (2, m),
        "scale_isotropic": (2,),
        "scale_axis": (3,),
        "shell_shift": (2, 3),
        "shell_tilt": (2, 3),
        "camera_shift": (2, 3),
        "camera_tilt": (2, 3),
        "camera_focal": (2,),
        "coating": (2,),
        "facets": (2,),
    }


def _drawn(errors: Errors, kind: str, seed: int, number: int, shape: tuple[int, ...]) -> Floats:
    error: Error = getattr(errors, kind)
    if error.spread == 0:
        return np.full(shape, error.mean)
    return error.of(generator(seed, number, list(_shapes(0)).index(kind)), *shape)


def generator(seed: int, number: int, stream: int) -> np.random.Generator:
    """The random numbers of one machine's one kind of error."""
    key = np.random.SeedSequence(seed, spawn_key=(number, stream))
    return np.random.Generator(np.random.Philox(key))


def _half(both: dict[str, Floats], side: int) -> dict[str, Floats]:
    return {
        "centre": both["sphere_centre"][side],
        "radius": both["sphere_radius"][side] + both["coating"][side],
        "scale": 1 + both["scale_isotropic"][side] + both["scale_axis"],
        "shell_shift": both["shell_shift"][side],
        "shell_tilt": both["shell_tilt"][side],
        "camera_shift": both["camera_shift"][side],
        "camera_tilt": both["camera_tilt"][side],
        "focal": 1 + both["camera_focal"][side],
        "facets": both["facets"][side],
    }


def _stacked(rows: list[dict[str, Floats]], m: int) -> Draws:
    names = _half({kind: np.zeros(shape) for kind, shape in _shapes(m).items()}, 0)
    empty = {name: np.zeros((0, *np.shape(one))) for name, one in names.items()}
    return Draws(**{n: np.stack([r[n] for r in rows]) if rows else empty[n] for n in names})
