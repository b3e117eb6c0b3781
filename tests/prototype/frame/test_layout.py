"""The frame: where its bodies are, what is bought, and what is refused."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tbcad.core.geometry.primitives import Component, Cylinder, enclosing_triangles
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.arrangement import frame_layout
from tbcad.prototype.base.fasteners import base_fasteners
from tbcad.prototype.base.layout import base_layout
from tbcad.prototype.base.split import UNCUT
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.frame.camera_mount import CameraMount
from tbcad.prototype.frame.corner import CORNER
from tbcad.prototype.frame.head import BearingHead, bearing_head
from tbcad.prototype.frame.stock import UPRIGHTS, Stock
from tbcad.prototype.keepout import keep_out_volume
from tbcad.prototype.part import FrameLayout, Site, frame_axes
from tbcad.prototype.purchased.parts import choose_part, load_parts
from tbcad.prototype.stage.layout import stage_layout
from tests.prototype.conftest import CAPTURE_RADIUS, SMALL

PARTS = load_parts()
DRIVES = load_drives(PARTS)


def drive(name: str, number: int = 0) -> Drive:
    return [one for one in DRIVES if one.name == name][number]


def motor_and_pinion(head: BearingHead) -> tuple[Component, Cylinder]:
    """The motor, and the pinion's toothed part."""
    bodies = {item.name: item for item in head.purchased}
    pinion = bodies["pinion"].added[0]
    assert isinstance(pinion, Cylinder)
    return bodies["motor"], pinion


def changed(site: Site, own: dict[str, Any] | None = None, **frame: Any) -> Site:
    """With other keys of the prototype and of its frame."""
    section = site.spec.prototype.frame.model_copy(update=frame)
    prototype = site.spec.prototype.model_copy(update={**(own or {}), "frame": section})
    return replace(site, spec=site.spec.model_copy(update={"prototype": prototype}))


def driven(site: Site, name: str, number: int = 0) -> Site:
    """With the base's hub for a drive, wherever else there is room."""
    base = base_layout(SMALL.prototype.base.model_copy(update={"drive": name}), site.layout)
    return replace(site, base=base, drive=drive(name, number))


def head_of(site: Site) -> BearingHead:
    return bearing_head(site, FrameLayout(()))


