"""Random errors of simulated builds: how far each of many builds is off, as arrays over builds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.tolerance.montecarlo.error_kinds import Error, Errors
from tbcad.types import Floats

Shape = tuple[int, ...]


@dataclass(frozen=True)
class ShellDraws:
    """Errors of one camera's half of the shell in s builds, in the order of the builds.

    A point x of the designed shell is moved to R(shell_tilt) (scale * x) + shell_shift.

    Attributes:
        centre: of the spheres, mm, (s, m, 3).
        radius: by which the spheres are too large, coating included, mm, (s, m).
        scale: size over the designed size along each axis, (s, 3).
        shell_shift: mm, (s, 3).
        shell_tilt: rotation vectors about the object's centre, radians, (s, 3).
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
        """Number of builds."""
        return len(self.focal)


def draw(
    errors: Errors, seed: int, builds: Sequence[int], mirrors: int
) -> tuple[ShellDraws, ShellDraws]:
    """Errors of both halves of some builds.

    Args:
        errors: of the process.
        seed: of all builds.
        builds: numbers of the builds.
        mirrors: m of each half.
    """
    drawn = draw_kinds(errors, seed, builds, shell_error_shapes(mirrors))
    return _half(drawn, 0), _half(drawn, 1)


def shell_error_shapes(m: int) -> dict[str, Shape]:
    """Shape of each kind of error of a shell, in the order of the streams; only append to it."""
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


def _half(drawn: Mapping[str, Floats], side: int) -> ShellDraws:
    def of(kind: str) -> Floats:
        return drawn[kind][:, side]

    return ShellDraws(
        centre=of("sphere_centre"),
        radius=of("sphere_radius") + of("coating")[:, None],
        scale=1 + of("scale_isotropic")[:, None] + drawn["scale_axis"],
        shell_shift=of("shell_shift"),
        shell_tilt=of("shell_tilt"),
        camera_shift=of("camera_shift"),
        camera_tilt=of("camera_tilt"),
        focal=1 + of("camera_focal"),
        facets=of("facets"),
    )


def draw_kinds(
    errors: Errors,
    seed: int,
    builds: Sequence[int],
    shapes: Mapping[str, Shape],
    first_stream: int = 0,
) -> dict[str, Floats]:
    """Random errors of each kind for s builds, (s, ...).

    A build depends on the seed and its number alone, not on the others drawn with it. Each kind of
    error has its own random stream, so that a change of one kind leaves the others as they are.

    Args:
        errors: of the process.
        seed: of all builds.
        builds: numbers of the builds.
        shapes: shape of each kind's errors in one build, in the order of the streams.
        first_stream: number of the first kind's stream.
    """
    return {
        kind: _draw_kind(getattr(errors, kind), seed, builds, first_stream + k, shape)
        for k, (kind, shape) in enumerate(shapes.items())
    }


def _draw_kind(error: Error, seed: int, builds: Sequence[int], stream: int, shape: Shape) -> Floats:
    drawn = np.full((len(builds), *shape), float(error.mean))
    if error.spread != 0:
        for row, build in enumerate(builds):
            key = np.random.SeedSequence(seed, spawn_key=(build, stream))
            drawn[row] = error.sample(np.random.Generator(np.random.Philox(key)), *shape)
    return drawn
