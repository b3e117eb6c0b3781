"""The frame in frame: where its bodies are, what is bought, and what is refused."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from tbcad.prototype.frame.purchased import frame_axes

from tbcad.core.geometry.primitives import Component, Cylinder
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.fasteners import base_fasteners
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.split import UNCUT
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.frame.head import BearingHead, bearing_head
from tbcad.prototype.frame.layout import FrameLayout, frame_layout, frame_purchased_parts
from tbcad.prototype.keepout import KeepOut, keep_out_volume
from tbcad.prototype.purchased.parts import choose_part, load_parts
from tbcad.prototype.stage.layout import StageLayout, stage_layout
from tests.prototype.conftest import SMALL

PARTS = load_parts()
DRIVES = load_drives(PARTS)
CAPTURE = 30.0


def drive(name: str, number: int = 0) -> Drive:
    return [one for one in DRIVES if one.name == name][number]


def motor_and_pinion(head: BearingHead) -> tuple[Component, Cylinder]:
    """The motor, and the pinion's toothed part."""
    bodies = {item.name: item for item in head.purchased}
    pinion = bodies["pinion"].added[0]
    assert isinstance(pinion, Cylinder)
    return bodies["motor"], pinion


@dataclass
class Surroundings:
    """All that a frame is built round."""

    spec: PrototypeSpec
    prototype: PrototypeLayout
    base: BaseLayout
    keep_out: KeepOut
    stage: StageLayout

    @classmethod
    def of(
        cls, section: PrototypeSpec, prototype: PrototypeLayout, drive_name: str
    ) -> "Surroundings":
        """With the base's hub for a drive."""
        base = base_layout(section.base.model_copy(update={"drive": drive_name}), prototype)
        keep_out = keep_out_volume(prototype, base, CAPTURE, 0.0)
        stage = stage_layout(section, prototype, keep_out, PARTS)
        return cls(section, prototype, base, keep_out, stage)

    def frame(
        self, one: Drive, own: dict[str, object] | None = None, **changed: object
    ) -> FrameLayout:
        section = self.spec.frame.model_copy(update=changed)
        spec = self.spec.model_copy(update={**(own or {}), "frame": section})
        return frame_layout(spec, self.prototype, self.base, self.stage, one, self.keep_out, PARTS)


@pytest.fixture(scope="module")
def around(
    spec: PrototypeSpec,
    small_prototype: PrototypeLayout,
    carrier: BaseLayout,
    keep_out: KeepOut,
    stage: StageLayout,
) -> Surroundings:
    return Surroundings(spec, small_prototype, carrier, keep_out, stage)


def driven(prototype: PrototypeLayout, name: str) -> tuple[BaseLayout, BearingHead]:
    """The base and the head for a drive, wherever else there is room."""
    base = base_layout(SMALL.prototype.base.model_copy(update={"drive": name}), prototype)
    axes = frame_axes(base.frame[0])
    return base, bearing_head(SMALL.prototype.frame, base, drive(name), axes, PARTS)


def refusal(
    around: Surroundings, one: Drive, own: dict[str, object] | None = None, **changed: Any
) -> str:
    with pytest.raises(SpecError) as caught:
        around.frame(one, own, **changed)
    return str(caught.value)