class TestFrame:
    def test_axes_are_level_across_and_up(self, site: Site) -> None:
        assert site.axes @ site.axes.T == pytest.approx(np.eye(3))
        assert site.axes[2].tolist() == [0, 0, 1]
        assert abs(site.axes[1] @ site.base.frame[0]) < 1e-12
        assert frame_axes(np.array([0.6, 0.48, -0.64])) @ [0, 0, 1] == pytest.approx([0, 0, 1])

    def test_bearings_and_shaft_are_on_the_axis_beyond_the_hub(
        self, site: Site, frame: FrameLayout
    ) -> None:
        w, hub, head = site.base.frame[0], site.base.hub, frame.of(BearingHead)
        for item in frame.purchased:
            if item.name in ("bearing_front", "bearing_rear", "shaft", "collar", "wheel"):
                for body in (*item.added, *item.removed):
                    assert isinstance(body, Cylinder)
                    out = norm(np.cross(body.start, w))
                    # All about the axis, but for the wheel's screws on their circle.
                    assert out < 1e-9 or (item.name == "wheel" and out == pytest.approx(14.0))
                    assert abs(body.axis @ w) == pytest.approx(1, abs=1e-12)
        front, rear = (
            item.added[0].start @ w
            for item in frame.purchased
            if item.name.startswith("bearing") and isinstance(item.added[0], Cylinder)
        )
        assert hub.face > front > rear
        assert head.shaft is not None
        # From the gauge's socket the shaft reaches through the collar behind the rear bearing.
        end = hub.socket - head.shaft["length_mm"]
        assert hub.back <= hub.socket < hub.front
        assert end <= head.rear - PARTS["COLLAR-8"]["width_mm"]

    def test_all_static_parts_are_clear(self, frame: FrameLayout) -> None:
        still = {item.name for item in (*frame.printed, *frame.purchased) if not item.rotates}
        assert set(frame.swept) == still
        assert set(frame.light) == still - {"camera", "stage_post"}
        assert min(frame.swept.values()) >= SMALL.prototype.frame.clearance_mm
        lamps = {name for name in frame.light if name.startswith("lamp_")}
        assert min(frame.light[name] for name in lamps) >= SMALL.prototype.frame.clearance_mm
        assert min(frame.light[name] for name in frame.light.keys() - lamps) >= 20

    def test_uprights_and_plate_are_what_is_sold(self, frame: FrameLayout) -> None:
        stock, floor = frame.of(Stock), SMALL.prototype.frame.floor_mm
        bars = [item for item in frame.purchased if item.name in UPRIGHTS]
        assert len(bars) == 2
        corners = [item for item in frame.purchased if item.part == CORNER]
        assert {item.name.rpartition("_bracket_")[0] for item in corners} >= set(UPRIGHTS)
        for one in corners:
            points = enclosing_triangles(one.added[0]).reshape(-1, 3)
            assert points[:, 2].min() == pytest.approx(floor)
            assert np.ptp(points[:, 2]) == pytest.approx(PARTS[CORNER]["leg_mm"])
        assert stock.upright["length_mm"] >= stock.length
        assert stock.length == pytest.approx(frame.of(BearingHead).top - floor)
        assert (np.array(stock.plate.sizes[:2]) > np.ptp(stock.holes, axis=0)).all()
        away = norm(stock.holes[:, None] - stock.holes)
        assert away[~np.eye(len(away), dtype=bool)].min() > 15

    def test_a_motor_on_the_axis(self, site: Site) -> None:
        around = driven(site, "nema17-direct", 1)
        keep_out = keep_out_volume(site.layout, around.base, CAPTURE_RADIUS, 0.0)
        stage = stage_layout(SMALL.prototype, site.layout, keep_out, PARTS)
        found = frame_layout(replace(around, keep_out=keep_out, stage=stage))
        assert not any(item.name.startswith("bearing") for item in found.purchased)
        (motor,) = (item for item in found.purchased if item.name == "motor")
        pilot = motor.added[1]
        assert isinstance(pilot, Cylinder)
        assert norm(np.cross(pilot.start, around.base.frame[0])) < 1e-9
        assert not {"608-2Z", "COLLAR-8"} & {name for one in found.mounted for name in one.listed}

    @pytest.mark.parametrize("name", ["nema17-belt", "nema17-direct", "stage-60"])
    def test_what_rotates_is_bolted_to_what_rotates(self, site: Site, name: str) -> None:
        around = driven(site, name)
        head = head_of(around)
        turning = {item.name for item in head.purchased if item.rotates}
        turning |= {"carrier", "zero_disc"}
        some = [*base_fasteners(around.base, UNCUT, around.drive, PARTS), *head.fasteners]
        assert {one.rotates for one in some} == {True, False}
        for one in some:
            assert {body in turning for body in one.through} == {one.rotates}, one.through

    def test_the_top_of_a_stage_keeps_from_its_body(self, site: Site) -> None:
        around = driven(site, "stage-60")
        bodies, base = {one.name: one.added[0] for one in head_of(around).purchased}, around.base
        body, top = bodies["rotary_stage"], bodies["rotary_stage_top"]
        assert isinstance(body, Cylinder)
        assert isinstance(top, Cylinder)
        w = base.frame[0]
        assert top.start @ w == pytest.approx(base.hub.mount)
        bottom = float(top.start @ w - top.length)
        assert bottom > body.start @ w
        screws = [
            one
            for one in base_fasteners(base, UNCUT, around.drive, PARTS)
            if one.through[-1] == "rotary_stage_top"
        ]
        assert len(screws) == 4
        assert all(one.place @ w - one.part["length_mm"] > bottom for one in screws)

    def test_the_shaft_is_as_long_as_the_motor_has_it_with_the_belt_tight(self, site: Site) -> None:
        """24 mm from the face (OpenSCAD library NopSCADlib, stepper_motors.scad: NEMA17)."""
        w = site.base.frame[0]
        for one in (each for each in DRIVES if each.belt):
            motor, pinion = motor_and_pinion(head_of(replace(site, drive=one)))
            assert norm(np.cross(pinion.start, w)) == pytest.approx(one.centre_mm)
            shaft = motor.added[2]
            assert isinstance(shaft, Cylinder)
            assert shaft.length == pytest.approx(24)
            tip, front = float(shaft.start @ w) + shaft.length, float(pinion.start @ w)
            inside = min(tip, front) - (front - pinion.length)
            assert inside > pinion.length / 2  # or set screws alone would carry the belt's pull

    def test_no_camera_no_bracket(self, site: Site) -> None:
        found = frame_layout(changed(site, {"camera_diameter_mm": 0.0}))
        names = {item.name for item in (*found.printed, *found.purchased)}
        assert not {"camera", "camera_bracket", "camera_plate", "camera_fence"} & names
        assert found.find(CameraMount) is None
        assert "UNC1/4-20x12.7" not in {one.part.name for one in found.fasteners}


BELT = replace(drive("nema17-belt"), belt=PARTS["GT2-200-6"])


@pytest.mark.parametrize(
    ("keys", "own", "one", "message"),
    [
        ({"clearance_mm": 20.0}, {}, {}, "prototype.largest_ball_mm smaller"),
        ({}, {"camera_length_mm": 130.0}, {}, "prototype.frame.floor_mm less than"),
        ({"camera_screw_mm": 12.0}, {}, {}, "too near to the pinhole"),
        ({"camera_screw_mm": 101.0}, {}, {}, "beyond the camera's end"),
        ({"floor_mm": -2000.0}, {}, {}, "no part with length_mm"),
        ({"flange_mm": 30.0}, {}, {}, "make prototype.frame.flange_mm smaller"),
        ({"belt_travel_mm": 40.0}, {}, {"drive": BELT}, "would meet the bearings"),
    ],
)
def test_what_does_not_fit(
    site: Site, keys: dict[str, Any], own: dict[str, Any], one: dict[str, Any], message: str
) -> None:
    with pytest.raises(SpecError, match=re.escape(message)):
        frame_layout(changed(replace(site, **one), own, **keys))


def test_a_camera_aside_and_a_bore_that_no_bearing_has(site: Site) -> None:
    array = site.layout.array
    aside = replace(array.camera, forward=np.array([0.0, 0.6, 0.8]))
    turned = replace(site.layout, array=replace(array, camera=aside))
    with pytest.raises(SpecError, match=re.escape("second number of optics.camera_mm")):
        frame_layout(replace(site, layout=turned))
    with pytest.raises(SpecError, match="set it to 8"):
        choose_part(PARTS, "bearings", "key", "set it to 8", "width_mm", bore_mm=9.0)
