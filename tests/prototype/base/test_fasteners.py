"""Fasteners of the base: what there is, and where."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.design import PrinterSpec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.fasteners import base_fasteners
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.split import UNCUT, BaseSplit, split_base
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.fasteners import Fastener, numbered
from tbcad.prototype.purchased.parts import load_parts

SPEC = BaseSpec()
PARTS = load_parts()
DRIVES = {one.name: one for one in reversed(load_drives(PARTS))}


def fasteners(base: BaseLayout, split: BaseSplit = UNCUT) -> tuple[Fastener, ...]:
    return numbered(base_fasteners(base, split, DRIVES[base.spec.drive], PARTS))


def counted(some: tuple[Fastener, ...]) -> dict[str, int]:
    return dict(Counter(one.part.name for one in some))


def of_kind(some: tuple[Fastener, ...], kind: str) -> list[Fastener]:
    return [one for one in some if one.part.kind == kind]


@pytest.fixture(scope="module")
def base(small_prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(SPEC, small_prototype)


def test_a_whole_base(base: BaseLayout) -> None:
    some, seats, w = fasteners(base), base.seats, base.frame[0]
    # Four of the drive, two of the set screws; the zero disc's key.
    assert {name: n for name, n in counted(some).items() if not name.startswith("MAGNET")} == {
        **{"INSERT-M3": 6, "SET-M3x16": 2, "DOWEL-3x10": 1, "M3x20": 4}
    }
    assert len({one.name for one in some}) == len(some)
    assert all(one.rotates for one in some)
    # Magnets end at the bottom of their pockets.
    magnets = of_kind(some, "magnets")
    ends = np.array([one.place + one.part["height_mm"] * one.along for one in magnets])
    assert ends == pytest.approx(seats.at_depth(seats.bottom), abs=1e-9)
    gap = norm(np.array([one.place for one in magnets]) - seats.centre) - seats.radius
    assert gap == pytest.approx(SPEC.magnet_gap_mm)
    for screw in of_kind(some, "setscrews"):
        tip = screw.place + screw.part["length_mm"] * screw.along
        assert norm(np.cross(tip, w)) == pytest.approx(base.hub.bore)


def test_joints_need_more(base: BaseLayout) -> None:
    plan = split_base(base, PrinterSpec(bed_mm=(150.0, 150.0, 150.0)))
    some, screws = fasteners(base, plan), sum(len(one.screws) for one in plan.joints)
    found = counted(some)
    assert found["DOWEL-3x12"] == 2 * len(plan.joints)
    assert (found["M3x12"], found["INSERT-M3"]) == (screws, 6 + screws)
    pieces = {f"carrier_{k + 1}" for k in range(len(plan.pieces))}
    across = [one for one in some if one.part.name in ("DOWEL-3x12", "M3x12")]
    assert all(len(set(one.through) & pieces) == 2 for one in across)


def test_other_hubs_and_parts_in_no_list(small_prototype: PrototypeLayout) -> None:
    def base(**changed: object) -> BaseLayout:
        return base_layout(BaseSpec.model_validate(SPEC.model_dump() | changed), small_prototype)

    clamp = counted(fasteners(base(lock="clamp")))
    assert clamp["INSERT-M3"] == 5
    screws = {name: count for name, count in clamp.items() if name.startswith("M3x")}
    assert screws == {"M3x20": 4, "M3x30": 1}  # of the drive, and across the clamp
    screws = of_kind(fasteners(base(drive="nema17-direct")), "screws")
    assert {one.through for one in screws} == {("coupling", "zero_disc", "carrier")}
    stage = fasteners(base(drive="stage-60", hold="glue"))
    assert counted(stage) == {"DOWEL-3x10": 1, "M6x20": 4}
    with pytest.raises(SpecError, match=r"no magnet of \d+ x 4 mm is in magnets\.csv"):
        fasteners(base(magnet_height_mm=4.0))
    other = base(insert_hole_mm=4.4)
    with pytest.raises(SpecError, match=r"no M3 insert for holes of 4\.4 mm"):
        fasteners(other)
    with pytest.raises(SpecError, match=r"no M3 set screw of at least 59\.3 mm is in setscrews"):
        fasteners(replace(other, hub=replace(other.hub, boss=66.0), spec=SPEC))
