"""The program is read back by a small GRBL: its words, its groups, its limits."""

import re
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.drive.loads import BaseTorques, choose_drive
from tbcad.prototype.drive.travel import free_base_angles, home_angles, stop_sequence
from tbcad.prototype.electronics.outputs import phases
from tbcad.prototype.files.gcode import (
    DECIMALS,
    duration_minutes,
    gcode_program,
    write_program,
)
from tbcad.prototype.purchased.parts import load_parts
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec
from tbcad.spec.prototype import MotionSpec

MOTION = MotionSpec()
LEDS = 4
PHASES = phases(LEDS, MOTION)
# What GRBL 1.1h takes, by modal group (grbl/gcode.c); only these are used here.
GROUPS = {
    **{"G0": 1, "G1": 1, "G4": 0, "G92": 0, "G92.1": 0, "G90": 3, "G91": 3, "G94": 5},
    **{"G21": 6, "G54": 12, "M0": 104, "M2": 104, "M8": 108, "M9": 108},
    **{"M64": 110, "M65": 110},  # grblHAL
}


@dataclass
class Grbl:
    """What the controller did.

    Attributes:
        axis: letter of its rotary axis.
        at: where it is, degrees.
        feed: degrees a minute.
        relay: whether it is closed.
        ended: after M2.
        homed: after $H.
        rest: seconds of dwell.
        moves: every place it was sent to.
        lights: outputs that are on.
        shots: place each time the relay closed.
        lit: outputs that were on then.
        pauses: place and comment of each M0.
    """

    axis: str = "X"
    at: float | None = None
    feed: float = 0.0
    relay: bool = False
    ended: bool = False
    homed: bool = False
    rest: float = 0.0
    lights: set[float] = field(default_factory=set)
    lit: list[set[float]] = field(default_factory=list)
    moves: list[float] = field(default_factory=list)
    shots: list[float] = field(default_factory=list)
    pauses: list[tuple[float | None, str]] = field(default_factory=list)

    def send(self, line: str) -> None:
        assert not self.ended
        assert len(line) < 80
        assert line.isascii()
        assert line.isprintable()
        assert line.count("(") == line.count(")") <= 1
        comment = "".join(re.findall(r"\((.*)\)", line))
        words = re.findall(r"([A-Z])(-?\d+\.?\d*)", re.sub(r"\(.*\)|\s", "", line))
        if line == "$H":
            self.homed = True
            return
        assert "".join(a + b for a, b in words) == re.sub(r"\(.*\)|\s", "", line)
        self._block([a + b for a, b in words], {a: float(b) for a, b in words}, comment)

    def _block(self, words: list[str], value: dict[str, float], comment: str) -> None:
        commands = [word for word in words if word[0] in "GM"]
        groups = [GROUPS[word] for word in commands]
        assert len(set(groups)) == len(groups), "two of a modal group"
        rest = set(value) - {"G", "M"}
        if "G4" in commands:
            assert rest == {"P"}
            self.rest += value["P"]
        elif "G92" in commands:
            assert rest == {self.axis}
            self.at = value[self.axis]
        elif "G1" in commands:
            assert rest <= {self.axis, "F"}
            self.feed = value.get("F", self.feed)
            assert self.feed > 0
            assert self.at is not None, "moves before it knows where it is"
            assert not self.relay, "moves while the camera is released"
            assert not self.lights, "moves while a light is on"
            self.at = value[self.axis]
            self.moves.append(self.at)
        elif {"M64", "M65"} & set(commands):
            assert rest == {"P"}
            (self.lights.add if "M64" in commands else self.lights.discard)(value["P"])
        else:
            assert not rest
        if "M8" in commands:
            assert not self.relay
            assert self.at is not None
            self.shots.append(self.at)
            self.lit.append(set(self.lights))
            self.relay = True
        if "M9" in commands:
            self.relay = False
        if "M0" in commands:
            self.pauses.append((self.at, comment))
        self.ended = "M2" in commands


def sent(lines: list[str], axis: str = "X") -> Grbl:
    controller = Grbl(axis)
    for line in lines:
        controller.send(line)
    assert controller.ended
    return controller


