"""The frame in numbers: where its bodies are, what is bought, and what is refused."""

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tbcad.geometry.primitives import Cylinder
from tbcad.geometry.vectors import norm
from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.balls.layout import prototype_layout
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.frame.brackets import fitting, rig_axes
from tbcad.prototype.frame.layout import FrameLayout, bought_parts, frame
from tbcad.prototype.keepout import Room, room
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout, stage
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec
from tbcad.spec.prototype import FrameSpec, StageSpec

PARTS = load_parts()
DRIVES = load_drives(PARTS)
SPEC = load_spec(None, ["n=6", "prototype.k=4"])
# A ball of the small design stands so near to the hub that a motor's pinion is 2 mm off.
KEYS = FrameSpec(clearance_mm=1.5)
CAPTURE = 30.0


def drive(name: str, number: int = 0) -> Drive:
    return [one for one in DRIVES if one.name == name][number]


class Rig:
    """A prototype with its base, the room it leaves and a stage."""

    def __init__(self, spec: Spec, design: MirrorDesign, name: str = "nema17-belt") -> None:
        self.own = spec.prototype
        self.made = prototype_layout(spec, design)
        keys = spec.prototype.base.model_copy(update={"drive": name})
        self.base: BaseLayout = base_layout(keys, self.made)
        self.space: Room = room(self.made, self.base, CAPTURE, 0.0)
        self.stage: StageLayout = self.staged(KEYS)

    def staged(self, keys: FrameSpec) -> StageLayout:
        return stage((StageSpec(), keys, self.own), self.made, self.space, PARTS)

    def frame(
        self, one: Drive, own: dict[str, object] | None = None, **changed: object
    ) -> FrameLayout:
        keys = KEYS.model_copy(update=changed)
        held = self.own.model_copy(update=own or {})
        return frame((keys, held), self.made, self.base, self.stage, one, self.space, PARTS)


@pytest.fixture(scope="module")
def rig(small_design: MirrorDesign) -> Rig:
    return Rig(SPEC, small_design)


@pytest.fixture(scope="module")
def numbers(rig: Rig) -> FrameLayout:
    return rig.frame(drive("nema17-belt"))


def refusal(rig: Rig, one: Drive, own: dict[str, object] | None = None, **changed: Any) -> str:
    with pytest.raises(SpecError) as caught:
        rig.frame(one, own, **changed)
    return str(caught.value)


