"""Keys on screws: which they are, where they are, and what is in their way."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import manifold3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tbcad_verify.prototype import key_access
from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.key_access import HEAD_KEYS_MM, KEYS_MM, SET_KEYS_MM, key_of
from tbcad_verify.record.prototype import AssemblyStep, PlacedFastener
from tbcad_verify.report.checks import check_names

from tbcad.prototype.purchased.parts import load_parts
from tests.verify.prototype.screws import box, screw, shape

KEY_RADIUS, KEY_END = 4.53 / 2, 5.0 + 74.0


def hood(low: float, high: float, width: float) -> Shape:
    """A round tube about the key, 6 mm thick, of an inner width."""
    radii = width / 2 + 6, width / 2
    outer, inner = (manifold3d.Manifold.cylinder(high - low, r, r, 32) for r in radii)
    return shape((outer - inner).translate([0, 0, low]))


def unreached(
    bodies: dict[str, Shape],
    steps: dict[str, tuple[str, ...]] | None = None,
    turning: tuple[str, ...] = (),
    *others: PlacedFastener,
    **changed: Any,
) -> str:
    """What is in the way of a screw's key on a plate; the base turns about x from -30 to 60."""
    one = screw(**changed)
    steps = steps or {"one": ("plate", one.name, *bodies)}
    record = SimpleNamespace(
        assembly_steps=[AssemblyStep(mounts=list(some)) for some in steps.values()],
        fasteners=[one, *others],
        parts=[],
        bought=[SimpleNamespace(name=name, turns=True) for name in turning],
        swing=(-30.0, 60.0),
    )
    context = SimpleNamespace(
        prototype=record,
        base_rotation=lambda angle: Rotation.from_rotvec(angle[:, None] * [1.0, 0.0, 0.0]),
    )
    plate, body = box(-20, -20, -10, 20, 20, 0), box(-4, -4, -9, 4, 4, 5)
    drawn = {"plate": plate, one.name: body, **bodies}
    names = check_names(key_access.CHECKS, "prototype.json")
    (check,) = key_access.checks(names, cast(PrototypeContext, context), drawn)
    assert check.passed == (check.measured == 0)
    return "" if check.passed else check.detail


def wall(near: float, low: float, high: float) -> dict[str, Shape]:
    """A wall beside the key, from x = near on, between two heights."""
    return {"wall": box(near, -5, low, near + 5, 5, high)}


def test_tbcads_screws_have_keys() -> None:
    for name, part in load_parts().items():
        if part.kind not in ("screws", "setscrews"):
            continue
        key = key_of(screw(part=name))
        flats = (HEAD_KEYS_MM if part.kind == "screws" else SET_KEYS_MM)[part["thread_mm"]]
        height = part["head_height_mm"] if part.kind == "screws" else 0.0
        assert key is not None
        assert key.start == pytest.approx([0, 0, height], abs=0.01)
        assert flats < 2 * key.radius < 2 / np.sqrt(3) * flats
        assert (key.length, key.short) == KEYS_MM[flats][1:]


@pytest.mark.parametrize("along", [(0, 0, -1), (0, 0, 1), (1, 0, 0), (0.6, -0.8, 0)])
def test_the_key_is_a_cylinder_from_the_head_outward(along: tuple[float, float, float]) -> None:
    key = key_of(screw(along=list(along), position_mm=[3.0, 4.0, 5.0]))
    assert key is not None
    assert key.solid.volume() == pytest.approx(np.pi * KEY_RADIUS**2 * 74, rel=0.02)
    middle = np.mean(np.split(np.array(key.solid.bounding_box()), 2), axis=0)
    assert middle == pytest.approx([3.0, 4.0, 5.0] - (5 + 37) * np.array(along), abs=0.3)


@pytest.mark.parametrize(
    ("near", "low", "high", "reached"),
    [
        (KEY_RADIUS + 0.1, 5, 90, True),
        (KEY_RADIUS - 0.3, 5, 90, False),
        (-2.0, KEY_END + 0.2, 90, True),
        (-2.0, 33, 41, False),
        (-2.0, 35, 41, True),
    ],
)
def test_a_wall_in_the_way(near: float, low: float, high: float, reached: bool) -> None:
    assert unreached(wall(near, low, high)) == ("" if reached else "M5x16_1 behind wall")


def test_the_short_arm_needs_room_for_the_long_one_to_turn() -> None:
    """A roof at 40 mm stops the long arm; a tube up to it stops the short one, too."""
    roof = {"roof": box(-90, -90, 40, 90, 90, 50)}
    assert unreached(roof) == ""
    assert unreached(roof | {"tube": hood(0, 39, 12)}) == "M5x16_1 behind roof"
    assert unreached(roof | {"tube": hood(0, 25, 12)}) == ""
    assert unreached({"tube": hood(0, 39, 12)}) == ""


def test_what_is_mounted_later_is_not_in_the_way() -> None:
    later = {"one": ("plate", "M5x16_1"), "two": ("wall",)}
    assert unreached(wall(-2, 10, 50), later) == ""
    earlier = {"one": ("plate", "wall"), "two": ("M5x16_1",)}
    assert unreached(wall(-2, 10, 50), earlier) == "M5x16_1 behind wall"


def test_a_base_that_turns_out_of_the_way() -> None:
    """A wall of 5 mm at 20 mm height leaves the key after some degrees; a wide one does not."""
    joined = {"one": ("plate", "wall", "shaft"), "two": ("M5x16_1",)}
    shaft = {"shaft": box(90, 0, 0, 91, 1, 1)}
    wide = {"wall": box(-50, -100, 20, 50, 100, 25)}
    assert unreached(wall(-2, 20, 25) | shaft, joined, ("wall",)) == ""
    assert unreached(wall(-2, 20, 25) | shaft, joined) == "M5x16_1 behind wall"
    behind = unreached(wide | shaft, joined, ("wall",))
    assert behind == "M5x16_1 behind wall at every base angle"


def test_the_base_is_not_there_before_its_shaft() -> None:
    wide = {"wall": box(-50, -100, 20, 50, 100, 25), "shaft": box(90, 0, 0, 91, 1, 1)}
    steps = {"one": ("plate", "wall", "disc", "JOINT_1"), "two": ("M5x16_1",), "three": ("shaft",)}
    joint = screw(name="JOINT_1", part="DOWEL-3x16", through=["wall", "disc"], turns=True)
    assert unreached(wide, steps, ("wall",), joint) == ""
    later = {"one": steps["one"], "two": ("shaft", "M5x16_1")}
    behind = "M5x16_1 behind wall at every base angle"
    assert unreached(wide, later, ("wall",), joint) == behind


def test_screws_of_one_step_need_an_order() -> None:
    assert [*key_access.without_order({"a": ["b", "c"], "b": ["c"], "c": []})] == []
    (fault,) = key_access.without_order({"a": ["b"], "b": ["c"], "c": ["a"]})
    assert "behind each other" in fault


@pytest.mark.parametrize(
    ("steps", "fault"),
    [
        ({"one": ("plate",)}, "M5x16_1 is in no step"),
        ({"one": ("M5x16_1",), "two": ("plate",)}, "M5x16_1 is mounted before plate"),
    ],
)
def test_steps_in_disorder(steps: dict[str, tuple[str, ...]], fault: str) -> None:
    assert fault in unreached({}, steps)
