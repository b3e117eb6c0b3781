"""The base in numbers: seats, cross-section, hub, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.vectors import dot, norm
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.ball_light import light_hulls
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.base.hub import hub_layout
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.layout import _hub_front as hub_front
from tbcad.prototype.base.layout import _inner as inner_line
from tbcad.prototype.base.layout import _sector as sector
from tbcad.prototype.base.profile import (
    LightSpheroid,
    distance_outside,
)
from tbcad.prototype.base.seats import OFF_PATH_MM, insertion_clearance, seat_layout

SPEC = BaseSpec()


def changed_spec(**changed: object) -> BaseSpec:
    return BaseSpec.model_validate(SPEC.model_dump() | changed)


@pytest.fixture(scope="module")
def base(paper_prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(SPEC, paper_prototype)


class TestSeats:
    def test_pads_are_tangent_to_the_bodies(
        self, base: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        seats = base.seats
        distance = dot(seats.contacts - paper_prototype.body_centres()[:, None], seats.pad_normals)
        assert np.abs(distance + paper_prototype.balls.body_radius[:, None]).max() < 1e-9
        assert np.abs(norm(seats.pad_normals) - 1).max() < 1e-12

    def test_pads_stand_at_the_angle_of_the_spec_a_third_of_a_turn_apart(
        self, base: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        normal = base.seats.pad_normals
        tilt = dot(normal, paper_prototype.normals()[:, None])
        assert np.degrees(np.arccos(tilt)) == pytest.approx(np.full(tilt.shape, 50.0))
        pairs = dot(normal, np.roll(normal, 1, axis=1))
        apart = np.cos(np.radians(50)) ** 2 - np.sin(np.radians(50)) ** 2 / 2
        assert pairs == pytest.approx(np.full(pairs.shape, apart))

    def test_frames_are_right_handed_and_their_first_row_points_to_the_camera(
        self, base: BaseLayout
    ) -> None:
        axes = base.seats.axes
        assert np.linalg.det(axes) == pytest.approx(np.ones(len(axes)))
        assert (axes[:, 0] @ base.frame[0] > 0).all()

    def test_magnets_do_not_touch(self, base: BaseLayout) -> None:
        seats = base.seats
        top = seats.bottom - seats.magnet_height
        assert top - seats.radius == pytest.approx(np.full(len(seats), SPEC.magnet_gap_mm))
        pads = seats.radius * np.sin(seats.tilt) - seats.pad * np.cos(seats.tilt)
        assert (seats.pocket < pads).all()

    def test_glue_needs_no_magnet(self, small_prototype: PrototypeLayout) -> None:
        seats = seat_layout(changed_spec(hold="glue"), small_prototype)
        assert (seats.magnet == 0).all()
        assert seats.bottom == pytest.approx(seats.radius + SPEC.magnet_gap_mm)

    def test_balls_go_in_past_the_pads_of_others(self, base: BaseLayout) -> None:
        assert insertion_clearance(base.seats).min() > OFF_PATH_MM

    def test_a_ball_that_cannot_go_in_straight_goes_in_at_a_slant(
        self, paper_design: MirrorDesign
    ) -> None:
        small_prototype = prototype_layout(load_spec(None, ["prototype.k=10"]), paper_design)
        seats = seat_layout(SPEC, small_prototype)
        slant = np.degrees(
            np.arccos(np.clip(-dot(seats.insertion, seats.axis) / norm(seats.insertion), -1, 1))
        )
        assert 5 < slant.max() < 21
        # On its path out it leaves its own pads.
        assert dot(seats.insertion[:, None], seats.pad_normals).min() > 0
        assert insertion_clearance(seats).min() > OFF_PATH_MM


class TestLight:
    def test_all_light_is_within_the_level(
        self, base: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        random = np.random.default_rng(1)
        for cone in light_hulls(paper_prototype.balls.outline, base.light.pinhole, 30.0):
            share = random.random((len(cone), 500, 1))
            middle = cone.start[:, None] + share * (cone.end - cone.start)[:, None]
            reach = cone.start_radius[:, None] * (1 - share[..., 0])
            reach = reach + cone.end_radius[:, None] * share[..., 0]
            angle = 2 * np.pi * random.random(reach.shape)
            rim = reach[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            assert base.light.excess(middle + rim).max() <= -2 * SPEC.light_clearance_mm + 1e-9

    def test_the_wall_is_beyond_it(self, base: BaseLayout) -> None:
        parts = np.stack([base.inner[:-1], base.inner[1:]], axis=1)
        assert base.light.min_excess(parts).min() >= 0

    def test_the_bound_of_a_facet_is_below_all_of_it(self) -> None:
        random, region = np.random.default_rng(2), LightSpheroid(140.0, 250.0)
        facets = random.normal(size=(200, 3, 3)) * 100
        weights = random.dirichlet([1, 1, 1], size=(200, 40))
        inside = region.excess(weights @ facets).min(axis=1)
        assert (region.min_excess(facets) <= inside + 1e-9).all()

    def test_a_boss_in_the_light_is_refused(self, small_prototype: PrototypeLayout) -> None:
        with pytest.raises(SpecError, match=r"into the light: make prototype\.base\.pad_angle_deg"):
            base_layout(changed_spec(light_clearance_mm=12.0), small_prototype)


class TestProfile:
    def test_bosses_begin_inside_and_end_outside_of_the_wall(self, base: BaseLayout) -> None:
        seats, frame = base.seats, base.frame
        for length, sign in ((seats.front, -1), (seats.back, 1)):
            for side in (-1, 1):
                point = seats.centre + length[:, None] * seats.axis
                point = (point + side * seats.boss[:, None] * seats.axes[:, 0]) @ frame.T
                at = np.stack([point[:, 0], norm(point[:, 1:])], axis=1)
                line = base.inner if sign < 0 else base.outer
                assert (sign * distance_outside(line, at)).min() > -1e-9

    def test_the_sector_holds_all_bosses(
        self, base: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        low, high = base.sector
        azimuth = paper_prototype.placement.azimuth
        assert low < azimuth.min() < azimuth.max() < high
        assert base.outermost(paper_prototype.placement.swing) > paper_prototype.placement.outermost
        assert base.outermost(paper_prototype.placement.swing) < np.radians(160)
        assert len(base.ribs) == SPEC.ribs
        assert (np.diff(base.ribs) > 0).all()


class TestHub:
    def test_it_stands_beyond_the_light(self, base: BaseLayout) -> None:
        hub = base.hub
        assert base.light.excess(np.array([hub.front, 0.0])) >= 0
        assert hub.front > hub.back > hub.face

    def test_it_is_as_near_to_the_light_as_it_may_be(self, base: BaseLayout) -> None:
        behind = base.light.pinhole / 2 - base.light.level / 2
        assert base.hub.front == pytest.approx(behind - SPEC.light_clearance_mm)

    def test_it_begins_behind_a_ball_that_lies_behind_the_light(self, base: BaseLayout) -> None:
        """Such a ball's boss stood free of a wall that began at the hub before it."""
        along = base.seats.centre @ base.frame[0]
        last = int(along.argmin())
        centre = base.seats.centre.copy()
        centre[last] += (base.hub.front - 10.0 - along[last]) * base.frame[0]
        seats = replace(base.seats, centre=centre)
        hub = hub_layout(SPEC, hub_front(SPEC, seats, base.frame, base.light))
        assert hub.front < base.hub.front - 10.0
        line = inner_line(SPEC, seats, base.frame, base.light, hub)
        front = seats.at_depth(seats.front)[last] @ base.frame.T
        place = np.array([front[0], norm(front[1:])])
        assert distance_outside(line, place[None])[0] <= 0

    @pytest.mark.parametrize(
        ("drive", "circle", "hole"),
        [("nema17-belt", 28.0, 4.0), ("nema17-direct", 16.0, 4.0), ("stage-60", 50.0, 6.6)],
    )
    def test_patterns(self, drive: str, circle: float, hole: float) -> None:
        hub = hub_layout(changed_spec(drive=drive), -60.0)
        assert norm(hub.holes) == pytest.approx(np.full(4, circle / 2))
        assert hub.hole == hole
        assert hub.disc > circle / 2 + hole / 2 + 2

    def test_a_disc_on_a_stage_is_so_thick_that_seats_end_before_its_face(
        self, small_prototype: PrototypeLayout
    ) -> None:
        """The zero disc lies on that face, and is wider than the hub."""
        thin, thick = (
            base_layout(
                changed_spec(drive="stage-60", hold="glue", floor_mm=floor), small_prototype
            )
            for floor in (2.0, 20.0)
        )
        assert thick.rearmost < thin.hub.face < thin.rearmost
        assert thick.hub.face < thick.rearmost
        assert thick.hub.depth == pytest.approx(thick.hub.front - thick.hub.face)
        below_heads = [base.hub.depth - base.hub.head[1] for base in (thin, thick)]
        assert below_heads == pytest.approx([6.0, 6.0])

    def test_a_shaft_too_thick(self) -> None:
        with pytest.raises(SpecError, match=r"prototype.base.shaft_mm 9 or less"):
            hub_layout(changed_spec(drive="nema17-direct", shaft_mm=12.0), -60.0)


