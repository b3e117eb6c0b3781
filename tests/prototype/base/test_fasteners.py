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
from tbcad.prototype.base.caps import cap_magnets, cap_pocket, cap_spigot
from tbcad.prototype.base.fasteners import base_fasteners
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.split import UNCUT, BaseSplit, split_base
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.fasteners import Fastener, numbered
from tbcad.prototype.purchased.parts import load_parts

SPEC = BaseSpec()
PARTS = load_parts()
DRIVES = {one.name: one for one in reversed(load_drives(PARTS))}
BELT = DRIVES["nema17-belt"]


def changed_spec(**changed: object) -> BaseSpec:
    return BaseSpec.model_validate(SPEC.model_dump() | changed)


def fasteners(
    base: BaseLayout, split: BaseSplit = UNCUT, drive: Drive = BELT
) -> tuple[Fastener, ...]:
    return numbered(base_fasteners(base, split, drive, PARTS))


def counted(some: tuple[Fastener, ...]) -> dict[str, int]:
    return dict(Counter(one.part.name for one in some))


def of_kind(some: tuple[Fastener, ...], kind: str) -> list[Fastener]:
    return [one for one in some if one.part.kind == kind]


def test_a_whole_base(paper_prototype: PrototypeLayout) -> None:
    base = base_layout(SPEC, paper_prototype)
    some = fasteners(base, split_base(base, PrinterSpec()))
    assert len(of_kind(some, "magnets")) == len(paper_prototype.balls.body_radius)
    # Four of the drive, two of the set screws; the zero disc's key.
    assert {name: n for name, n in counted(some).items() if not name.startswith("MAGNET")} == {
        "INSERT-M3": 6,
        "SET-M3x16": 2,
        "DOWEL-3x10": 1,
        "M3x16": 4,
    }
    assert len({one.name for one in some}) == len(some)
    assert all(one.rotates for one in some)


def test_magnets_end_at_the_bottom_of_their_pockets(small_prototype: PrototypeLayout) -> None:
    base = base_layout(SPEC, small_prototype)
    seats, magnets = base.seats, of_kind(fasteners(base), "magnets")
    ends = np.array([one.place + one.part["height_mm"] * one.along for one in magnets])
    assert ends == pytest.approx(seats.at_depth(seats.bottom), abs=1e-9)
    gap = norm(np.array([one.place for one in magnets]) - seats.centre) - seats.radius
    assert gap == pytest.approx(SPEC.magnet_gap_mm)


def test_set_screws_press_on_the_shaft_and_grip_their_inserts(
    small_prototype: PrototypeLayout,
) -> None:
    base = base_layout(SPEC, small_prototype)
    some, w = fasteners(base), base.frame[0]
    for screw in of_kind(some, "setscrews"):
        tip = screw.place + screw.part["length_mm"] * screw.along
        assert norm(np.cross(tip, w)) == pytest.approx(base.hub.bore)
        insert = next(
            one
            for one in of_kind(some, "inserts")
            if norm(np.cross(one.place - screw.place, screw.along)) < 1e-9
        )
        outer, inner = (norm(np.cross(one.place, w)) for one in (screw, insert))
        inside = inner - insert.part["length_mm"]
        assert min(outer, inner) - inside >= 3.0


def test_the_magnet_of_a_cap_fills_its_pocket(small_prototype: PrototypeLayout) -> None:
    base = base_layout(SPEC, small_prototype)
    magnets = cap_magnets(base, small_prototype, PARTS)
    assert magnets
    for one in magnets:
        k = int(one.through[0].removeprefix("cap_")) - 1
        from_centre = (one.place - base.seats.centre[k]) @ base.seats.axis[k]
        assert from_centre == pytest.approx(cap_spigot(base, k)[1])
        depth = float(small_prototype.balls.body_depth[k])
        assert one.part["height_mm"] == cap_pocket(base, k, depth)[1]


@pytest.mark.parametrize("bed", [150.0])
def test_joints_need_more(small_prototype: PrototypeLayout, bed: float) -> None:
    base = base_layout(SPEC, small_prototype)
    plan = split_base(base, PrinterSpec(bed_mm=(bed, bed, bed)))
    some, screws = fasteners(base, plan), sum(len(one.screws) for one in plan.joints)
    found = counted(some)
    assert screws
    assert found["DOWEL-3x12"] == 2 * len(plan.joints)
    assert found["M3x12"] == screws
    assert found["INSERT-M3"] == 6 + screws
    pieces = {f"carrier_{k + 1}" for k in range(len(plan.pieces))}
    across = [one for one in some if one.part.name in ("DOWEL-3x12", "M3x12")]
    assert all(len(set(one.through) & pieces) == 2 for one in across)


def test_other_hubs(small_prototype: PrototypeLayout) -> None:
    clamp = counted(fasteners(base_layout(changed_spec(lock="clamp"), small_prototype)))
    assert clamp["INSERT-M3"] == 5
    assert sum(count for name, count in clamp.items() if name.startswith("M3x")) == 1 + 4
    direct = base_layout(changed_spec(drive="nema17-direct"), small_prototype)
    screws = of_kind(fasteners(direct, drive=DRIVES["nema17-direct"]), "screws")
    assert {one.through for one in screws} == {("coupling", "zero_disc", "carrier")}
    stage = base_layout(changed_spec(drive="stage-60", hold="glue"), small_prototype)
    found = fasteners(stage, drive=DRIVES["stage-60"])
    assert counted(found) == {"DOWEL-3x10": 1, "M6x20": 4}


def test_not_in_a_list(small_prototype: PrototypeLayout) -> None:
    with pytest.raises(SpecError, match=r"no magnet of \d+ x 4 mm is in magnets\.csv"):
        fasteners(base_layout(changed_spec(magnet_height_mm=4.0), small_prototype))
    base = base_layout(changed_spec(insert_hole_mm=4.4), small_prototype)
    with pytest.raises(SpecError, match=r"no M3 insert for holes of 4\.4 mm"):
        fasteners(base)
    wide = replace(base, hub=replace(base.hub, boss=66.0), spec=SPEC)
    with pytest.raises(SpecError, match=r"no M3 set screw of at least 59\.3 mm is in setscrews"):
        fasteners(wide)
