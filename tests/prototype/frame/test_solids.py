"""The frame as solids: axes and volumes from the shapes themselves."""

import numpy as np
import pytest
from OCP.TopoDS import TopoDS_Shape

from tbcad.cad.kernel.checks import volume
from tbcad.core.geometry.vectors import norm
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.frame.corner import SLOT_DEPTH_MM
from tbcad.prototype.frame.shared import CLEARANCE_HOLE_MM, BearingHead
from tbcad.prototype.frame.stock import Stock
from tbcad.prototype.part import FrameLayout
from tbcad.prototype.printed import component_solid
from tests.helpers import cylinders
from tests.prototype.conftest import SMALL

FRAME = SMALL.prototype.frame


@pytest.fixture(scope="module")
def purchased(frame: FrameLayout) -> dict[str, TopoDS_Shape]:
    return {part.name: component_solid(part) for part in frame.purchased}


class TestSolids:
    def test_bearing_seats_and_bearings_are_on_the_axis(
        self, carrier: BaseLayout, frame: FrameLayout, purchased: dict[str, TopoDS_Shape]
    ) -> None:
        w, seat = carrier.frame[0], (22 + FRAME.bearing_fit_mm) / 2
        head = cylinders(component_solid(frame.of(BearingHead).printed[0]))
        seats = [one for one in head if abs(one[2] - seat) < 1e-9]
        assert len(seats) >= 2
        rings = [*cylinders(purchased["bearing_front"]), *cylinders(purchased["bearing_rear"])]
        assert len(rings) == 4
        for point, way, _ in (*seats, *rings):
            assert norm(np.cross(point, w)) < 1e-9
            assert norm(np.cross(way, w)) < 1e-9

    def test_bought_bodies_have_their_volumes(
        self, purchased: dict[str, TopoDS_Shape], frame: FrameLayout
    ) -> None:
        bar_of_shaft, stock = frame.of(BearingHead).shaft, frame.of(Stock)
        assert bar_of_shaft
        shaft = np.pi * 4**2 * bar_of_shaft["length_mm"]
        ring = np.pi * (11**2 - 4**2) * 7
        assert volume(purchased["shaft"]) == pytest.approx(shaft, rel=1e-9)
        assert volume(purchased["bearing_front"]) == pytest.approx(ring, rel=1e-9)
        slots = 4 * stock.upright["slot_mm"] * SLOT_DEPTH_MM
        bar = (20 * 20 - slots) * stock.length
        assert volume(purchased["upright_left"]) == pytest.approx(bar, rel=1e-9)
        radii = {round(radius, 6) for _, _, radius in cylinders(purchased["wheel"])}
        assert CLEARANCE_HOLE_MM[3.0] / 2 in radii
        length, width, thick = stock.plate.sizes
        holes = len(stock.holes) * np.pi * 2.1**2 * thick
        assert volume(purchased["plate"]) == pytest.approx(length * width * thick - holes, rel=1e-9)