class TestRefused:
    @pytest.mark.parametrize(
        ("changed", "text"),
        [
            ({"pad_angle_deg": 70.0, "pad_mm": 8.0}, "would close round it: make"),
            ({"clearance_mm": 0.1, "pad_mm": 6.0}, "do not stand out of its cup: make"),
            ({"magnets_mm": [40.0]}, "no magnet fits between the pads of ball 1: add one of"),
        ],
    )
    def test_seats(
        self, small_prototype: PrototypeLayout, changed: dict[str, object], text: str
    ) -> None:
        with pytest.raises(SpecError, match=text):
            base_layout(changed_spec(**changed), small_prototype)

    def test_pads_in_the_way_of_other_balls(self, small_prototype: PrototypeLayout) -> None:
        close = replace(small_prototype.placement, azimuth=small_prototype.placement.azimuth * 0)
        small = replace(
            small_prototype.balls.poses,
            apex=small_prototype.balls.poses.apex * 0 + small_prototype.balls.poses.apex[:1],
        )
        crowded = replace(
            small_prototype, placement=close, balls=replace(small_prototype.balls, poses=small)
        )
        with pytest.raises(SpecError, match="is where another ball is inserted"):
            seat_layout(SPEC, crowded)

    def test_a_ball_next_to_the_axis(self, small_prototype: PrototypeLayout) -> None:
        seats = seat_layout(SPEC, small_prototype)
        frame = small_prototype.array.ellipsoid.frame()
        near = replace(seats, centre=seats.centre @ frame.T * [1.0, 0.1, 0.1] @ frame)
        with pytest.raises(SpecError, match="is too near to the axis for its seat"):
            sector(SPEC, near, small_prototype)

    def test_balls_all_round_the_axis(self, small_prototype: PrototypeLayout) -> None:
        spread = replace(
            small_prototype.placement, azimuth=np.radians([-170.0, -60.0, 60.0, 170.0])
        )
        with pytest.raises(SpecError, match=r"would go 3\d\d degrees round its axis"):
            base_layout(SPEC, replace(small_prototype, placement=spread))
