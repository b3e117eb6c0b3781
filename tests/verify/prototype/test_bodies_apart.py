"""Bodies that share room: clashes of each kind are refused, fits that are meant have a depth."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import manifold3d
import numpy as np
import pytest
from tbcad_verify.prototype import bodies_apart
from tbcad_verify.prototype.assembly import Shape, all_solids
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.report.checks import Check, check_names

from tests.verify.prototype.screws import box, screw, shape

FINE = 96
PARTS = {"washer": "WASHER-5", "head": "M5x16", "screw": "M3x12", "dowel": "DOWEL-3x10"}
PARTS |= {"insert_1": "INSERT-M3", "insert_2": "INSERT-M3"}


def rod(radius: float, low: float, high: float, x: float = 0.0, y: float = 0.0) -> Shape:
    solid = manifold3d.Manifold.cylinder(high - low, radius, radius, FINE)
    return shape(solid.translate([x, y, low]))


def found(bodies: dict[str, Shape], press: float = 0.1) -> tuple[Check, Check]:
    """Clashes of bodies and meant fits; the axis is z, screws point down into the motor."""
    fasteners = [screw(name=name, part=PARTS[name], through=["motor"]) for name in PARTS]
    base = SimpleNamespace(pad_offset_mm=0.0, dowel_press_mm=press)
    spec = SimpleNamespace(prototype=SimpleNamespace(base=base))
    context = SimpleNamespace(
        prototype=SimpleNamespace(fasteners=fasteners),
        export=SimpleNamespace(mesh_error_mm=0.02, spec=spec),
        frame=np.eye(3)[[2, 0, 1]],
    )
    names = check_names(bodies_apart.CHECKS, "prototype.glb")
    given = cast(PrototypeContext, context), all_solids([], bodies), bodies
    apart, fits = bodies_apart.checks(names, *given)
    return apart, fits


WHEELS = {"wheel": rod(20.0, 0, 9), "pinion": rod(10.0, 0, 9, x=60)}
WALL = box(4, -9, -9, 9, 9, 9)
CLASHES = {
    "bracket and washer share 4.": {"washer": rod(5.0, 0, 1), "bracket": WALL},
    "foot and head": {"head": rod(4.25, 0, 5), "foot": WALL},
    "belt and upright": {**WHEELS, "upright": box(25, 5, -50, 45, 25, 50)},
    "bracket and camera": {"camera": rod(33.0, 0, 95), "bracket": box(32.5, -9, 9, 40, 9, 50)},
    "lamp and stand share 100": {
        "lamp": box(0, 0, 0, 10, 50, 2),
        "stand": box(5, 20, 1, 30, 40, 9),
    },
    "insert_1 and insert_2 share 71": {f"insert_{k}": rod(2.0, 0, 5.7) for k in (1, 2)},
    # too deep, its head, not for this body, no screw
    "motor and screw share 2": {"screw": rod(1.19, -12, 0), "motor": box(-9, -9, -40, 9, 9, -7)},
    "motor and screw": {"screw": rod(1.19, -2, 3), "motor": box(-9, -9, -40, 9, 9, 1)},
    "camera and screw": {"screw": rod(1.19, -12, 0), "camera": box(-9, -9, -40, 9, 9, -9)},
    "motor and washer": {"washer": rod(5.0, 0, 1), "motor": box(-9, -9, -40, 9, 9, 0.5)},
    "brick and foot share 1 mm": {"brick": box(0, 0, 0, 1, 1, 1), "foot": box(-1, -1, -1, 2, 2, 2)},
}


@pytest.mark.parametrize("words", CLASHES)
def test_a_clash_is_refused(words: str) -> None:
    apart, _ = found(CLASHES[words])
    assert apart.passed is False
    assert words in apart.detail


def test_a_screw_in_the_motor_is_listed_with_its_depth() -> None:
    apart, fits = found({"screw": rod(1.19, -12, 0), "motor": box(-9, -9, -40, 9, 9, -9)})
    assert apart.passed
    assert fits.detail == "motor and screw 3.00"


@pytest.mark.parametrize(("press", "passes"), [(-0.4, True), (0.1, False), (-0.1, False)])
def test_a_dowel_is_pressed_no_deeper_than_the_design_asks(press: float, passes: bool) -> None:
    hole = manifold3d.Manifold.cylinder(8, 1.3, 1.3, FINE).translate([0, 0, -1])
    carrier = shape(manifold3d.Manifold.cube([9, 9, 6]).translate([-4.5, -4.5, 0]) - hole)
    apart, fits = found({"dowel": rod(1.5, 0, 6), "carrier_1": carrier}, press)
    assert apart.passed is passes
    assert fits.measured == passes


def test_round_bodies_in_contact_and_bodies_apart_pass() -> None:
    """A shaft of other facets in its bearing, and a plate on a plate."""
    ring = manifold3d.Manifold.cylinder(7, 11, 11, FINE)
    ring -= manifold3d.Manifold.cylinder(9, 4, 4, 25).translate([0, 0, -1])
    bodies = {"bearing": shape(ring), "shaft": rod(4.0, -20, 20)}
    bodies |= {"low": box(30, 0, 0, 40, 9, 5), "high": box(30, 0, 5, 40, 9, 8)}
    apart, fits = found(bodies)
    assert apart.passed
    assert apart.measured
    assert fits.measured == 0
