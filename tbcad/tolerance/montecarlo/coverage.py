"""Coverage of every virtual camera of simulated builds: exact, for cells of any topology."""

from dataclasses import dataclass

import numpy as np

from tbcad.tolerance.montecarlo.cell_edges import AREA, CROSSINGS, MISS_SQUARED, trace_cell_edges
from tbcad.tolerance.montecarlo.draws import ShellDraws
from tbcad.tolerance.montecarlo.edge_model import EdgeModel, EdgeModels, surface_tables, view_tables
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


def mirror_coverage(half: EdgeModel, draws: ShellDraws) -> MirrorCoverage:
    """Coverage of each mirror of one half, for s builds."""
    outlines, pairs = np.empty((len(draws), len(half), 3)), half.pairs
    tables = zip(surface_tables(half, draws), view_tables(half, draws), strict=True)
    for build, (surfaces, view) in enumerate(tables):
        outlines[build] = trace_cell_edges(
            *(surfaces, pairs.pair, pairs.offset, pairs.face, pairs.reach),
            *(half.halved, view, half.screen),
        )
    area = np.abs(outlines[..., AREA]) * (draws.focal[:, None] / half.view.pixel_pitch) ** 2
    crossings = outlines[..., CROSSINGS].astype(np.int64)
    return MirrorCoverage(2 * np.sqrt(outlines[..., MISS_SQUARED]), crossings, area)


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
    edge_models: EdgeModels, draws: tuple[ShellDraws, ShellDraws]
) -> tuple[Floats, Floats]:
    """Exact coverage diameter (mm) and pixels of v virtual cameras in s builds, two of (s, v).

    The halves of a mirror on the seam count together: the smaller diameter, all pixels. A mirror
    without a cell, or whose image does not surround the object's centre, covers nothing.
    """
    halves = [mirror_coverage(half, drawn) for half, drawn in zip(edge_models, draws, strict=True)]
    camera = virtual_camera_numbers(edge_models[1].halved)
    shape = (len(draws[0]), int(camera.max()) + 1)
    diameter, crossings, pixels = np.full(shape, np.inf), np.zeros(shape, int), np.zeros(shape)
    losses = [drawn.facets[:, None] for drawn in draws]
    diameters = [half.diameter - loss for half, loss in zip(halves, losses, strict=True)]
    place = np.arange(shape[0])[:, None], camera
    np.minimum.at(diameter, place, np.concatenate(diameters, axis=1))
    np.add.at(crossings, place, np.concatenate([half.crossings for half in halves], axis=1))
    np.add.at(pixels, place, np.concatenate([half.pixels for half in halves], axis=1))
    surrounds = (crossings % 2 == 1) & np.isfinite(diameter)
    return np.where(surrounds, np.maximum(diameter, 0.0), 0.0), pixels
