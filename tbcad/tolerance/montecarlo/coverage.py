"""Coverage of every virtual camera of simulated builds: exact, for cells of any topology."""

from dataclasses import dataclass

import numpy as np

from tbcad.tolerance.montecarlo.cell_edges import AREA, CROSSINGS, MISS_SQUARED, trace_cell_edges
from tbcad.tolerance.montecarlo.draws import ShellDraws
from tbcad.tolerance.montecarlo.edge_model import (
    EdgeModel,
    EdgeModels,
    form_tables,
    surface_tables,
    view_tables,
)
from tbcad.tolerance.montecarlo.edge_samples import RIGHT
from tbcad.types import Bools, Floats, Ints


@dataclass(frozen=True)
class MirrorCoverage:
    """Coverage of m mirrors of one half in s builds.

    Attributes:
        diameter: twice the minimum distance from the object's centre of all rays camera -> edge of
            the cell -> reflected (DESIGN.md section 2), mm; inf where there is no edge, (s, m).
        crossings: how often the image of the cell's outline crosses a half line from the object's
            centre: an odd number where it surrounds the centre, (s, m).
        pixels: size of the cell's picture, (s, m).
    """

    diameter: Floats
    crossings: Ints
    pixels: Floats


def mirror_coverage(half: EdgeModel, draws: ShellDraws, worst_only: bool = False) -> MirrorCoverage:
    """Coverage of each mirror of one half, for s builds; see `trace_cell_edges` for worst_only."""
    outlines = _outlines(half, draws, worst_only)
    area = np.abs(outlines[..., AREA]) * (draws.focal[:, None] / half.view.pixel_pitch) ** 2
    crossings = outlines[..., CROSSINGS].astype(np.int64)
    return MirrorCoverage(2 * np.sqrt(outlines[..., MISS_SQUARED]), crossings, area)


def _outlines(half: EdgeModel, draws: ShellDraws, worst_only: bool) -> Floats:
    """What `trace_cell_edges` finds in s builds, (s, m, 3)."""
    outlines = np.empty((len(draws), len(half), 3))
    surfaces, views = surface_tables(half, draws), view_tables(half, draws)
    forms, pairs = form_tables(half, draws), half.pairs.arrays
    if worst_only:  # pictures do not count: cameras that only turn see the same
        views[:, RIGHT:] = views[:1, RIGHT:]
    for build in range(len(draws)):
        if build > 0 and _same(build, surfaces, forms, views):
            outlines[build] = outlines[build - 1]
            continue
        outlines[build] = trace_cell_edges(
            surfaces[build], forms[build], pairs, half.halved, views[build], half.screen,
            worst_only,
        )  # fmt: skip
    return outlines


def _same(build: int, *tables: Floats) -> bool:
    """Whether a build is the same as the one before it."""
    return all(np.array_equal(table[build - 1], table[build]) for table in tables)


def virtual_camera_numbers(halved: Bools) -> Ints:
    """Number of each mirror's virtual camera, a's mirrors, then b's, (2 m,).

    The two halves of a mirror on the seam share one virtual camera; mirror i of camera b is
    mirror i of camera a reflected in the plane x = 0.

    Args:
        halved: mirrors of one camera that the seam halves, (m,).
    """
    of_a = np.arange(len(halved))
    separate = len(halved) + np.cumsum(~halved) - 1
    return np.concatenate([of_a, np.where(halved, of_a, separate)])


def coverage(
    edge_models: EdgeModels, draws: tuple[ShellDraws, ShellDraws], worst_only: bool = False
) -> tuple[Floats, Floats]:
    """Exact coverage diameter (mm) and pixels of v virtual cameras in s builds, two of (s, v).

    The halves of a mirror on the seam count together: the smaller diameter, all pixels. A mirror
    without a cell, or whose image does not surround the object's centre, covers nothing.

    Args:
        edge_models: both halves as designed.
        draws: errors of each half.
        worst_only: only the minimum diameter of each build is exact, the others are not below
            theirs; and no pixels. It takes less time.
    """
    camera = virtual_camera_numbers(edge_models[1].halved)
    shape = (len(draws[0]), int(camera.max()) + 1)
    diameter, crossings, pixels = np.full(shape, np.inf), np.zeros(shape, int), np.zeros(shape)
    for half, drawn, of_half in zip(edge_models, draws, np.split(camera, 2), strict=True):
        seen, place = mirror_coverage(half, drawn, worst_only), np.s_[:, of_half]
        of_mirrors = seen.diameter - drawn.facets[:, None]
        diameter[place] = np.minimum(diameter[place], of_mirrors)
        crossings[place] += seen.crossings
        pixels[place] += seen.pixels
    surrounds = (crossings % 2 == 1) & np.isfinite(diameter)
    return np.where(surrounds, np.maximum(diameter, 0.0), 0.0), pixels