class TestFrame:
    def test_axes_are_level_across_and_up(self, around: Surroundings, frame: FrameLayout) -> None:
        assert frame.axes @ frame.axes.T == pytest.approx(np.eye(3))
        assert frame.axes[2].tolist() == [0, 0, 1]
        assert abs(frame.axes[1] @ around.base.frame[0]) < 1e-12
        assert frame_axes(np.array([0.6, 0.48, -0.64])) @ [0, 0, 1] == pytest.approx([0, 0, 1])

    def test_bearings_and_shaft_are_on_the_axis_beyond_the_hub(
        self, around: Surroundings, frame: FrameLayout
    ) -> None:
        w, hub = around.base.frame[0], around.base.hub
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
        assert frame.head.shaft is not None
        # From the gauge's socket the shaft reaches through the collar behind the rear bearing.
        end = hub.socket - frame.head.shaft["length_mm"]
        assert hub.back <= hub.socket < hub.front
        assert end <= frame.head.rear - PARTS["COLLAR-8"]["width_mm"]

    def test_all_static_parts_are_clear(self, frame: FrameLayout) -> None:
        still = {item.name for item in (*frame.printed, *frame.purchased) if not item.rotates}
        assert set(frame.swept) == still
        assert set(frame.light) == still - {"camera"}
        assert min(frame.swept.values()) >= SMALL.prototype.frame.clearance_mm
        lamps = {name for name in frame.light if name.startswith("lamp_")}
        assert min(frame.light[name] for name in lamps) >= SMALL.prototype.frame.clearance_mm
        assert min(frame.light[name] for name in frame.light.keys() - lamps) >= 20

    def test_uprights_and_plate_are_what_is_sold(self, frame: FrameLayout) -> None:
        bars = [item for item in frame.purchased if item.name.startswith("upright")]
        assert len(bars) == 2
        assert frame.upright["length_mm"] >= frame.length
        assert frame.length == pytest.approx(frame.head.top - SMALL.prototype.frame.floor_mm)
        assert (np.array(frame.plate.sizes[:2]) > np.ptp(frame.holes, axis=0)).all()
        away = norm(frame.holes[:, None] - frame.holes)
        assert away[~np.eye(len(away), dtype=bool)].min() > 15

    def test_a_motor_on_the_axis(self, small_prototype: PrototypeLayout) -> None:
        direct = Surroundings.of(SMALL.prototype, small_prototype, "nema17-direct")
        found = direct.frame(drive("nema17-direct", 1))
        assert not any(item.name.startswith("bearing") for item in found.purchased)
        (motor,) = (item for item in found.purchased if item.name == "motor")
        pilot = motor.added[1]
        assert isinstance(pilot, Cylinder)
        assert norm(np.cross(pilot.start, direct.base.frame[0])) < 1e-9
        assert not {"608-2Z", "COLLAR-8"} & set(frame_purchased_parts(found))

    @pytest.mark.parametrize("name", ["nema17-belt", "nema17-direct", "stage-60"])
    def test_what_rotates_is_bolted_to_what_rotates(
        self, small_prototype: PrototypeLayout, name: str
    ) -> None:
        base, head = driven(small_prototype, name)
        turning = {item.name for item in head.purchased if item.rotates}
        turning |= {"carrier", "zero_disc"}
        some = [*base_fasteners(base, UNCUT, drive(name), PARTS), *head.fasteners]
        assert {one.rotates for one in some} == {True, False}
        for one in some:
            assert {body in turning for body in one.through} == {one.rotates}, one.through

    def test_the_top_of_a_stage_keeps_from_its_body(self, small_prototype: PrototypeLayout) -> None:
        base, head = driven(small_prototype, "stage-60")
        bodies = {item.name: item.added[0] for item in head.purchased}
        body, top = bodies["rotary_stage"], bodies["rotary_stage_top"]
        assert isinstance(body, Cylinder)
        assert isinstance(top, Cylinder)
        w = base.frame[0]
        assert top.start @ w == pytest.approx(base.hub.mount)
        bottom = float(top.start @ w - top.length)
        assert bottom > body.start @ w
        screws = [
            one
            for one in base_fasteners(base, UNCUT, drive("stage-60"), PARTS)
            if one.through[-1] == "rotary_stage_top"
        ]
        assert len(screws) == 4
        assert all(one.place @ w - one.part["length_mm"] > bottom for one in screws)

    def test_the_shaft_is_as_long_as_the_motor_has_it_with_the_belt_tight(
        self, small_prototype: PrototypeLayout
    ) -> None:
        """24 mm from the face (OpenSCAD library NopSCADlib, stepper_motors.scad: NEMA17)."""
        base = driven(small_prototype, "nema17-belt")[0]
        axes, w = frame_axes(base.frame[0]), base.frame[0]
        for one in (each for each in DRIVES if each.belt):
            head = bearing_head(SMALL.prototype.frame, base, one, axes, PARTS)
            motor, pinion = motor_and_pinion(head)
            assert norm(np.cross(pinion.start, w)) == pytest.approx(one.centre_mm)
            shaft = motor.added[2]
            assert isinstance(shaft, Cylinder)
            assert shaft.length == pytest.approx(24)
            tip, front = float(shaft.start @ w) + shaft.length, float(pinion.start @ w)
            inside = min(tip, front) - (front - pinion.length)
            assert inside > pinion.length / 2  # or set screws alone would carry the belt's pull

    def test_no_camera_no_bracket(self, around: Surroundings) -> None:
        found = around.frame(drive("nema17-belt"), {"camera_diameter_mm": 0.0})
        names = {item.name for item in (*found.printed, *found.purchased)}
        assert not {"camera", "camera_bracket", "camera_plate", "camera_fence"} & names
        assert found.mount is None
        assert "UNC1/4-20x12.7" not in {one.part.name for one in found.fasteners}


class TestRefusals:
    def test_what_does_not_fit(self, around: Surroundings) -> None:
        belt = drive("nema17-belt")
        cases: tuple[tuple[dict[str, Any], str], ...] = (
            ({"clearance_mm": 20.0}, "prototype.largest_ball_mm smaller"),
            ({"own": {"camera_length_mm": 130.0}}, "prototype.frame.floor_mm less than"),
            ({"camera_screw_mm": 12.0}, "too near to the pinhole"),
            ({"camera_screw_mm": 101.0}, "beyond the camera's end"),
            ({"floor_mm": -2000.0}, "no part with length_mm"),
            ({"flange_mm": 30.0}, "make prototype.frame.flange_mm smaller"),
            (
                {"one": replace(belt, belt=PARTS["GT2-200-6"]), "belt_travel_mm": 40.0},
                "would meet the bearings",
            ),
        )
        for changed, message in cases:
            assert message in refusal(around, **{"one": belt, **changed})
        array = around.prototype.array
        aside = replace(array.camera, forward=np.array([0.0, 0.6, 0.8]))
        turned = replace(
            around, prototype=replace(around.prototype, array=replace(array, camera=aside))
        )
        assert "second number of optics.camera_mm" in refusal(turned, belt)
        with pytest.raises(SpecError, match="set it to 8"):
            choose_part(PARTS, "bearings", "key", "set it to 8", "width_mm", bore_mm=9.0)
