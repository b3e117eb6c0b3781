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
from tbcad.prototype.base.profile import LightSpheroid, distance_outside
from tbcad.prototype.base.seats import OFF_PATH_MM, insertion_clearance, seat_layout, thin_rims
from tests.prototype.conftest import HEAVY

SPEC = BaseSpec()


def changed_spec(**changed: object) -> BaseSpec:
    return BaseSpec.model_validate(SPEC.model_dump() | changed)


@pytest.fixture(scope="module")
def base(paper_prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(SPEC, paper_prototype)


class TestSeats:
    def test_pads_are_tangent_a_third_of_a_turn_apart_at_the_angle_of_the_spec(
        self, base: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        seats, normal = base.seats, base.seats.pad_normals
        distance = dot(seats.contacts - paper_prototype.body_centres()[:, None], normal)
        assert np.abs(distance + paper_prototype.balls.body_radius[:, None]).max() < 1e-9
        assert np.abs(norm(normal) - 1).max() < 1e-12
        tilt = dot(normal, paper_prototype.normals()[:, None])
        assert np.degrees(np.arccos(tilt)) == pytest.approx(np.full(tilt.shape, 50.0))
        pairs = dot(normal, np.roll(normal, 1, axis=1))
        apart = np.cos(np.radians(50)) ** 2 - np.sin(np.radians(50)) ** 2 / 2
        assert pairs == pytest.approx(np.full(pairs.shape, apart))
        # Frames are right-handed and their first row points to the camera.
        assert np.linalg.det(seats.axes) == pytest.approx(np.ones(len(seats)))
        assert (seats.axes[:, 0] @ base.frame[0] > 0).all()

    def test_magnets_do_not_touch_and_glue_needs_none(
        self, base: BaseLayout, small_prototype: PrototypeLayout
    ) -> None:
        seats = base.seats
        top = seats.bottom - seats.magnet_height
        assert top - seats.radius == pytest.approx(np.full(len(seats), SPEC.magnet_gap_mm))
        pads = seats.radius * np.sin(seats.tilt) - seats.pad * np.cos(seats.tilt)
        assert (seats.pocket < pads).all()
        glued = seat_layout(changed_spec(hold="glue"), small_prototype)
        assert (glued.magnet == 0).all()
        assert glued.bottom == pytest.approx(glued.radius + SPEC.magnet_gap_mm)

    def test_balls_go_in_past_the_pads_of_others_at_a_slant_where_they_must(
        self, base: BaseLayout, paper_design: MirrorDesign
    ) -> None:
        assert insertion_clearance(base.seats).min() > OFF_PATH_MM
        assert not thin_rims(base.seats).any()
        ten = prototype_layout(
            load_spec(None, ["prototype.k=10", "prototype.ball_margin_mm=0", *HEAVY]), paper_design
        )
        seats = seat_layout(SPEC, ten)
        cosine = -dot(seats.insertion, seats.axis) / norm(seats.insertion)
        assert 5 < np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 31
        # On its path out a ball leaves its own pads.
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
        assert len(base.ribs) == SPEC.ribs
        assert (np.diff(base.ribs) > 0).all()


class TestHub:
    def test_it_is_as_near_to_the_light_as_it_may_be(self, base: BaseLayout) -> None:
        hub, behind = base.hub, base.light.pinhole / 2 - base.light.level / 2
        assert hub.front == pytest.approx(behind - SPEC.light_clearance_mm)
        assert base.light.excess(np.array([hub.front, 0.0])) >= 0
        assert hub.front > hub.back > hub.face

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

    def test_patterns(self) -> None:
        for drive, circle, hole in (
            ("nema17-belt", 28.0, 4.0),
            ("nema17-direct", 16.0, 4.0),
            ("stage-60", 50.0, 6.6),
        ):
            hub = hub_layout(changed_spec(drive=drive), -60.0)
            assert norm(hub.holes) == pytest.approx(np.full(4, circle / 2))
            assert hub.hole == hole
            assert hub.disc > circle / 2 + hole / 2 + 2
        with pytest.raises(SpecError, match=r"prototype.base.shaft_mm 9 or less"):
            hub_layout(changed_spec(drive="nema17-direct", shaft_mm=12.0), -60.0)

    def test_a_disc_on_a_stage_is_so_thick_that_seats_end_before_its_face(
        self, small_prototype: PrototypeLayout
    ) -> None:
        """The zero disc lies on that face, and is wider than the hub."""
        thin, thick = (
            base_layout(
                changed_spec(drive="stage-60", hold="glue", floor_mm=floor, rib_height_mm=8.0),
                small_prototype,
            )
            for floor in (2.0, 20.0)
        )
        assert thick.rearmost < thin.hub.face < thin.rearmost
        assert thick.hub.face < thick.rearmost
        assert thick.hub.depth == pytest.approx(thick.hub.front - thick.hub.face)
        below_heads = [base.hub.depth - base.hub.head[1] for base in (thin, thick)]
        assert below_heads == pytest.approx([6.0, 6.0])


class TestRefused:
    def test_seats_and_bosses(self, small_prototype: PrototypeLayout) -> None:
        cases: dict[str, dict[str, object]] = {
            "would close round it: make": {"pad_angle_deg": 70.0, "pad_mm": 8.0},
            "do not stand out of its cup: make": {"clearance_mm": 0.1, "pad_mm": 6.0},
            "no magnet fits between the pads of ball 1: add one of": {"magnets_mm": [40.0]},
            r"into the light: make prototype\.base\.pad_angle_deg": {"light_clearance_mm": 12.0},
        }
        for text, changed in cases.items():
            with pytest.raises(SpecError, match=text):
                base_layout(changed_spec(**changed), small_prototype)

    def test_balls_in_the_way_of_others_next_to_the_axis_and_all_round_it(
        self, small_prototype: PrototypeLayout
    ) -> None:
        placement, balls = small_prototype.placement, small_prototype.balls
        apex = balls.poses.apex * 0 + balls.poses.apex[:1]
        same = replace(balls, poses=replace(balls.poses, apex=apex))
        close = replace(placement, azimuth=placement.azimuth * 0)
        with pytest.raises(SpecError, match="is where another ball is inserted"):
            seat_layout(SPEC, replace(small_prototype, placement=close, balls=same))
        seats, frame = seat_layout(SPEC, small_prototype), small_prototype.array.ellipsoid.frame()
        near = replace(seats, centre=seats.centre @ frame.T * [1.0, 0.1, 0.1] @ frame)
        with pytest.raises(SpecError, match="is too near to the axis for its seat"):
            sector(SPEC, near, small_prototype)
        spread = replace(placement, azimuth=np.radians([-170.0, -60.0, 60.0, 170.0]))
        with pytest.raises(SpecError, match=r"would go 3\d\d degrees round its axis"):
            base_layout(SPEC, replace(small_prototype, placement=spread))
