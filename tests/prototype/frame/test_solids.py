"""The frame as solids: axes, pinhole and clearances, all from the shapes themselves."""

from itertools import combinations

import numpy as np
import pytest
from OCP.TopoDS import TopoDS_Shape

from tbcad.cad.kernel.checks import volume
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.design import PrinterSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.frame.layout import SLOT_DEPTH_MM, FrameLayout
from tbcad.prototype.frame.purchased import CLEARANCE_HOLE_MM
from tbcad.prototype.printed import PlacedSolid, component_solid, placed_component
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout
from tbcad.types import Floats
from tests.helpers import as_trimesh, cylinders, manifold
from tests.prototype.conftest import SMALL

PRINTER = PrinterSpec()
FRAME = SMALL.prototype.frame
PARTS = load_parts()
DRIVE = load_drives(PARTS)[0]
UP = np.array([0.0, 0.0, 1.0])


def printed_solids(
    layout: FrameLayout | StageLayout, printer: PrinterSpec = PRINTER
) -> dict[str, PlacedSolid]:
    components = layout.printed if isinstance(layout, FrameLayout) else layout.components
    return {part.name: placed_component(part, printer, 0.1) for part in components}


def holes_of(part: PlacedSolid, size: float, way: Floats | None = None) -> list[Floats]:
    """Points on the axes of round faces of a radius, each axis once, all along a direction."""
    found: list[Floats] = []
    for point, axis, radius in cylinders(part.shape):
        known = any(norm(np.cross(point - one, axis)) < 1e-6 for one in found)
        along = way is None or abs(axis @ way) > 1 - 1e-9
        if abs(radius - size) < 1e-9 and along and not known:
            found.append(point)
    return found


@pytest.fixture(scope="module")
def solids(frame: FrameLayout) -> dict[str, PlacedSolid]:
    return printed_solids(frame)


@pytest.fixture(scope="module")
def purchased(frame: FrameLayout) -> dict[str, TopoDS_Shape]:
    return {part.name: component_solid(part) for part in frame.purchased}


