"""What neither half of a mirror on the seam sees of the object.

The two halves are different spheres: their cuts along x = 0 map to slightly different curves at
the object. Where the halves overlap, both see what lies between the curves; elsewhere neither does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.lines import crossings
from tbcad_verify.mesh.surfaces import ReflectedRays
from tbcad_verify.record.poses import VirtualCameras
from tbcad_verify.shell.outline import Outline
from tbcad_verify.types import Floats

STEPS = 121
# Coordinates of 32 bits displace images by less than this: a narrower gap is none.
ROUNDING_MM = 5e-3


def gaps(
    outlines: list[Outline],
    lines: list[ReflectedRays],
    virtual: VirtualCameras,
    u: Floats,
    radius_mm: float,
) -> Floats:
    """(V,) widest gap between the two halves' views over the disc that faces the camera, mm.

    0 where the halves overlap, and for virtual cameras of whole mirrors; NaN where one half is
    missing.

    Args:
        outlines: of each camera.
        lines: reflected on fitted surfaces, at each outline's samples.
        virtual: pairs halves.
        u: (3, M) directions of the virtual cameras.
        radius_mm: of the disc.
    """
    halves = np.unique(virtual.index[virtual.halved])
    widest = np.zeros(virtual.count)
    if len(outlines) != 2 or not halves.size:
        return widest
    cuts = [
        _cut(o, at, virtual, u, halves, radius_mm) for o, at in zip(outlines, lines, strict=True)
    ]
    height = np.linspace(-radius_mm, radius_mm, STEPS)
    chord = np.sqrt(np.maximum(radius_mm**2 - height**2, 0))
    (one, side), (two, _) = cuts
    one, two = np.clip(one, -chord, chord), np.clip(two, -chord, chord)
    gap = (side[:, None] * (one - two)).max(axis=1)
    widest[halves] = np.where(gap < ROUNDING_MM, 0.0, gap)
    return widest


def counted(diameter: Floats, gap: Floats, radius_mm: float) -> Floats:
    """(V,) coverage diameters that fall short of the object by what the halves leave unseen, mm.

    A boundary short of the disc's edge by e takes 2 e from a diameter. Halves that each end e
    before the other's begin at x = 0 leave a gap of 2 e, which is counted alike.
    """
    return np.asarray(np.where(gap > 0, np.minimum(diameter, 2 * radius_mm - gap), diameter))


def _cut(
    outline: Outline,
    lines: ReflectedRays,
    virtual: VirtualCameras,
    u: Floats,
    halves: NDArray[np.intp],
    radius_mm: float,
) -> tuple[Floats, Floats]:
    """One camera's halves (H): x of the cut's image at STEPS heights, and the side it sees."""
    camera = virtual.index[outline.mirror]
    rows = np.flatnonzero(virtual.halved[outline.mirror])
    half = np.searchsorted(halves, camera[rows])
    x, y = _image(lines, u, outline.mirror, rows)
    seam = outline.seam[rows]
    side = np.sign(np.bincount(half[~seam], x[~seam], halves.size))
    # One call of interp for all halves: each has a stretch of the number line of its own.
    stretch = 16 * radius_mm
    place = half[seam] * stretch + np.clip(y[seam], -4 * radius_mm, 4 * radius_mm)
    order = np.argsort(place, kind="stable")
    heights = np.arange(halves.size)[:, None] * stretch + np.linspace(-radius_mm, radius_mm, STEPS)
    curve = np.interp(heights, place[order], x[seam][order])
    return np.where(
        np.bincount(half[seam], minlength=halves.size)[:, None] > 0, curve, np.nan
    ), side


def _image(
    lines: ReflectedRays, u: Floats, mirror: NDArray[np.intp], rows: NDArray[np.intp]
) -> tuple[Floats, Floats]:
    """Where lines pierce the plane through the origin across u: along x, and across it."""
    u = u[:, mirror[rows]]
    p, r = lines.point[:, rows], lines.toward[:, rows]
    at = crossings(p, r, u)
    return at[0], u[1] * at[2] - u[2] * at[1]
