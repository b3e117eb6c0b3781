"""Whole arrangements: what is bought is there and fits, screws reach, the switch is pressed."""

import math
import re
from collections import Counter
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from tbcad.cad.formats.checked_files import Row
from tbcad.core.geometry.primitives import Cylinder, Primitive, enclosing_triangles
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import design
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.prototype.arrangement import PrototypeModel, arrange
from tbcad.prototype.drive.balance import free_base_angles
from tbcad.prototype.drive.drive import BaseTorques, drive_loads, load_drives
from tbcad.prototype.electronics import Wiring, led_circuit
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.files.bom import bom_rows
from tbcad.prototype.files.controllers import controller_files
from tbcad.prototype.files.tables import hole_rows
from tbcad.prototype.frame.shared import BearingHead
from tbcad.prototype.frame.stock import Stock
from tbcad.prototype.homing import HomingLayout
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.purchased.parts import Prices, load_parts

DESIGNS = (
    ("n=6",),
    (
        *("n=4", "base.drive=nema17-direct", "base.hold=glue", "light.lamp_z_mm=0"),
        *("motion.axis=A", "feed_deg_min=600", "microsteps=32"),
    ),
    ("n=5", "base.drive=stage-60", "camera_diameter_mm=0", "trigger=pause", "stage.leds_mm=[]"),
)
# Of the roller of a switch SS-5GL2 from the line of its holes, mm (Omron): free, and when it trips.
FREE_MM, TRIPS_MM = 19.3, 14.5
PIN_MM, PIN_HOLE_MM = 4.0, 4.2
THREADED = {"inserts": (0.0, "length_mm"), "nuts": (0.0, "height_mm"), "tnuts": (0.5, None)}
TNUT_MM = 4.0


@cache
def arranged(options: tuple[str, ...]) -> PrototypeModel:
    return arrange(design(load_spec(None, list(options))))


@pytest.fixture(params=DESIGNS, ids=["belt", "direct", "stage"])
def model(request: pytest.FixtureRequest) -> PrototypeModel:
    return arranged(request.param)


def bought(model: PrototypeModel) -> Counter[str]:
    parts = model.parts | model.frame.of(Wiring).parts
    rows = bom_rows(model.layout, model.drive, model.purchased, (), 1.27, parts, Prices(()))
    return Counter({str(row["part"]): int(row["quantity"]) for row in rows})


def wiring(model: PrototypeModel) -> dict[str, Row]:
    return {str(row["signal"]): row for row in model.frame.of(Wiring).rows}


def along(model: PrototypeModel, points: np.ndarray) -> np.ndarray:
    """Coordinates (..., 3) along the axis, out at azimuth zero, and to the side."""
    return np.asarray(points @ model.base.frame.T)


def holes(model: PrototypeModel, removed: tuple[Primitive, ...], diameter: float) -> np.ndarray:
    """Places (n, 2) across the axis of a body's holes of a diameter along it."""
    w = model.base.frame[0]
    found = [
        along(model, one.start)[1:]
        for one in removed
        if isinstance(one, Cylinder)
        and one.radius == pytest.approx(diameter / 2)
        and abs(one.axis @ w) == pytest.approx(1)
    ]
    return np.array(found).reshape(-1, 2)


def test_each_body_and_each_line_of_the_wiring_is_bought(model: PrototypeModel) -> None:
    frame, list_ = model.frame, bought(model)
    drawn = Counter(one.part for one in frame.purchased if one.part)
    lamps = frame.find(LampLayout)
    if lamps:
        del drawn[lamps.strip.name]
        metres = len(lamps.places) * lamps.strips * lamps.length / 1e3
        assert metres <= list_[lamps.strip.name] < metres + 1
    drawn += Counter(one.part.name for one in model.fasteners)
    assert {part: list_[part] for part in drawn} == drawn
    assert len({one.name for one in model.fasteners}) == len(model.fasteners)
    begins = Counter(name.partition("-")[0] for name in drawn.elements())
    assert begins["LED"] == len(model.stage.leds)
    assert (begins["MAGNET"] > 0) == (model.spec.prototype.base.hold == "magnet")
    assert drawn[frame.of(Stock).upright.name] == 2
    assert list_[frame.of(HomingLayout).pin] == 1
    if model.shroud:
        panels = sum(math.prod(panel.cut_size) for panel in model.shroud.panels)
        sheet = model.shroud.sheet["length_mm"] * model.shroud.sheet["width_mm"]
        assert list_[model.shroud.sheet.name] == model.shroud.sheets >= panels / sheet
    own = {"board", "lamp", None}
    for row in wiring(model).values():
        used = {row[column] for column in ("part", "connector", "resistor", "wire")} - own
        assert all(list_[str(part)] for part in used), row


