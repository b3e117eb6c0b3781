"""How the base is cut for the bed: planes, holes, what is bought, and what is refused."""

import re

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.printer import PrinterSpec
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.joints import flange_profile
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.profile import distance_outside
from tbcad.prototype.base.screws import joint_hardware
from tbcad.prototype.base.split import BaseSplit, split_base
from tbcad.prototype.print_bed import min_bed, shortfall, usable_size
from tbcad.prototype.purchased.parts import load_parts

SPEC = BaseSpec()
DOWN = [np.array([0.0, 0.0, -1.0])]


def changed_spec(**changed: object) -> BaseSpec:
    return BaseSpec.model_validate(SPEC.model_dump() | changed)


def cube(size: float) -> PrinterSpec:
    return PrinterSpec(bed_mm=(size, size, size))


@pytest.fixture(scope="module", params=["small in two", "small in three", "paper in two"])
def cut(
    request: pytest.FixtureRequest,
    small_prototype: PrototypeLayout,
    paper_prototype: PrototypeLayout,
) -> tuple[BaseLayout, BaseSplit]:
    at = {
        "small in two": (small_prototype, 150.0),
        "small in three": (small_prototype, 127.0),
        "paper in two": (paper_prototype, 190.0),
    }
    chosen, bed = at[request.param]
    base = base_layout(SPEC, chosen)
    plan = split_base(base, cube(bed))
    assert len(plan.pieces) == (3 if "three" in request.param else 2)
    return base, plan


def rims(base: BaseLayout) -> np.ndarray:
    """Points round both ends of all bosses, (k, 2, n, 3)."""
    seats, angle = base.local_seats, np.linspace(0, 2 * np.pi, 90)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    around = seats.boss[:, None, None] * (circle @ seats.axes)
    ends = np.stack([seats.front, seats.back], axis=1)[..., None] * seats.axis[:, None]
    return (seats.centre[:, None] + ends)[:, :, None] + around[:, None]


@pytest.mark.slow
class TestPlanes:
    def test_a_base_that_fits_stays_whole(
        self, small_prototype: PrototypeLayout, paper_prototype: PrototypeLayout
    ) -> None:
        for one in (small_prototype, paper_prototype):
            plan = split_base(base_layout(SPEC, one), PrinterSpec())
            assert not plan.joints
            assert [len(piece) for piece in plan.pieces] == [0]

    def test_no_boss_and_no_way_of_a_ball_is_cut(self, cut: tuple[BaseLayout, BaseSplit]) -> None:
        base, plan = cut
        corners = rims(base).reshape(len(base.seats), -1, 3)
        for joint in plan.joints:
            inside = (corners @ joint.region[:, :3].T <= joint.region[:, 3]).all(axis=(1, 2))
            distance = joint.plane.height(corners[inside])
            assert ((distance.min(axis=1) > 0.99) | (distance.max(axis=1) < -0.99)).all()
            assert (distance.min(axis=1) > 0).any()
            assert (distance.max(axis=1) < 0).any()

    def test_the_hub_is_whole_in_the_first_piece(self, cut: tuple[BaseLayout, BaseSplit]) -> None:
        base, plan = cut
        hub, angle = base.hub, np.linspace(0, 2 * np.pi, 60)
        for z in (hub.face, hub.front):
            rim = np.stack([hub.disc * np.cos(angle), hub.disc * np.sin(angle), 0 * angle + z], 1)
            assert {plan.piece_of(point) for point in rim} == {0}

    def test_pieces_fill_space_once(self, cut: tuple[BaseLayout, BaseSplit]) -> None:
        points = np.random.default_rng(1).normal(size=(3000, 3)) * 150
        inside = [(points @ one[:, :3].T < one[:, 3]).all(axis=1) for one in cut[1].pieces]
        assert (np.sum(inside, axis=0) == 1).all()
        assert all(one.any() for one in inside)

    def test_a_bed_too_small_names_one_that_does(self, small_prototype: PrototypeLayout) -> None:
        with pytest.raises(SpecError, match=r"make printer\.bed_mm at least") as caught:
            split_base(base_layout(SPEC, small_prototype), PrinterSpec(bed_mm=(135.0, 135.0, 60.0)))
        (bed,) = re.findall(r"least (\d+) x (\d+) x (\d+)", str(caught.value))
        width, depth, height = map(float, bed)
        larger = PrinterSpec(bed_mm=(width, depth, height))
        assert len(split_base(base_layout(SPEC, small_prototype), larger).pieces) == 2


