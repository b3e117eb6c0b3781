"""Steps of assembly: each part of the list is in exactly one, in an order that can be done."""

import csv
import json
import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tbcad.app.cli import run
from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.mirrors.record import write_record
from tbcad.errors import InputError
from tbcad.prototype.assembly_steps.machine import AssembledMachine, read_machine
from tbcad.prototype.assembly_steps.steps import Step, assembly_steps, mounting_record, record
from tbcad.prototype.files.bom import COLUMNS
from tbcad.records.tables import BallRow, WiringRow
from tests.prototype_records import drive_section, printed_part, prototype_document

Record = dict[str, Any]
PRINTED = ("carrier", "zero_disc", "bearing_head", "camera_bracket", "coupon_1")
AXIS = [0.0, 0.0, 1.0]


def fastener(part: str, number: int, *through: str, at: float = 0.0, x: float = 0.0) -> Record:
    name, place = f"{part.replace('-', '_')}_{number}", [x, 0.0, at]
    told = {"name": name, "part": part, "position_mm": place, "along": AXIS, "through": [*through]}
    return {**told, "turns": False, "finish": None}


def bought(name: str, part: str | None) -> Record:
    return {"name": name, "part": part, "what": name, "turns": False, "finish": None}


def belt_design() -> Record:
    """A machine of few parts, with one of each kind of joint."""
    return prototype_document(
        parts=[printed_part(one, "tool" if one == "coupon_1" else "frame") for one in PRINTED],
        bought=[
            *(bought("plate", "PLATE-400x150x8"), bought("shaft", "SHAFT-8x100")),
            *(bought("wheel", "GT2-60"), bought("pinion", "GT2-20")),
            bought("spacer", "SPACER-8x12x5"),
            *(bought("motor", "NEMA17-40"), bought("camera", None)),
            *(bought("stage_post", "TUBE-20x2x250"), bought("stage_foot", "SHF-20")),
        ],
        fasteners=[
            fastener("INSERT-M3", 1, "carrier", at=20.0),
            fastener("SET-M3x12", 1, "carrier"),
            fastener("M3x16", 1, "wheel", "zero_disc", "carrier"),
            fastener("M5x16", 1, "camera_bracket", "plate", x=50.0, at=1.0),
            fastener("WASHER-5", 1, "camera_bracket", x=50.0),
            fastener("M3x12", 1, "bearing_head", "motor"),
        ],
        drive=drive_section(
            belt_centre_mm=79.0,
            belt_tone_hz=165.0,
            belt_tension_n=5.0,
            ratio=3.0,
            mass_g=500.0,
            hold_current_a=0.3,
        ),
    )


LOOSE = {"GT2-240-6": 1, "GLUE-EPOXY": 1, "OCTOPUS-PRO-1.1": 1, "CABLE-2x0.25": 3, "ball 10 mm": 1}