def test_wiring_of_lamps_release_switch_and_motor(model: PrototypeModel) -> None:
    rows, lamps, motor = wiring(model), model.frame.find(LampLayout), model.drive.motor
    if "release" in rows:  # spindle and coolant of GRBL: M8 on, M9 off
        assert (rows["release"]["on"], rows["release"]["off"]) == ("M8", "M9")
    amperes = motor["rated_a"] if motor.kind == "motors" else None
    assert rows["motor"]["current_ma"] == (amperes and pytest.approx(1e3 * amperes))
    # $5 has it so: the input, pulled up, is high when the switch is pressed.
    assert "normally closed" in str(rows["home"]["path"])
    if lamps:
        watt = len(lamps.places) * lamps.strips * lamps.length / 1e3 * lamps.strip["watt_m"]
        assert rows["lamp"]["current_ma"] == pytest.approx(1e3 * watt / 24)
        apart = norm(np.diff(lamps.places, axis=0)).max()
        reach = 1000 + len(lamps.places[1:]) * apart
        assert float(rows["lamp"]["length_mm"]) >= reach
    if circuit := model.frame.of(Wiring).circuit:
        weak = {circuit.wire.name: replace(circuit.wire, sizes=(0.5, 5.0))}
        thick = {name: part for name, part in model.parts.items() if not name.startswith("WIRE-")}
        with pytest.raises(SpecError, match="wires of LEDs"):
            led_circuit(model.spec.prototype, model.stage, thick | weak)


def test_screws_reach_into_their_threads(model: PrototypeModel) -> None:
    """By 0.6 diameters at least; in the plate by one, and not through it."""
    some = model.fasteners
    screws = [one for one in some if one.part.kind in ("screws", "setscrews")]
    for one in (each for each in some if each.part.kind in THREADED):
        assert any(holds(one, screw) for screw in screws) or one.part.kind == "nuts", one.name
    for one in (each for each in some if each.part.kind == "screws"):
        thread, length, last = one.part["thread_mm"], one.part["length_mm"], one.through[-1]
        mates = [each for each in some if holds(each, one)]
        if last.startswith(("upright", "carrier")) or "camera_plate" in one.through[1:]:
            assert mates, one.name
        if last == "plate":
            floor = model.spec.prototype.frame.floor_mm
            depth = floor - float((one.place + length * one.along)[2])
            assert thread - 1e-9 <= depth <= model.frame.of(Stock).plate["thickness_mm"], one.name
        elif mates:
            assert max(engaged(each, one) for each in mates) >= 0.6 * thread, one.name
    motor = np.array([one.place for one in some if one.through[-1] == "motor"])
    if len(motor):
        away = np.sort(norm(motor[:, None] - motor), axis=1)  # NEMA 17: a square of 31 mm
        assert away[:, 1:] == pytest.approx(np.tile([31, 31, 31 * math.sqrt(2)], (4, 1)))


def holds(mate: Fastener, screw: Fastener) -> bool:
    """Whether a screw, on its axis, has a mate of its thread in its last body."""
    if mate.part.kind not in THREADED or mate.part["thread_mm"] != screw.part["thread_mm"]:
        return False
    aside = norm(np.cross(mate.place - screw.place, screw.along))
    return mate.through == screw.through[-1:] and bool(aside < 1e-6)


def engaged(mate: Fastener, screw: Fastener) -> float:
    """Length of a thread that a screw is in, mm."""
    start, size = THREADED[mate.part.kind]
    ends = [start, start + (mate.part[size] if size else TNUT_MM)]
    at = [float((mate.place + end * mate.along - screw.place) @ screw.along) for end in ends]
    low, high = sorted(at)
    return min(high, screw.part["length_mm"]) - max(low, 0.0)


def test_holes_of_the_plate_are_where_screws_are(model: PrototypeModel) -> None:
    stock = model.frame.of(Stock)
    told = np.array([[float(row["x_mm"]), float(row["y_mm"])] for row in hole_rows(stock)])
    screws = [one.place for one in model.fasteners if one.through[-1] == "plate"]
    places = (np.array(screws) @ model.axes.T)[:, :2] - stock.corner
    assert np.sort(norm(told[:, None] - places), axis=1)[:, 0] == pytest.approx(0, abs=1e-6)
    assert ((told > 5) & (told < np.array(stock.plate.sizes[:2]) - 5)).all()


def test_the_tab_presses_the_switch_at_its_angle_alone(model: PrototypeModel) -> None:
    """Below the switch's angle the roller is where it trips; from the first stop up it is free."""
    homing = model.frame.of(HomingLayout)
    (switch,) = homing.purchased
    drilled = [one.start for one in switch.removed if isinstance(one, Cylinder)]
    middle = along(model, np.mean(drilled, axis=0))[1:]
    outlines = [
        along(model, enclosing_triangles(one).reshape(-1, 3))[:, 1:] for one in homing.disc.added
    ]

    def roller(angle_deg: float) -> float:
        """Distance of the disc's edge from the line of the switch's holes, mm."""
        turn = math.atan2(middle[1], middle[0]) - math.radians(angle_deg)
        way = np.array([math.cos(turn), math.sin(turn)])
        return float(norm(middle)) - max(edge(points, way) for points in outlines)

    angles, stops = homing.angles, np.degrees(model.layout.stops.angle)
    assert all(roller(angles.switch - below) <= TRIPS_MM for below in (0.1, 1.0, 2.0))
    assert roller(angles.homed) > TRIPS_MM
    assert all(roller(angle) >= FREE_MM for angle in np.linspace(min(stops), max(stops), 20))


