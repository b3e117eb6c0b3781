"""The carrier's wall: plane facets round the cones of its section."""

import numpy as np
import pytest

from tbcad.cad.kernel.checks import volume
from tbcad.cad.kernel.solids import faces, polyhedron, revolved_polygon
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import FACETS_OUT_MM, BaseLayout, base_layout
from tbcad.prototype.base.solid import facet_count, wall_facets, wall_section


@pytest.fixture(scope="module")
def base(paper_prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(BaseSpec(), paper_prototype)


def test_facets_close_a_solid_of_the_volume_of_the_cones_by_tangent_polygons(
    base: BaseLayout,
) -> None:
    low, high = base.sector
    section = wall_section(base)
    count = facet_count(float(section[:, 1].max()), high - low)
    half = (high - low) / (2 * count)
    wall = polyhedron(wall_facets(base))
    cones = volume(revolved_polygon(section, low, high - low))
    assert volume(wall) == pytest.approx(cones * np.tan(half) / half, rel=1e-9)
    assert len(faces(wall)) == count * len(section) + 2


def test_middles_of_facets_are_on_the_cones_and_edges_just_outside(base: BaseLayout) -> None:
    section = wall_section(base)
    sides = np.stack(wall_facets(base)[:-2]).reshape(-1, len(section), 4, 3)
    radii = norm(sides[..., :2])
    middles = norm((sides[:, :, 0] + sides[:, :, 1])[..., :2] / 2)
    assert middles == pytest.approx(np.broadcast_to(section[:, 1], middles.shape), abs=1e-9)
    out = radii[:, :, 0] - section[:, 1]
    assert out.min() > 0
    assert FACETS_OUT_MM / 2 < out.max() <= FACETS_OUT_MM


def test_facets_are_as_few_as_the_limit_allows() -> None:
    for radius, angle in [(5.0, 0.2), (80.0, 2.0), (200.0, 5.7)]:
        half = angle / facet_count(radius, angle) / 2
        assert radius / np.cos(half) - radius <= FACETS_OUT_MM
        fewer = facet_count(radius, angle) - 1
        assert fewer == 0 or radius / np.cos(angle / fewer / 2) - radius > FACETS_OUT_MM