class TestFrame:
    def test_axes_are_level_across_and_up(self, rig: Rig, numbers: FrameLayout) -> None:
        assert numbers.axes @ numbers.axes.T == pytest.approx(np.eye(3))
        assert numbers.axes[2].tolist() == [0, 0, 1]
        assert abs(numbers.axes[1] @ rig.base.frame[0]) < 1e-12
        assert rig_axes(np.array([0.6, 0.48, -0.64])) @ [0, 0, 1] == pytest.approx([0, 0, 1])

    def test_bearings_and_shaft_are_on_the_axis_beyond_the_hub(
        self, rig: Rig, numbers: FrameLayout
    ) -> None:
        w, hub = rig.base.frame[0], rig.base.hub
        for item in numbers.bought:
            if item.name in ("bearing_front", "bearing_rear", "shaft", "collar", "wheel"):
                for body in (*item.added, *item.removed):
                    assert isinstance(body, Cylinder)
                    assert norm(np.cross(body.start, w)) < 1e-9
                    assert abs(body.axis @ w) == pytest.approx(1, abs=1e-12)
        assert hub.face > numbers.head.bearings[0] > numbers.head.bearings[1]
        assert numbers.head.shaft is not None
        # From the hub's front the shaft reaches through the collar behind the rear bearing.
        end = hub.front - numbers.head.shaft["length_mm"]
        assert end <= numbers.head.rear - PARTS["COLLAR-8"]["width_mm"]

    def test_the_belt_is_tight_in_the_middle_of_the_slots(
        self, rig: Rig, numbers: FrameLayout
    ) -> None:
        one = drive("nema17-belt")
        (pinion,) = (item for item in numbers.bought if item.name == "pinion")
        (body,) = pinion.added
        assert isinstance(body, Cylinder)
        assert norm(np.cross(body.start, rig.base.frame[0])) == pytest.approx(one.centre_mm)

    def test_all_that_stands_still_is_clear(self, numbers: FrameLayout) -> None:
        still = {item.name for item in (*numbers.printed, *numbers.bought) if not item.turns}
        assert set(numbers.swept) == still
        assert set(numbers.light) == still - {"camera"}
        assert min(numbers.swept.values()) >= KEYS.clearance_mm
        assert min(numbers.light.values()) >= 30

    def test_the_paper_design_is_clear_with_all_defaults(self, paper_design: MirrorDesign) -> None:
        whole = Rig(load_spec(None), paper_design)
        found = frame(
            (FrameSpec(), whole.own),
            whole.made,
            whole.base,
            whole.staged(FrameSpec()),
            drive("nema17-belt", 2),
            whole.space,
            PARTS,
        )
        assert min(found.swept.values()) > 3
        assert min(found.light.values()) > 3
        assert whole.stage.swept > 20

    def test_what_is_bought(self, rig: Rig, numbers: FrameLayout) -> None:
        found = bought_parts(numbers, rig.stage)
        assert set(found) <= set(PARTS)
        kinds = Counter({PARTS[name].kind: 0 for name in found})
        for name, count in found.items():
            kinds[PARTS[name].kind] += count
        assert kinds["bearings"] == 2
        assert kinds["shafts"] == kinds["collars"] == kinds["plates"] == 1
        assert kinds["extrusions"] == 2
        assert kinds["tnuts"] == 8
        # Every hole of the plate has a screw, every T-nut one, the motor four, clamp, camera.
        assert kinds["screws"] == len(numbers.holes) + 8 + 4 + 1 + 1

    def test_uprights_are_cut_from_what_is_sold(self, numbers: FrameLayout) -> None:
        bars = [item for item in numbers.bought if item.name.startswith("upright")]
        assert len(bars) == 2
        assert numbers.upright["length_mm"] >= numbers.length
        assert numbers.length == pytest.approx(numbers.head.top - KEYS.floor_mm)

    def test_the_plate_lies_under_all_feet(self, numbers: FrameLayout) -> None:
        reach = np.ptp(numbers.holes, axis=0)
        assert numbers.plate["length_mm"] > reach[0]
        assert numbers.plate["width_mm"] > reach[1]
        away = norm(numbers.holes[:, None] - numbers.holes)
        assert away[~np.eye(len(away), dtype=bool)].min() > 15

    @pytest.mark.parametrize("number", [0, 1, 2])
    def test_a_motor_on_the_axis(self, small_design: MirrorDesign, number: int) -> None:
        direct = Rig(SPEC, small_design, "nema17-direct")
        found = direct.frame(drive("nema17-direct", number))
        assert found.head.bearings == ()
        assert found.head.motor == 0
        assert not {"608-2Z", "COLLAR-8"} & set(bought_parts(found, direct.stage))

    def test_no_camera_no_bracket(self, rig: Rig) -> None:
        found = rig.frame(drive("nema17-belt"), {"camera_diameter_mm": 0.0})
        names = {item.name for item in (*found.printed, *found.bought)}
        assert not {"camera", "camera_bracket"} & names
        assert "UNC1/4-20x12.7" not in bought_parts(found, rig.stage)


class TestRefusals:
    def test_too_near_to_the_base(self, rig: Rig) -> None:
        words = refusal(rig, drive("nema17-belt"), clearance_mm=20.0)
        assert "mm from the balls and base as they swing" in words
        assert "prototype.largest_ball_mm smaller" in words

    def test_camera_below_the_plate(self, rig: Rig) -> None:
        words = refusal(rig, drive("nema17-belt"), {"camera_length_mm": 130.0})
        assert "below the base plate" in words
        assert "prototype.frame.floor_mm less than" in words

    @pytest.mark.parametrize(
        ("changed", "words"),
        [
            ({"camera_screw_mm": 12.0}, "too near to the pinhole"),
            ({"camera_screw_mm": 101.0}, "beyond the camera's end"),
            ({"floor_mm": -2000.0}, "no part with length_mm"),
            ({"flange_mm": 28.0}, "make prototype.frame.flange_mm smaller"),
        ],
    )
    def test_sizes_that_do_not_fit(self, rig: Rig, changed: dict[str, Any], words: str) -> None:
        assert words in refusal(rig, drive("nema17-belt"), **changed)

    def test_a_belt_too_short_for_the_bearings(self, rig: Rig) -> None:
        short = replace(drive("nema17-belt"), belt=PARTS["GT2-200-6"])
        assert "would meet the bearings" in refusal(rig, short, belt_travel_mm=40.0)

    def test_a_camera_that_looks_aside(self, rig: Rig) -> None:
        half = rig.made.half
        view = replace(half.camera, forward=np.array([0.0, 0.6, 0.8]))
        made = replace(rig.made, half=replace(half, camera=view))
        with pytest.raises(SpecError, match=r"second number of optics\.camera_mm"):
            frame(
                (KEYS, rig.own),
                made,
                rig.base,
                rig.stage,
                drive("nema17-belt"),
                rig.space,
                PARTS,
            )

    def test_a_shaft_that_no_bearing_takes(self) -> None:
        with pytest.raises(SpecError, match="set it to 8"):
            fitting(PARTS, "bearings", "key", "set it to 8", "width_mm", bore_mm=9.0)


def test_the_same_frame_twice(rig: Rig, numbers: FrameLayout) -> None:
    assert repr(rig.frame(drive("nema17-belt"))) == repr(numbers)
