"""The carrier's wall, and where its ribs and rings are left out."""

import numpy as np
import pytest

from tbcad.cad.kernel.checks import volume
from tbcad.cad.kernel.solids import faces, polyhedron, revolved_polygon
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.gaps import MIN_PART_MM, STEP_MM, rib_gaps, ring_arcs
from tbcad.prototype.base.layout import FACETS_OUT_MM, BaseLayout, base_layout
from tbcad.prototype.base.solid import facet_count, wall_facets, wall_section


@pytest.fixture(scope="module")
def base(paper_prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(BaseSpec(), paper_prototype)


def test_facets_are_tangent_to_the_cones_and_close_a_solid(base: BaseLayout) -> None:
    """Middles on the cones, edges just outside; the volume is that by tangent polygons."""
    low, high = base.sector
    section, facets = wall_section(base), wall_facets(base)
    count = facet_count(float(section[:, 1].max()), high - low)
    half, wall = (high - low) / (2 * count), polyhedron(facets)
    cones = volume(revolved_polygon(section, low, high - low))
    assert volume(wall) == pytest.approx(cones * np.tan(half) / half, rel=1e-9)
    assert len(faces(wall)) == count * len(section) + 2
    sides = np.stack(facets[:-2]).reshape(-1, len(section), 4, 3)
    middles = norm((sides[:, :, 0] + sides[:, :, 1])[..., :2] / 2)
    assert middles == pytest.approx(np.broadcast_to(section[:, 1], middles.shape), abs=1e-9)
    out = norm(sides[:, :, 0, :2]) - section[:, 1]
    assert 0 < out.min() <= FACETS_OUT_MM / 2 < out.max() <= FACETS_OUT_MM


def test_arcs_and_ribs_miss_every_number(base: BaseLayout) -> None:
    seats = base.local_seats
    for ring in base.rings:
        z, r = ring.mean(axis=0)
        for low, high in ring_arcs(base, ring, *base.sector):
            assert (high - low) * ring[:, 1].max() >= MIN_PART_MM - STEP_MM
            azimuth = np.linspace(low, high, 500)
            points = np.stack([r * np.cos(azimuth), r * np.sin(azimuth), 0 * azimuth + z], axis=1)
            offset = points[:, None] - seats.at_depth(seats.back)
            along = (offset * seats.axis).sum(axis=-1)
            beside = norm(offset - along[..., None] * seats.axis)
            assert not ((along > 0) & (beside < seats.boss)).any()
    sides = [0.0, -0.5, -0.5, -1.0]
    counts = [len(rib_gaps(base, a, s)) for a, s in zip(base.ribs.tolist(), sides, strict=True)]
    assert counts[0] == counts[-1] == 0  # the edges' ribs stand beyond all bosses
    assert max(counts) > 0