@pytest.fixture(scope="module")
def layout(small_design: MirrorDesign) -> PrototypeLayout:
    return prototype_layout(load_spec(None, ["n=6", "prototype.k=5"]), small_design)


@pytest.fixture(scope="module")
def drive() -> Drive:
    return choose_drive("nema17-belt", BaseTorques(450.0, 500.0, 1000.0), load_drives(load_parts()))


@pytest.fixture(scope="module")
def program(layout: PrototypeLayout, drive: Drive) -> list[str]:
    return gcode_program(layout, drive, MOTION, LEDS)


@pytest.fixture(scope="module")
def controller(program: list[str]) -> Grbl:
    """After the default program."""
    return sent(program)


def test_every_stop_twice_in_order_within_a_step(
    layout: PrototypeLayout, drive: Drive, controller: Grbl
) -> None:
    angle = np.degrees(layout.stops.angle)
    step = 1 / drive.steps_per_deg(MOTION.microsteps)
    off = np.abs(np.array(controller.shots) - np.repeat(np.tile(angle, 2), len(PHASES)))
    assert off.max() < 10**-DECIMALS < step / 10


def test_every_stop_is_photographed_dark_by_each_led_alone_and_lit(
    layout: PrototypeLayout, controller: Grbl
) -> None:
    stop = [set(), {1.0}, {2.0}, {3.0}, {4.0}, {0.0}]
    assert controller.lit == 2 * len(layout.stops) * stop


def test_lights_wait_for_the_end_of_the_motion(layout: PrototypeLayout, drive: Drive) -> None:
    """grblHAL switches an output when it reads the line: a dwell must be between."""
    lines = gcode_program(layout, drive, MotionSpec(settle_s=0.0, light_s=0.0), LEDS)
    for line, following in pairwise(lines):
        if line.startswith("G1 "):
            assert following.startswith(("G4 P", "(stop", "M0", "G92.1"))
            assert not following.startswith("G4 P0.000")


def test_grbl_photographs_the_lit_object_only(layout: PrototypeLayout, drive: Drive) -> None:
    plain = sent(gcode_program(layout, drive, MotionSpec(controller="grbl"), LEDS))
    assert plain.lit == [set()] * 2 * len(layout.stops)
    assert "base at 0 degrees" in plain.pauses[0][1]
    assert not plain.homed


def test_the_controller_knows_the_angle_after_homing(layout: PrototypeLayout, drive: Drive) -> None:
    lines = gcode_program(layout, drive, MotionSpec(home_trim_deg=0.25), LEDS)
    homed = home_angles(layout, MotionSpec()).homed
    (line,) = (line for line in lines if line.startswith("G92 "))
    assert float(line.removeprefix("G92 X")) == pytest.approx(homed + 0.25, abs=1e-4)
    assert lines.index("$H") < lines.index(line)


def test_more_leds_than_outputs(layout: PrototypeLayout, drive: Drive) -> None:
    with pytest.raises(SpecError, match="use at most 7 LEDs"):
        gcode_program(layout, drive, MOTION, 8)


def test_it_stays_in_the_swing_but_for_the_approach(
    layout: PrototypeLayout, controller: Grbl
) -> None:
    ends = np.degrees(layout.stops.angle[[0, -1]])
    half = np.degrees(layout.placement.swing) / 2
    assert ends.min() >= -half - 1e-9
    start = ends[0] - MOTION.approach_deg
    assert max(controller.moves) <= ends[1]
    assert min(controller.moves) >= start
    within = [place for place in controller.moves if place != pytest.approx(start, abs=1e-3)]
    assert (
        len(within) == len(controller.moves) - 3
    )  # before each run, and while the object is turned
    assert min(within) >= ends[0]


def test_every_stop_is_reached_from_below(controller: Grbl) -> None:
    steps = list(zip(controller.moves, controller.moves[1:], strict=False))
    for shot in set(controller.shots):
        came = [old for old, new in steps if new == shot != old]
        assert len(came) == 2
        assert max(came) < shot