def write(folder: Path, design: Record, more: dict[str, int]) -> Path:
    """The files of an export that steps are worked out from."""
    counts = Counter(one["part"] for one in design["fasteners"])
    counts.update(one["part"] for one in design["bought"] if one["part"])
    counts.update(one["name"] for one in design["parts"])
    counts.update(more)
    with (folder / "bom.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        for item, (part, count) in enumerate(sorted(counts.items()), 1):
            source = "printed" if part in PRINTED else "bought"
            row = {"item": item, "quantity": count, "part": part, "what": part, "from": source}
            table.writerow(row)
    ball = dict.fromkeys(BallRow.columns(), 1) | {"kind": "ball", "size": "10 mm"}
    write_table(folder / "balls.csv", BallRow.columns(), [ball])
    line: Row = {"line": 1, "signal": "lamp", "part": "lamp", "output": "digital 0"}
    write_table(folder / WiringRow.FILE, WiringRow.columns(), [line])
    (folder / "prototype.json").write_text(json.dumps(design))
    return folder


@pytest.fixture
def machine(tmp_path: Path) -> AssembledMachine:
    return read_machine(write(tmp_path, belt_design(), LOOSE))


def of(steps: tuple[Step, ...], key: str) -> Step:
    return next(step for step in steps if step.key == key)


def taken(steps: tuple[Step, ...]) -> Counter[str]:
    sums = Counter[str]()
    for step in steps:
        sums.update({use.part: use.quantity for use in step.parts})
    return sums


def test_steps_take_exactly_the_parts_of_the_list(machine: AssembledMachine) -> None:
    """And mount each body and fastener once; a fastener waits for the last that it goes through."""
    steps, recorded = assembly_steps(machine), mounting_record(machine)
    assert taken(steps) == Counter(machine.bill.quantities)
    assert [step.number for step in steps] == [*range(1, len(steps) + 1)]
    assert all(step.does and step.checks for step in steps)
    mounted = [name for step in recorded for name in step.mounts]
    fasteners = [one.name for one in machine.fasteners]
    assert sorted(mounted) == sorted([*machine.bodies, *fasteners])
    assert [step.key for step in recorded] == [step.key for step in steps]
    bodies = {body: step.number for step in steps for use in step.parts for body in use.bodies}
    for one in machine.fasteners:
        mounted = max(bodies[body] for body in one.through)
        assert bodies[one.name] == mounted or one.part == "SET-M3x12"
    assert bodies["SET_M3x12_1"] == bodies["shaft"]


def test_a_design_gets_the_steps_that_it_needs(machine: AssembledMachine) -> None:
    """The belt is on the wheel before the shaft is in the bearings."""
    steps = assembly_steps(machine)
    keys = [step.key for step in steps]
    assert not {"lamps", "shroud", "gauge", "table", "caps"} & {*keys}
    assert keys.index("hub") < keys.index("shaft") < keys.index("motor") < keys.index("wiring")
    (belt,) = [step for step in steps if "GT2-240-6" in {use.part for use in step.parts}]
    does = " ".join(belt.does)
    assert belt.key == "shaft"
    assert 0 <= does.index("the belt round the wheel") < does.index("through both bearings")


def test_the_base_is_held_by_pin_or_motor_once_it_is_up(machine: AssembledMachine) -> None:
    """Hanging down, it would strike the stage's post."""
    steps = assembly_steps(machine)
    zero = of(steps, "zero").does
    holds, out = (text_with(zero, words) for words in ("the motor holds", "Before the supply"))
    assert holds < out
    assert "pin in" in zero[out]
    assert "pin in, before the supply" in of(steps, "first").checks[-1]


def text_with(texts: tuple[str, ...], words: str) -> int:
    """Number of the only text that has some words."""
    (number,) = [k for k, text in enumerate(texts) if words in text]
    return number


def direct(design: Record) -> None:
    """A motor with a coupling, without shaft and belt."""
    gone = ("shaft", "spacer", "wheel", "pinion")
    design["bought"] = [one for one in design["bought"] if one["name"] not in gone]
    design["bought"].append(bought("coupling", "FLANGE-5"))
    design["fasteners"][2]["through"][0] = "coupling"


def cut(design: Record) -> None:
    """A carrier of two pieces."""
    design["parts"][0]["name"] = "carrier_1"
    design["parts"].append(printed_part("carrier_2", "base"))
    for one in design["fasteners"]:
        one["through"] = ["carrier_1" if body == "carrier" else body for body in one["through"]]
    pieces = ("carrier_1", "carrier_2")
    design["fasteners"].append(fastener("DOWEL-4x16", 1, *pieces))
    design["fasteners"].append(fastener("M3x12", 2, *pieces, x=30.0))


@pytest.mark.parametrize(("change", "locked"), [(direct, "motor"), (cut, "shaft")])
def test_other_designs_have_steps_of_their_own(
    tmp_path: Path, change: Callable[[Record], None], locked: str
) -> None:
    design, more = belt_design(), dict(LOOSE)
    change(design)
    if change is direct:
        del more["GT2-240-6"]
    machine = read_machine(write(tmp_path, design, more))
    steps = assembly_steps(machine)
    assert taken(steps) == Counter(machine.bill.quantities)
    assert all(step.does and step.checks for step in steps)
    assert "SET-M3x12" in {use.part for use in of(steps, locked).parts}
    joints = {use.part for use in of(steps, "carrier").parts} & {"DOWEL-4x16", "M3x12"}
    assert bool(joints) == (change is cut)


def test_torques_follow_what_yields_first(tmp_path: Path) -> None:
    design = belt_design()
    design["fasteners"].append(fastener("M2x12", 1, "bearing_head", x=80.0))
    steps = assembly_steps(read_machine(write(tmp_path, design, LOOSE)))
    (line,) = [one for one in of(steps, "head").fits if "M2x12" in one]
    assert "hand tight, in the printed hole" in line
    torques = [line for step in steps for line in step.fits if "N m" in line]
    by_screw = {line.split()[2]: float(line.split(": ")[1].split()[0]) for line in torques}
    # N m by K d F: 20 MPa below a bare head and a washer, 8 MPa in shear round an insert.
    limits = {
        "M3x12": 0.2 * 3e-3 * 20 * math.pi / 4 * (5.5**2 - 3.5**2),
        "M3x16": 0.2 * 3e-3 * 8 * math.pi * 4.0 * 5.7,
        "M5x16": 0.2 * 5e-3 * 20 * math.pi / 4 * (10**2 - 5.5**2),
    }
    for screw, limit in limits.items():
        assert limit - 0.05 < by_screw[screw] <= limit


def test_a_set_screw_is_in_the_thread_of_what_is_not_printed(tmp_path: Path) -> None:
    """It goes through the tube's tapped hole and presses on the plastic behind."""
    design = belt_design()
    design["fasteners"].append(fastener("SET-M3x4", 1, "stage_post", "bearing_head", x=80.0))
    steps = assembly_steps(read_machine(write(tmp_path, design, LOOSE)))
    (line,) = [fit for step in steps for fit in step.fits if "SET-M3x4" in fit]
    assert line.endswith("hand tight, in thread of the stage post")


def test_a_braked_base_is_turned_with_voltage_on_the_brake(tmp_path: Path) -> None:
    """Its spring holds the motor from the step on that mounts it."""
    plain, braked = belt_design(), belt_design()
    braked["bought"].append(bought("brake", "BRAKE-17-0.4"))
    for design in (plain, braked):
        design["bought"].append(bought("home_switch", "SWITCH-ROLLER"))
    for design, told in ((plain, False), (braked, True)):
        folder = tmp_path / str(told)
        folder.mkdir()
        steps = assembly_steps(read_machine(write(folder, design, LOOSE)))
        texts = {step.key: " ".join((*step.does, *step.checks)) for step in steps}
        assert all(("24 V" in texts[key]) == told for key in ("motor", "homing", "stage"))


def test_without_a_switch_the_pin_alone_shows_angle_zero(tmp_path: Path) -> None:
    """GRBL 1.1 does not home."""
    for homes in (True, False):
        design, folder = belt_design(), tmp_path / str(homes)
        design["bought"] += [bought("home_switch", "SWITCH-ROLLER")] * homes
        folder.mkdir()
        steps = assembly_steps(read_machine(write(folder, design, LOOSE | {"ROD-4x40": 1})))
        homing = of(steps, "homing")
        assert "ROD-4x40" in {use.part for use in homing.parts}
        assert ("Screw the switch" in homing.does[0]) == homes
        assert ("clicks the switch" in " ".join(homing.checks)) == homes


def test_the_wiring_names_terminals_of_the_board(tmp_path: Path) -> None:
    """Of each firmware that the board is named for, and its driver's place."""
    for firmware, words in (("grblhal", "FAN0 to FAN4"), ("klipper", "step_pin PF13")):
        design, folder = belt_design(), tmp_path / firmware
        design["controller"] |= {"firmware": firmware, "board": "OCTOPUS-PRO-1.1"}
        folder.mkdir()
        steps = assembly_steps(read_machine(write(folder, design, LOOSE | {"DRIVER-2A": 1})))
        does = " ".join(of(steps, "wiring").does)
        assert words in does
        assert "Driver DRIVER-2A" in does


def test_t_nuts_are_in_the_slots_that_their_screws_are_at(tmp_path: Path) -> None:
    """Screws from the front go against the axis, which leans from the uprights to the camera."""
    design, uprights = belt_design(), ("upright_left", "upright_right")
    design["bought"] += [bought(name, "2020-400") for name in uprights]
    for number, z in enumerate((-1.0, -1.0, 1.0), 1):
        for side, name in enumerate(uprights):
            nut = fastener("TNUT-M5-6", 3 * side + number, name, at=number)
            design["fasteners"].append(nut | {"along": [0.0, 0.0, z]})
    steps = assembly_steps(read_machine(write(tmp_path, design, LOOSE)))
    assert "2 in the front one (toward the camera) of each and 1 in" in of(steps, "frame").does[0]


@pytest.mark.parametrize(
    ("changed", "more", "words"),
    [
        ({}, {"GT2-60": -1}, "the list has 0 GT2-60 for 1 bodies"),
        ({}, {"THING": 1}, "THING is in no step"),
        ({"parts": [printed_part("wing")]}, {}, "wing is in no step"),
        ({"schema": "tbcad-prototype/1"}, {}, "this version of tbcad reads"),
    ],
)
def test_what_does_not_add_up_is_refused(
    tmp_path: Path, changed: Record, more: dict[str, int], words: str
) -> None:
    folder = write(tmp_path, belt_design() | changed, LOOSE | more)
    with pytest.raises(InputError, match=words):
        assembly_steps(read_machine(folder))


def test_json_and_page_have_the_same_steps(
    machine: AssembledMachine,
    small_design: MirrorDesign,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_record(tmp_path, small_design, shells=False)
    assert run(["assembly", str(tmp_path), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)["steps"]
    assert printed == json.loads(json.dumps(record(assembly_steps(machine))))
    out = tmp_path / "page"
    assert run(["assembly", str(tmp_path), "--out", str(out), "--no-pictures"]) == 0
    text = (out / "assembly.html").read_text()
    assert all(f'id="{step.key}"' in text for step in assembly_steps(machine))
    assert "<td>0.6 mm, layers of 0.3 mm" in text
    assert run(["assembly", str(tmp_path), "--out", str(out), "--no-pictures"]) == 2
    assert "--force" in capsys.readouterr().err
