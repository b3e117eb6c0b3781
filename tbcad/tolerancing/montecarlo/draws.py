"""Random errors of simulated builds: how far each of many builds is off, as arrays over builds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.form import ASTIGMATISM, TERMS, term_shares
from tbcad.tolerancing.montecarlo.warp import WarpMap, WarpMaps
from tbcad.types import Floats

Shape = tuple[int, ...]


@dataclass(frozen=True)
class ShellDraws:
    """Errors of one camera's half of the shell in s builds, in the order of the builds.

    A point x of the designed shell is moved to R(shell_tilt) (scale * x) + shell_shift.
    """

    centre: Floats  # of the spheres, mm, (s, m, 3)
    radius: Floats  # by which the spheres are too large, coating included, mm, (s, m)
    scale: Floats  # size over the designed size along each axis, (s, 3)
    shell_shift: Floats  # mm, (s, 3)
    shell_tilt: Floats  # rotation vectors about the object's centre, radians, (s, 3)
    camera_shift: Floats  # of the pinhole, mm, (s, 3)
    camera_tilt: Floats  # rotation vectors about the pinhole, radians, (s, 3)
    focal: Floats  # focal length over the designed one, (s,)
    facets: Floats  # coverage lost on facets, mm, (s,)
    foot: Floats  # of the foot plane at each mirror, along its normal, mm, (s, m)
    wall: Floats  # of each wall of a pedestal, along its normal into the mirror's cell, mm, (s, w)
    form: Floats  # factors of the mirrors' form errors (tolerancing.montecarlo.form), mm, (s, m, t)
    valley: Floats  # radius of the fillets in the valleys between mirrors, mm, (s,)

    def __len__(self) -> int:
        return len(self.focal)


def draw(
    errors: Errors,
    seed: int,
    builds: Sequence[int],
    mirrors: int,
    warp: WarpMaps | None = None,
    walls: int = 0,
) -> tuple[ShellDraws, ShellDraws]:
    """Errors of both halves of builds of some numbers, of m mirrors and w walls of pedestals each.

    The warp's maps are those of `warp_maps_of`; ValueError if neighbours share a warp and they are
    missing.
    """
    if warp is None and errors.warp.spread != 0 and errors.warp.length != 0:
        raise ValueError("the warp of these errors needs its maps")
    shapes = shell_error_shapes(mirrors, warp[0].modes if warp else mirrors, walls)
    drawn = draw_kinds(errors, seed, builds, shapes)
    maps = warp or (None, None)
    return _half(drawn, 0, maps[0]), _half(drawn, 1, maps[1])


def shell_error_shapes(m: int, modes: int = 0, walls: int = 0) -> dict[str, Shape]:
    """Shape of each kind of error of a shell, in the order of the streams; only append to it.

    A half has m mirrors, w walls of pedestals, and a warp that follows from so many vectors.
    Mirrors on pedestals have no valleys.
    """
    valleys = (2, int(walls == 0))
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
        "warp": (2, modes, 3),
        "waviness": (2, m, len(TERMS)),
        "groove_wall": (2, walls),
        "cutter_radius": valleys,
        "ridge_rounding": valleys,
    }


def _half(drawn: Mapping[str, Floats], side: int, warp: WarpMap | None) -> ShellDraws:
    def of(kind: str) -> Floats:
        return drawn[kind][:, side]

    draws = ShellDraws(
        centre=of("sphere_centre"),
        radius=of("sphere_radius") + of("coating")[:, None],
        scale=1 + of("scale_isotropic")[:, None] + drawn["scale_axis"],
        shell_shift=of("shell_shift"),
        shell_tilt=of("shell_tilt"),
        camera_shift=of("camera_shift"),
        camera_tilt=of("camera_tilt"),
        focal=1 + of("camera_focal"),
        facets=of("facets"),
        foot=np.zeros(of("sphere_radius").shape),
        wall=of("groove_wall"),
        form=of("waviness") * np.sqrt(term_shares()),
        valley=np.maximum(of("cutter_radius"), of("ridge_rounding")).max(axis=1, initial=0),
    )
    if warp is None:  # each mirror is displaced by its own
        return replace(draws, centre=draws.centre + of("warp"))
    for build, numbers in enumerate(of("warp")):
        centre, radius, foot, astigmatism = warp.moved(numbers)
        draws.centre[build] += centre
        draws.radius[build] += radius
        draws.foot[build] += foot
        draws.wall[build] += warp.walls_moved(numbers)
        draws.form[build][:, ASTIGMATISM] += astigmatism
    return draws


def draw_kinds(
    errors: Errors,
    seed: int,
    builds: Sequence[int],
    shapes: Mapping[str, Shape],
    first_stream: int = 0,
) -> dict[str, Floats]:
    """Random errors of each kind, by shapes in the order of the streams, for s builds, (s, ...).

    A build depends on the seed and its number alone, not on the others drawn with it. Each kind of
    error has its own random stream, so that a change of one kind leaves the others as they are.
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