def test_pauses_for_people(layout: PrototypeLayout, controller: Grbl) -> None:
    (before, first), (between, second) = controller.pauses
    assert before is None
    assert "zero pin out" in first
    assert controller.homed
    assert "turn the object by 180 degrees" in second
    assert between == pytest.approx(stop_sequence(layout, MOTION).start, abs=1e-3)


def test_it_ends_where_it_began(layout: PrototypeLayout, drive: Drive) -> None:
    motion = MotionSpec(home_deg=-12.5)
    assert sent(gcode_program(layout, drive, motion, LEDS)).at == -12.5


def test_other_axis(layout: PrototypeLayout, drive: Drive) -> None:
    plain, other = (
        gcode_program(layout, drive, MotionSpec(axis=axis), LEDS) for axis in ("X", "A")
    )
    assert sent(other, "A").shots == sent(plain).shots
    assert f"($103={drive.steps_per_deg(16):.6g}: steps a degree)" in other
    assert f"($100={drive.steps_per_deg(16):.6g}: steps a degree)" in plain


def test_a_person_as_trigger(layout: PrototypeLayout, drive: Drive) -> None:
    lines = gcode_program(layout, drive, MotionSpec(trigger="pause"), LEDS)
    controller = sent(lines)
    assert not controller.shots
    assert len(controller.pauses) == 2 + 2 * len(layout.stops) * len(PHASES)
    assert controller.pauses[2][1] == "MSG, stop 1: led_1, photograph, then resume"
    assert not {"M8", "M9"} & set(lines)


def test_comments_count_the_mirrors(layout: PrototypeLayout, program: list[str]) -> None:
    counts = re.findall(r"of \d+: (\d+) mirrors", "\n".join(program))
    assert sum(map(int, counts)) == 2 * len(layout.array)
    assert f"(stop 1 of {len(layout.stops)}: {len(layout.stops.mirrors(0))} mirrors)" in program


def test_time(layout: PrototypeLayout, controller: Grbl) -> None:
    sequence = stop_sequence(layout, MOTION)
    travel = 2 * 2 * (sequence.angle[-1] - sequence.start)
    minutes = controller.rest / 60 + travel / MOTION.feed_deg_min
    assert duration_minutes(sequence, MOTION, PHASES) == pytest.approx(minutes)


@pytest.mark.parametrize(
    "motion",
    [
        MotionSpec(settle_s=0.0, exposure_s=0.0),
        MotionSpec(approach_deg=0.0),
        MotionSpec(approach_deg=30),
    ],
)
def test_other_motions(layout: PrototypeLayout, drive: Drive, motion: MotionSpec) -> None:
    controller = sent(gcode_program(layout, drive, motion, LEDS))
    low, high = np.degrees(free_base_angles(layout))
    assert low <= min(controller.moves)
    assert max(controller.moves) <= high
    assert len(controller.shots) == 2 * len(layout.stops) * len(PHASES)


def test_the_approach_ends_where_something_stands(small_design: MirrorDesign) -> None:
    spec = load_spec(None, ["n=6", "prototype.k=5", "prototype.max_swing_deg=180"])
    tight = prototype_layout(spec, small_design)
    start = stop_sequence(tight, MotionSpec(approach_deg=20)).start
    assert start == pytest.approx(np.degrees(free_base_angles(tight)[0]))
    assert start == pytest.approx(-90)


def test_a_start_out_of_reach(layout: PrototypeLayout) -> None:
    with pytest.raises(SpecError, match=r"home_deg is 170, but the base is free from -.* to "):
        stop_sequence(layout, MotionSpec(home_deg=170))


def test_written(program: list[str], tmp_path: Path) -> None:
    write_program(tmp_path / "a.nc", program)
    data = (tmp_path / "a.nc").read_bytes()
    assert data.decode("ascii").splitlines() == program
    assert b"\r" not in data


def test_the_reader_can_refuse() -> None:
    for line in ("G5 X1", "G1 X1", "G0 G1 X1", "G1 X1 (", "M8 P1", "A" * 81, "G1 Xé"):
        with pytest.raises((AssertionError, KeyError)):
            Grbl().send(line)
