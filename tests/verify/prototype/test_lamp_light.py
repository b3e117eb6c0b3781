"""Rays that pass an edge within the error of the assembly's facets count either way."""

from typing import cast

import numpy as np
import pytest
from tbcad_verify.prototype.bodies import Bodies
from tbcad_verify.prototype.light.lamp_light import FACET_MM, EdgedBodies
from tbcad_verify.types import Bools, Floats


class Edge:
    """A body that fills y > 0."""

    def blocked(self, starts: Floats, ends: Floats, angle: float) -> Bools:
        return np.maximum(starts[:, 1], ends[:, 1]) > 0


@pytest.mark.parametrize(
    ("y", "stopped"),
    [
        (-2.0, (False, False)),
        (-0.9, (True, False)),
        (0.9, (True, False)),
        (2.0, (True, True)),
    ],
)
def test_only_rays_near_an_edge_are_undecided(y: float, stopped: tuple[bool, bool]) -> None:
    starts = np.array([[100.0, y * FACET_MM, -50.0]])
    ends = starts * [0.0, 1.0, 0.0]
    found = tuple(
        bool(EdgedBodies(cast(Bodies, Edge()), grazing).blocked(starts, ends, 0.0)[0])
        for grazing in (True, False)
    )
    assert found == stopped
