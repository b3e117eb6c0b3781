"""Fall, place along the axis, outputs and contrast, with what each must refuse."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from tbcad_verify.prototype import axial_checks, drive_checks, scatter_checks
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control import board_checks
from tbcad_verify.report.checks import Unknown
from tbcad_verify.step.solids_text import RoundFace, TextSolid

from tbcad.prototype.electronics import COOLANT_OUTPUTS
from tbcad.prototype.purchased.parts import load_parts, of_kind
from tests.verify.prototype.test_drives import ABOVE, WEIGHT_NMM
from tests.verify.prototype.test_drives import context as swinging

PARTS = load_parts()
NAME = ("check", "file", "unit")
AXIS = np.array([1.0, 0.0, 0.0])


def ring(low: float, high: float, outer: float, bore: float) -> TextSolid:
    faces = (
        RoundFace("cylinder", np.zeros(3), AXIS, outer, False, (low, high)),
        RoundFace("cylinder", np.zeros(3), AXIS, bore, True, (low, high)),
    )
    return TextSolid(np.array([[low, outer, 0.0], [high, outer, 0.0]]), faces)


CHAIN = {
    "zero_disc": ring(14, 19, 50, 4),
    "wheel": ring(5, 14, 20, 4),
    "spacer": ring(0, 5, 6, 4),
    "bearing_front": ring(-7, 0, 11, 4),
    "bearing_rear": ring(-60, -53, 11, 4),
    "collar": ring(-68, -60, 8, 4),
}


def chain(**changed: TextSolid) -> tuple[bool | None, float | None]:
    base = SimpleNamespace(drive="nema17-belt")
    spec = SimpleNamespace(prototype=SimpleNamespace(base=base))
    context = SimpleNamespace(export=SimpleNamespace(spec=spec), frame=np.eye(3))
    (found,) = axial_checks.checks([NAME], cast(PrototypeContext, context), CHAIN | changed)
    return found.passed, found.measured


def test_the_chain_along_the_axis_closes() -> None:
    assert chain() == (True, 0.0)
    assert chain(spacer=ring(0, 4.5, 6, 4)) == (False, pytest.approx(0.5))
    assert chain(collar=ring(-69, -61, 8, 4)) == (False, pytest.approx(1.0))
    assert chain(spacer=ring(0, 5, 8, 4))[0] is False  # it would rub on the shield
    without = {name: solid for name, solid in CHAIN.items() if name != "spacer"}
    with pytest.raises(Unknown, match="no spacer"):
        axial_checks._solid(without, "spacer")


BRAKE = (400.0, 0.04)


@pytest.mark.parametrize(
    ("brake", "times", "held"),
    [(BRAKE, 1.0, True), (None, 1.0, False), ((50.0, 0.04), 1.0, False), (BRAKE, 5.0, False)],
)
def test_a_brake_holds_with_a_margin(
    brake: tuple[float, float] | None, times: float, held: bool
) -> None:
    """Without it, or with one that is too weak, the base falls as before."""
    base = replace(ABOVE, mass=ABOVE.mass * times)
    energy, _ = drive_checks._fall(swinging(), base, brake, 3.0)
    torque = times * WEIGHT_NMM
    soft = (torque * 1e-3 * 0.04) ** 2 / (2 * base.inertia * 1e-9)
    assert energy == pytest.approx(soft if held else 1e-3 * torque, rel=1e-6)
    assert (energy <= drive_checks.FALL_J) == held


def test_brakes_and_boards_are_those_of_the_lists() -> None:
    assert {
        one.name: (one["torque_nmm"], one["response_s"]) for one in of_kind(PARTS, "brakes")
    } == drive_checks.BRAKES
    boards = {one.name: one["outputs"] - COOLANT_OUTPUTS for one in of_kind(PARTS, "boards")}
    assert boards == board_checks.OUTPUTS


@pytest.mark.parametrize(("highest", "passed"), [(4, True), (5, False)])
def test_a_program_switches_outputs_that_the_board_has(highest: int, passed: bool) -> None:
    board = SimpleNamespace(board="OCTOPUS-PRO-1.1")
    program = f"M64 P0\nM64 P{highest}\n"
    context = SimpleNamespace(prototype=SimpleNamespace(controller=board, program=program))
    (found,) = board_checks.checks([NAME], cast(PrototypeContext, context))
    assert (found.passed, found.measured) == (passed, highest + 1)


@pytest.mark.parametrize(
    ("grade", "passed"), [("G10", True), ("G20", True), ("G28", False), ("G40", False), ("", True)]
)
def test_a_rough_ball_leaves_no_contrast(grade: str, passed: bool) -> None:
    """At normal incidence: exp of (4 pi 1.25 Ra / 0.55)^2."""
    columns = {"px": np.zeros((3, 1)), "nx": np.array([[0.0], [0.0], [1.0]])}
    balls = SimpleNamespace(
        columns=lambda name, count: columns[name],
        grade=np.array([grade]),
        names=lambda which: ["ball 1"],
    )
    context = SimpleNamespace(
        prototype=SimpleNamespace(balls=balls), pinhole=np.array([0.0, 0.0, 100.0])
    )
    (found,) = scatter_checks.checks([NAME], cast(PrototypeContext, context))
    expected = np.exp(-((4 * np.pi * 1.25 * scatter_checks.RA_UM[grade] / 0.55) ** 2))
    assert (found.passed, found.measured) == (passed, pytest.approx(expected))
