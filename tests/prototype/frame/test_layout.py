"""The frame in frame: where its bodies are, what is bought, and what is refused."""

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from tbcad.geometry.primitives import Cylinder
from tbcad.geometry.vectors import norm
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.frame.brackets import choose_part, frame_axes
from tbcad.prototype.frame.layout import FrameLayout, frame_layout, frame_purchased_parts
from tbcad.prototype.keepout import KeepOut, keep_out_volume
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout, stage_layout
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec
from tbcad.spec.prototype import PrototypeSpec
from tests.prototype.conftest import SMALL

PARTS = load_parts()
DRIVES = load_drives(PARTS)
CAPTURE = 30.0


def drive(name: str, number: int = 0) -> Drive:
    return [one for one in DRIVES if one.name == name][number]


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
                    assert norm(np.cross(body.start, w)) < 1e-9
                    assert abs(body.axis @ w) == pytest.approx(1, abs=1e-12)
        front, rear = (
            item.added[0].start @ w
            for item in frame.purchased
            if item.name.startswith("bearing") and isinstance(item.added[0], Cylinder)
        )
        assert hub.face > front > rear
        assert frame.head.shaft is not None
        # From the hub's front the shaft reaches through the collar behind the rear bearing.
        end = hub.front - frame.head.shaft["length_mm"]
        assert end <= frame.head.rear - PARTS["COLLAR-8"]["width_mm"]

    def test_the_belt_is_tight_in_the_middle_of_the_slots(
        self, around: Surroundings, frame: FrameLayout
    ) -> None:
        one = drive("nema17-belt")
        (pinion,) = (item for item in frame.purchased if item.name == "pinion")
        (body,) = pinion.added
        assert isinstance(body, Cylinder)
        assert norm(np.cross(body.start, around.base.frame[0])) == pytest.approx(one.centre_mm)

    def test_all_static_parts_are_clear(self, frame: FrameLayout) -> None:
        still = {item.name for item in (*frame.printed, *frame.purchased) if not item.rotates}
        assert set(frame.swept) == still
        assert set(frame.light) == still - {"camera"}
        assert min(frame.swept.values()) >= SMALL.prototype.frame.clearance_mm
        assert min(frame.light.values()) >= 30

    def test_the_paper_design_is_clear_with_all_defaults(
        self, paper_prototype: PrototypeLayout
    ) -> None:
        whole = Surroundings.of(load_spec(None).prototype, paper_prototype, "nema17-belt")
        found = whole.frame(drive("nema17-belt", 2))
        assert min(found.swept.values()) > 3
        assert min(found.light.values()) > 3
        assert whole.stage.swept > 20

    def test_what_is_bought(self, around: Surroundings, frame: FrameLayout) -> None:
        found = frame_purchased_parts(frame)
        assert set(found) <= set(PARTS)
        kinds = Counter({PARTS[name].kind: 0 for name in found})
        for name, count in found.items():
            kinds[PARTS[name].kind] += count
        assert kinds["bearings"] == 2
        assert kinds["shafts"] == 2  # the base's, and the rod of angle zero
        assert kinds["collars"] == kinds["plates"] == 1
        assert kinds["extrusions"] == 2
        assert kinds["tnuts"] == 8
        # Every hole of the plate has a screw, every T-nut one, motor and hub four each, clamp,
        # camera, bracket and switch two each.
        assert kinds["screws"] == len(frame.holes) + 8 + 4 + 4 + 1 + 1 + 2 + 2

    def test_uprights_are_cut_from_what_is_sold(self, frame: FrameLayout) -> None:
        bars = [item for item in frame.purchased if item.name.startswith("upright")]
        assert len(bars) == 2
        assert frame.upright["length_mm"] >= frame.length
        assert frame.length == pytest.approx(frame.head.top - SMALL.prototype.frame.floor_mm)

    def test_the_plate_lies_under_all_feet(self, frame: FrameLayout) -> None:
        reach = np.ptp(frame.holes, axis=0)
        assert frame.plate["length_mm"] > reach[0]
        assert frame.plate["width_mm"] > reach[1]
        away = norm(frame.holes[:, None] - frame.holes)
        assert away[~np.eye(len(away), dtype=bool)].min() > 15

    @pytest.mark.parametrize("number", [0, 1, 2])
    def test_a_motor_on_the_axis(self, small_prototype: PrototypeLayout, number: int) -> None:
        direct = Surroundings.of(SMALL.prototype, small_prototype, "nema17-direct")
        found = direct.frame(drive("nema17-direct", number))
        assert not any(item.name.startswith("bearing") for item in found.purchased)
        (motor,) = (item for item in found.purchased if item.name == "motor")
        pilot = motor.added[1]
        assert isinstance(pilot, Cylinder)
        assert norm(np.cross(pilot.start, direct.base.frame[0])) < 1e-9
        assert not {"608-2Z", "COLLAR-8"} & set(frame_purchased_parts(found))

    def test_no_camera_no_bracket(self, around: Surroundings) -> None:
        found = around.frame(drive("nema17-belt"), {"camera_diameter_mm": 0.0})
        names = {item.name for item in (*found.printed, *found.purchased)}
        assert not {"camera", "camera_bracket"} & names
        assert "UNC1/4-20x12.7" not in frame_purchased_parts(found)


class TestRefusals:
    def test_too_near_to_the_base(self, around: Surroundings) -> None:
        message = refusal(around, drive("nema17-belt"), clearance_mm=20.0)
        assert "mm from the balls and base as they swing" in message
        assert "prototype.largest_ball_mm smaller" in message

    def test_camera_below_the_plate(self, around: Surroundings) -> None:
        message = refusal(around, drive("nema17-belt"), {"camera_length_mm": 130.0})
        assert "below the base plate" in message
        assert "prototype.frame.floor_mm less than" in message

    @pytest.mark.parametrize(
        ("changed", "message"),
        [
            ({"camera_screw_mm": 12.0}, "too near to the pinhole"),
            ({"camera_screw_mm": 101.0}, "beyond the camera's end"),
            ({"floor_mm": -2000.0}, "no part with length_mm"),
            ({"flange_mm": 28.0}, "make prototype.frame.flange_mm smaller"),
        ],
    )
    def test_sizes_that_do_not_fit(
        self, around: Surroundings, changed: dict[str, Any], message: str
    ) -> None:
        assert message in refusal(around, drive("nema17-belt"), **changed)

    def test_a_belt_too_short_for_the_bearings(self, around: Surroundings) -> None:
        short = replace(drive("nema17-belt"), belt=PARTS["GT2-200-6"])
        assert "would meet the bearings" in refusal(around, short, belt_travel_mm=40.0)

    def test_a_camera_that_looks_aside(self, around: Surroundings) -> None:
        array = around.prototype.array
        aside = replace(array.camera, forward=np.array([0.0, 0.6, 0.8]))
        turned = replace(
            around, prototype=replace(around.prototype, array=replace(array, camera=aside))
        )
        assert "second number of optics.camera_mm" in refusal(turned, drive("nema17-belt"))

    def test_a_shaft_that_no_bearing_takes(self) -> None:
        with pytest.raises(SpecError, match="set it to 8"):
            choose_part(PARTS, "bearings", "key", "set it to 8", "width_mm", bore_mm=9.0)