class TestJoints:
    def test_two_dowels_and_two_screws_or_more(self, cut: tuple[BaseLayout, BaseSplit]) -> None:
        for joint in cut[1].joints:
            assert len(joint.dowels) == 2
            assert len(joint.screws) >= 2
            places = np.vstack([joint.dowels, joint.screws])
            assert np.abs(joint.plane.height(places)).max() < 1e-9
            apart = norm(places[:, None] - places) + 99 * np.eye(len(places))
            assert apart.min() >= 8.0
            assert norm(joint.dowels[1] - joint.dowels[0]) > 40

    def test_holes_are_in_the_flanges_and_off_all_seats(
        self, cut: tuple[BaseLayout, BaseSplit]
    ) -> None:
        base, plan = cut
        seat, used = base.local_seats, base.spec
        for joint in plan.joints:
            along = np.linspace(-used.joint_mm, used.joint_mm, 40)[:, None, None]
            axes = np.vstack([joint.dowels, joint.screws]) + along * joint.plane.normal
            at = np.stack([axes[..., 2], norm(axes[..., :2])], axis=-1)
            assert distance_outside(base.inner, at).min() > used.insert_hole_mm / 2 + 1
            balls = norm(axes[..., None, :] - seat.centre) - seat.cup
            assert balls.min() > used.insert_hole_mm / 2 + 1
            # And beside the magnets.
            offset = axes[..., None, :] - seat.centre
            deep = (offset * seat.axis).sum(axis=-1)
            beside = norm(offset - deep[..., None] * seat.axis) - seat.pocket
            assert (beside[(deep > 0) & (deep < seat.back)] > used.insert_hole_mm / 2 + 1).all()

    def test_heads_are_reached_from_outside(self, cut: tuple[BaseLayout, BaseSplit]) -> None:
        base, plan = cut
        free = joint_hardware(base.spec).access_radius
        assert free > 5.5 / 2
        for joint in plan.joints:
            for place, side in zip(joint.screws, joint.heads, strict=True):
                steps = base.spec.joint_mm + np.linspace(0, 25, 60)
                axis = place + side * steps[:, None] * joint.plane.normal
                at = np.stack([axis[:, 2], norm(axis[:, :2])], axis=-1)
                assert distance_outside(base.outer, at).min() > 5.5 / 2
                for rim, up in zip(rims(base), base.local_seats.axis, strict=True):
                    ends = rim.mean(axis=1)
                    deep = np.clip((axis - ends[0]) @ up, 0, (ends[1] - ends[0]) @ up)
                    distance = norm(axis - ends[0] - deep[:, None] * up)
                    assert distance.min() > norm(rim[0, 0] - ends[0]) + 5.5 / 2 - 0.1

    def test_flanges_are_behind_the_light(self, cut: tuple[BaseLayout, BaseSplit]) -> None:
        base, _ = cut
        line = flange_profile(base)
        parts = np.stack([line, np.roll(line, -1, axis=0)], axis=1)
        assert base.light.min_excess(parts).min() > 0
        assert line[:, 1].min() > base.hub.disc

    def test_sizes_are_in_the_lists(self) -> None:
        hardware, parts = joint_hardware(SPEC), load_parts()
        assert parts[hardware.dowel].sizes == (3.0, 12.0)
        assert hardware.dowel_depth + 1 <= SPEC.joint_mm
        length = parts[hardware.screw].sizes[1]
        # 1.3 diameters in the insert, and not through its hole.
        assert 1.3 * 3 <= length - SPEC.joint_mm <= SPEC.insert_depth_mm

    @pytest.mark.parametrize(
        ("changed", "text"),
        [
            ({"joint_mm": 6.0}, r"prototype\.base\.joint_mm at least 7\.2"),
            ({"dowel_mm": 5.0}, r"no dowel of 5 mm is at most 13 mm long"),
            ({"joint_mm": 27.0}, r"no M3 screw is 31 to 33\.2 mm long"),
        ],
    )
    def test_refused(
        self, small_prototype: PrototypeLayout, changed: dict[str, object], text: str
    ) -> None:
        with pytest.raises(SpecError, match=text):
            split_base(base_layout(changed_spec(**changed), small_prototype), cube(150.0))


class TestBed:
    def test_a_box(self) -> None:
        corners = np.array(np.meshgrid([0, 100], [0, 50], [0, 20]), dtype=float).reshape(3, -1).T
        exact = PrinterSpec(bed_mm=(100.0, 50.0, 20.0), bed_margin_mm=0.0)
        assert shortfall(corners, DOWN, exact) == pytest.approx(0.4)
        assert min_bed(corners, DOWN, exact).tolist() == [101, 51, 21]
        assert usable_size(PrinterSpec()).tolist() == pytest.approx([249.6, 249.6, 252.6])

    def test_it_is_turned_to_fit(self) -> None:
        corners = np.array([[0, 0, 0], [0, 120, 0], [10, 0, 0], [10, 120, 0]], dtype=float)
        assert shortfall(corners, DOWN, cube(100.0)) <= 0
        assert shortfall(corners * 1.3, DOWN, cube(100.0)) > 0
