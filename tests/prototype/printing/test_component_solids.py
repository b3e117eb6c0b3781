"""Solids of primitives and components, against booleans and closed forms."""

import numpy as np
import pytest

from tbcad.cad.measures import properties
from tbcad.cad.solids import faces, fused, one_solid
from tbcad.geometry.primitives import Slot, slot_parts, volume
from tbcad.geometry.vectors import unit
from tbcad.prototype.printing.placing import primitive_solid

TILTED = unit(np.array([0.3, -0.5, 0.8]))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_slot_is_the_union_of_its_parts(sign: float) -> None:
    across = unit(np.cross(TILTED, [1.0, -2.0, 3.0]))
    slot = Slot(np.array([1.0, -2.0, 3.0]), sign * 4 * across, 2.0, 7 * TILTED)
    solid = one_solid("slot", primitive_solid(slot))
    found = properties(solid)
    expected = properties(fused([primitive_solid(part) for part in slot_parts(slot)]))
    assert len(faces(solid)) == 6
    assert found.volume == pytest.approx(volume(slot), rel=1e-12)
    assert found.volume == pytest.approx(expected.volume, rel=1e-9)
    assert found.area == pytest.approx(expected.area, rel=1e-9)
    assert found.centroid == pytest.approx(expected.centroid, abs=1e-9)
