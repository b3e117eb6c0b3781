"""The program of random motions, run by the verification's controller."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from tbcad_verify.prototype.control.gcode_machine import run_program

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.drive.balance import free_base_angles, home_angles, stop_sequence
from tbcad.prototype.drive.drive import BaseTorques, Drive, choose_drive, load_drives
from tbcad.prototype.electronics import phases
from tbcad.prototype.files.controllers import DECIMALS, duration_minutes, gcode_program
from tbcad.prototype.purchased.parts import load_parts

LEDS, TRUNCATED = 4, 10.0**-DECIMALS
MOTIONS = st.builds(
    MotionSpec,
    controller=st.sampled_from(["grblhal", "grbl"]),
    trigger=st.sampled_from(["coolant", "pause"]),
    axis=st.sampled_from("XA"),
    home_deg=st.integers(-30, 30),
    home_trim_deg=st.sampled_from([0.0, 0.25, -1.0]),
    approach_deg=st.integers(0, 30),
    feed_deg_min=st.sampled_from([40.0, 900.0]),
    settle_s=st.sampled_from([0.0, 0.5]),
    light_s=st.sampled_from([0.0, 0.1]),
    exposure_s=st.sampled_from([0.0, 1.0]),
    trigger_s=st.sampled_from([0.2, 1.5]),
)


@pytest.fixture(scope="module")
def layout(small_design: MirrorDesign) -> PrototypeLayout:
    return prototype_layout(load_spec(None, ["n=6", "prototype.k=5"]), small_design)


@pytest.fixture(scope="module")
def drive() -> Drive:
    return choose_drive("nema17-belt", BaseTorques(450.0, 500.0, 1000.0), load_drives(load_parts()))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@example(motion=MotionSpec())
@given(motion=MOTIONS)
def test_what_a_controller_does(layout: PrototypeLayout, drive: Drive, motion: MotionSpec) -> None:
    """Each stop twice, from below, at rest, dark, by each LED alone and lit; and back."""
    try:
        homing, sequence = home_angles(layout, motion), stop_sequence(layout, motion)
    except SpecError as error:
        assert "no room for a switch" in str(error)  # noqa: PT017
        return
    homed, lit = homing.homed + motion.home_trim_deg, phases(LEDS, motion)
    lines = gcode_program(layout, drive, motion, LEDS)
    did = run_program("\n".join(lines) + "\n", homing.switch, homed)
    assert not did.faults
    for line, following in pairwise(lines):  # outputs are switched when they are read
        if line.startswith("G1 ") and len(lit) > 1:
            assert following.startswith(("G4 P", "(stop", "M0", "G92.1"))
            assert following != "G4 P0.000"
    homes = motion.controller == "grblhal"
    assert (did.homes, did.pauses) == (int(homes), ["pin" if homes else "base", "turn"])
    outputs = [set(), {1}, {2}, {3}, {4}, {0}] if homes else [set()]
    stops, count = 2 * len(sequence.angle), len(lit)
    assert [set(one.lights) for one in did.photographs] == stops * outputs
    assert did.angles == pytest.approx(np.tile(sequence.angle, 2).repeat(count), abs=TRUNCATED)
    assert [one.turned for one in did.photographs] == [0] * (stops * count // 2) + [1] * (
        stops * count // 2
    )
    told = [one.stop for one in did.photographs[: stops * count // 2 : count]]
    assert told == list(range(1, len(sequence.mirrors) + 1))
    for one in did.photographs:
        assert one.rising or not motion.approach_deg
        assert one.settled >= motion.settle_s - 1e-9
        assert one.lit >= motion.light_s - 1e-9 or not homes
        wanted = motion.trigger_s if motion.trigger == "coolant" else np.inf
        assert one.released == pytest.approx(wanted)
    low, high = np.degrees(free_base_angles(layout))
    assert low <= min(did.driven) <= max(did.driven) <= max(high, motion.home_deg)
    assert did.angle == pytest.approx(motion.home_deg, abs=TRUNCATED)
    assert did.axis == motion.axis
    assert set(did.feeds) == {motion.feed_deg_min}
    setting = 100 if motion.axis == "X" else 103
    assert f"(${setting}={drive.steps_per_deg(16):.6g}: steps a degree)" in lines
    travel = 4 * (sequence.angle[-1] - sequence.start) / motion.feed_deg_min
    minutes = did.now / 60 + travel  # the machine's clock stands still in motions
    assert duration_minutes(sequence, motion, lit) == pytest.approx(minutes, abs=1e-3)


def test_more_leds_than_outputs(layout: PrototypeLayout, drive: Drive) -> None:
    with pytest.raises(SpecError, match="use at most 7 LEDs"):
        gcode_program(layout, drive, MotionSpec(), 8)


def test_the_approach_ends_where_something_stands(
    small_design: MirrorDesign, layout: PrototypeLayout
) -> None:
    spec = load_spec(None, ["n=6", "prototype.k=5", "prototype.max_swing_deg=180"])
    tight = prototype_layout(spec, small_design)
    start = stop_sequence(tight, MotionSpec(approach_deg=20)).start
    assert start == pytest.approx(np.degrees(free_base_angles(tight)[0]))
    assert start == pytest.approx(-90)
    with pytest.raises(SpecError, match=r"home_deg is 170, but the base is free from -.* to "):
        stop_sequence(layout, MotionSpec(home_deg=170))