class TestSolids:
    def test_each_is_watertight(self, solids: dict[str, PlacedSolid]) -> None:
        assert len(solids) == 12
        for part in solids.values():
            mesh = as_trimesh(part.shape)
            assert mesh.is_watertight
            assert mesh.is_winding_consistent
            assert mesh.body_count == 1
            assert mesh.volume == pytest.approx(part.volume, rel=2e-3)

    def test_bearing_seats_and_bearings_are_on_the_axis(
        self,
        carrier: BaseLayout,
        solids: dict[str, PlacedSolid],
        purchased: dict[str, TopoDS_Shape],
    ) -> None:
        w, seat = carrier.frame[0], (22 + FRAME.bearing_fit_mm) / 2
        head = cylinders(solids["bearing_head"].shape)
        seats = [one for one in head if abs(one[2] - seat) < 1e-9]
        assert len(seats) >= 2
        rings = [*cylinders(purchased["bearing_front"]), *cylinders(purchased["bearing_rear"])]
        assert len(rings) == 4
        for point, way, _ in (*seats, *rings):
            assert norm(np.cross(point, w)) < 1e-9
            assert norm(np.cross(way, w)) < 1e-9

    def test_motor_holes_are_a_square_of_31_mm(
        self, carrier: BaseLayout, solids: dict[str, PlacedSolid]
    ) -> None:
        w, out, side = carrier.frame
        holes = [
            point
            for point, way, radius in cylinders(solids["bearing_head"].shape)
            if abs(radius - 1.7) < 1e-9 and abs(way @ w) > 0.999
        ]
        across = sorted({round(float(p @ side), 6) for p in holes})
        along = sorted({round(float(p @ out), 6) for p in holes})
        assert across == [-15.5, 15.5]
        half = FRAME.belt_travel_mm / 2
        ends = [m + s for m in (-15.5, 15.5) for s in (-half, half)]
        assert np.array(along) - DRIVE.centre_mm == pytest.approx(np.array(ends), abs=1e-5)

    def test_plate_and_fence_put_the_pinhole_where_the_record_has_it(
        self, small_prototype: PrototypeLayout, solids: dict[str, PlacedSolid]
    ) -> None:
        """From the solids alone: face, slot and fence, and the camera's radius and lengths."""
        view, own = small_prototype.array.camera, SMALL.prototype
        ends = holes_of(solids["camera_plate"], 3.3)
        assert len(ends) == 2
        middle = sum(ends) / 2
        across = np.array([0.0, 1.0, 0.0])
        out = np.cross(view.forward, across)
        out *= np.sign(out[0])
        face = (as_trimesh(solids["camera_plate"].shape).vertices @ out).min()
        thread = middle + (face - middle @ out) * out
        pinhole = thread - own.camera_diameter_mm / 2 * out + FRAME.camera_screw_mm * view.forward
        assert norm(pinhole - view.pinhole) < 1e-6
        behind = as_trimesh(solids["camera_fence"].shape).vertices @ -view.forward
        length = behind.min() + view.pinhole @ view.forward
        assert length == pytest.approx(own.camera_length_mm)

    def test_screws_of_the_camera_plate_are_in_the_middle_of_their_slots(
        self, solids: dict[str, PlacedSolid]
    ) -> None:
        """Inserts of the plate before the bracket's slots, the fence's before the plate's."""
        for one, size, other in (
            ("camera_plate", 3.2, "camera_bracket"),
            ("camera_fence", 2.75, "camera_plate"),
        ):
            screws = holes_of(solids[one], size)
            assert len(screws) == {"camera_plate": 3, "camera_fence": 2}[one]
            out = next(way for _, way, r in cylinders(solids[one].shape) if abs(r - size) < 1e-9)
            for screw in screws:
                ends = [
                    end - screw - (end - screw) @ out * out
                    for end in holes_of(solids[other], 2.75, out)
                ]
                nearest = sorted(ends, key=norm)[:2]
                assert norm(nearest[0] + nearest[1]) < 1e-6
                assert norm(nearest[0]) >= 5

    def test_the_clamp_holds_the_post_and_the_plates_holes_are_below_the_brackets(
        self, solids: dict[str, PlacedSolid], stage: StageLayout, frame: FrameLayout
    ) -> None:
        radius = stage.sizes.post + FRAME.post_play_mm / 2
        found = cylinders(solids["stage_foot"].shape)
        bores = [(point, way) for point, way, size in found if abs(size - radius) < 1e-9]
        assert bores
        for point, way in bores:
            assert norm(point[:2]) < 1e-9
            assert abs(way[2]) == pytest.approx(1)
        middles = np.array([p[:2] for part in solids.values() for p in holes_of(part, 2.75, UP)])
        for hole in frame.holes @ frame.axes[:2, :2]:
            assert norm(middles - hole).min() <= 5 + 1e-9  # half of the slots' travel

    def test_bought_bodies_have_their_volumes(
        self, purchased: dict[str, TopoDS_Shape], frame: FrameLayout
    ) -> None:
        assert frame.head.shaft
        shaft = np.pi * 4**2 * frame.head.shaft["length_mm"]
        ring = np.pi * (11**2 - 4**2) * 7
        assert volume(purchased["shaft"]) == pytest.approx(shaft, rel=1e-9)
        assert volume(purchased["bearing_front"]) == pytest.approx(ring, rel=1e-9)
        slots = 4 * frame.upright["slot_mm"] * SLOT_DEPTH_MM
        bar = (20 * 20 - slots) * frame.length
        assert volume(purchased["upright_left"]) == pytest.approx(bar, rel=1e-9)
        radii = {round(radius, 6) for _, _, radius in cylinders(purchased["wheel"])}
        assert CLEARANCE_HOLE_MM[3.0] / 2 in radii
        length, width, thick = frame.plate.sizes
        holes = len(frame.holes) * np.pi * 2.1**2 * thick
        assert volume(purchased["plate"]) == pytest.approx(length * width * thick - holes, rel=1e-9)


class TestClearance:
    def test_printed_and_purchased_parts_do_not_overlap(
        self,
        solids: dict[str, PlacedSolid],
        purchased: dict[str, TopoDS_Shape],
        stage: StageLayout,
    ) -> None:
        parts = solids | printed_solids(stage)
        shapes = {name: part.shape for name, part in parts.items()} | purchased
        bodies = {name: manifold(shape) for name, shape in shapes.items()}
        for one, other in combinations(bodies, 2):
            shared = (bodies[one] ^ bodies[other]).volume()
            assert shared < allowed({one, other}), (one, other, shared)


def allowed(pair: set[str]) -> float:
    """Volume that facets of round fits may share, mm^3; a press fit's is meant."""
    if pair in ({"bearing_head", "bearing_front"}, {"bearing_head", "bearing_rear"}):
        return np.pi * 22 * 7 * -FRAME.bearing_fit_mm
    return 2.0