def edge(points: np.ndarray, way: np.ndarray) -> float:
    """How far a convex outline about points (n, 2) reaches from the origin along a unit vector."""
    a, b = ConvexHull(points).equations[:, :2] @ way, ConvexHull(points).equations[:, 2]
    out = np.divide(-b, a, out=np.full(len(a), np.inf), where=a > 1e-12)
    low = np.divide(-b, a, out=np.full(len(a), -np.inf), where=a < -1e-12).max()
    return float(out.min()) if out.min() > max(low, 0.0) else 0.0


def test_the_zero_pin_goes_through_head_and_disc(model: PrototypeModel) -> None:
    homing, on_head = model.frame.of(HomingLayout), model.frame.of(BearingHead)
    hub = model.base.hub
    disc = holes(model, homing.disc.removed, PIN_HOLE_MM)
    head = holes(model, on_head.printed[0].removed, PIN_HOLE_MM)
    assert head == pytest.approx(disc)
    assert len(disc) == 1
    pin = model.parts[homing.pin]
    assert pin["diameter_mm"] == PIN_MM
    assert pin["length_mm"] >= hub.face - on_head.plate.back + 5  # that one can grip
    key = float(norm(hub.key))
    play = (PIN_HOLE_MM - PIN_MM) / float(norm(disc[0])) + 0.1 / key
    assert homing.error_deg == pytest.approx(math.degrees(play))


def test_both_controllers_are_told_the_same_machine(model: PrototypeModel) -> None:
    motion, angles = model.spec.prototype.motion, model.frame.of(HomingLayout).angles
    files = {
        name: text
        for controller in ("grblhal", "klipper")
        for name, text in controller_files(
            model.layout,
            model.drive,
            motion.model_copy(update={"controller": controller}),
            len(model.stage.leds),
            "a design",
        ).items()
    }
    grbl = {
        int(number): float(value)
        for number, value in re.findall(r"^\$(\d+)=(\S+)$", files["grbl_settings.txt"], re.M)
    }
    pairs = re.findall(r"^(\w+): (\S+)$", files["klipper.cfg"], re.M)
    klipper, axis = dict(pairs), "XYZA".index(motion.axis)
    turns = float(klipper["gear_ratio"].removesuffix(":1"))
    steps = float(klipper["full_steps_per_rotation"]) * float(klipper["microsteps"])
    each = steps * turns / float(klipper["rotation_distance"])
    assert grbl[100 + axis] == pytest.approx(each, rel=1e-6)
    assert grbl[110 + axis] == 60 * float(klipper["velocity"]) == motion.feed_deg_min
    assert grbl[120 + axis] == float(klipper["accel"]) == motion.acceleration_deg_s2
    assert klipper["endstop_pin"].startswith("^")  # pulled up, or an open switch tells nothing
    # After homing grblHAL keeps the pull-off from both ends of the travel.
    low, high = angles.switch + grbl[27], angles.switch + grbl[130 + axis] - grbl[27]
    assert low == pytest.approx(angles.homed)
    last = max(float(np.degrees(model.layout.stops.angle[-1])), motion.home_deg)
    assert last + 0.5 <= high
    assert low < np.degrees(model.layout.stops.angle[0])
    assert np.degrees(free_base_angles(model.layout)[0]) < angles.switch


def test_a_drive_that_yields_by_more_than_a_degree_is_at_fault() -> None:
    found = set()
    for drive in load_drives(load_parts()):
        for gravity in (0.3 * drive.holds_nmm, 0.99 * drive.holds_nmm):
            loads = drive_loads(drive, BaseTorques(gravity, gravity, gravity))
            yields = math.degrees(loads.motor_wind_up + loads.belt_wind_up) > 1
            assert any("yields" in fault for fault in loads.faults()) is yields
            found.add(yields)
    assert found == {True, False}


@pytest.mark.parametrize(("rise_k", "warm"), [(38.0, False), (42.0, True)])
def test_motors_hold_and_keep_their_mounts_below_65_degrees(rise_k: float, warm: bool) -> None:
    """80 K with the rated current at 25 degrees, as its square; 1.4 times gravity is held."""
    for drive in load_drives(load_parts()):
        if drive.efficiency >= 0.5:
            held = math.sqrt(rise_k / 80) * drive.holds_nmm / 1.4
            faults = list(drive_loads(drive, BaseTorques(held, held, held)).faults())
            assert any("warmer" in fault for fault in faults) is warm
        for share in (0.99, 1.01):
            asked = BaseTorques(1.0, 1.0, share * drive.holds_nmm)
            weak = [fault for fault in drive_loads(drive, asked).faults() if "holds" in fault]
            assert bool(weak) == (share > 1)
