"""Fasteners against holes: a screw through a slot into a tapped hole, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from tbcad_verify.prototype.fastener_checks import faults_of, is_filled, size_of
from tbcad_verify.record.prototype import PlacedFastener
from tbcad_verify.step.solids_text import RoundFace, TextSolid

from tests.verify.prototype.screws import screw

UP = np.array([0.0, 0.0, 1.0])
CORE_M5 = (5.0 - 1.226869 * 0.8) / 2


def face(
    x: float, low: float, high: float, radius: float, *, hollow: bool = True, y: float = 5.0
) -> RoundFace:
    return RoundFace("cylinder", np.array([x, y, 0.0]), UP, radius, hollow, (low, high))


def solid(*faces: RoundFace) -> TextSolid:
    return TextSolid(np.zeros((1, 3)), faces)


def solids(**changed: TextSolid) -> dict[str, TextSolid]:
    """A slot of 10 mm in a bracket of 8 mm, on a plate of 8 mm with a tapped hole."""
    return {
        "bracket": solid(face(5.0, 0, 8, 2.75), face(15.0, 0, 8, 2.75)),
        "plate": solid(face(10.0, -8, 0, 2.1)),
        "M5x16_1": solid(face(10.0, -7, 9, CORE_M5, hollow=False)),
        **changed,
    }


def placed(**changed: Any) -> PlacedFastener:
    return screw(**{"position_mm": [10.0, 5.0, 9.0], "through": ["bracket", "plate"]} | changed)


def faults(one: PlacedFastener, some: Mapping[str, TextSolid], *others: PlacedFastener) -> str:
    return "; ".join(faults_of(one, [one, *others], some))


def test_a_screw_in_its_place_has_no_fault() -> None:
    assert faults(placed(), solids()) == ""


@pytest.mark.parametrize(
    ("one", "some", "fault"),
    [
        (placed(), solids(plate=solid()), "has no hole in plate"),
        (placed(), solids(plate=solid(face(10.1, -8, 0, 2.1))), "has no hole in plate"),
        (placed(), solids(plate=solid(face(10.0, -8, 0, 1.65))), "has no hole in plate"),
        (placed(), solids(bracket=solid(face(5.0, 0, 8, 2.75))), "has no hole in bracket"),
        (placed(part="M5x12"), solids(), "of another size"),
        (placed(part="M5x12", position_mm=[10, 5, 12.5]), solids(), "grips too little in plate"),
        (placed(part="M7x12"), solids(), "of an unknown part M7x12"),
        (placed(through=["bracket", "desk"]), solids(), "needs desk in the assembly"),
        (placed(position_mm=[10, 5, 10]), solids(), "is drawn elsewhere"),
    ],
)
def test_what_is_wrong_is_said(one: PlacedFastener, some: dict[str, TextSolid], fault: str) -> None:
    assert fault in faults(one, some)


def test_an_insert_is_gripped_by_a_diameter() -> None:
    insert = screw(name="INSERT_M3_1", part="INSERT-M3", through=["block"])
    some = {"block": solid(face(0, -6, 0, 2.0, y=0)), "lid": solid(face(0, 0, 8, 1.7, y=0))}
    core = (3 - 1.226869 * 0.5) / 2
    for length, fault in ((12, ""), (10, "grips too little in block")):
        name = f"M3x{length}"
        some["M3"] = solid(face(0, 8 - length, 8, core, hollow=False, y=0))
        one = placed(name="M3", part=name, position_mm=[0, 0, 8], through=["lid", "block"])
        assert fault in faults(one, some, insert)
        assert bool(faults(one, some, insert)) == bool(fault)


def test_a_hole_is_filled_from_its_axis_or_a_slot_from_its_middle() -> None:
    slot = [face(5.0, 0, 8, 2.75), face(15.0, 0, 8, 2.75)]
    assert all(is_filled(placed(), one, slot) for one in slot)
    beside = placed(position_mm=[11.0, 5.0, 9.0])
    assert not any(is_filled(beside, one, slot) for one in slot)


def test_sizes_follow_from_names() -> None:
    washer, magnet = size_of("WASHER-5"), size_of("MAGNET-15x3")
    assert washer
    assert (washer.radius, washer.low, washer.high, washer.covers) == (5.0, -1.0, 0.0, True)
    assert magnet
    assert (magnet.radius, magnet.high) == (7.5, 3.0)
    assert size_of("NAIL-2x20") is None
