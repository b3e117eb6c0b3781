"""The base in numbers: seats, cross-section, hub, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.geometry.vectors import dot, norm
from tbcad.mirrors.array import MirrorDesign
from tbcad.optics.ball_light import light_hulls
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.base.hub import hub_layout
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.layout import _sector as sector
from tbcad.prototype.base.profile import (
    LightSpheroid,
    distance_outside,
    hull,
    offset,
    thinned,
    trimmed,
)
from tbcad.prototype.base.seats import OFF_PATH_MM, insertion_clearance, seat_layout
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec
from tbcad.spec.prototype import BaseSpec

KEYS = BaseSpec()


def keys(**changed: object) -> BaseSpec:
    return BaseSpec.model_validate(KEYS.model_dump() | changed)


@pytest.fixture(scope="module")
def whole(paper_prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(KEYS, paper_prototype)


class TestSeats:
    def test_pads_are_tangent_to_the_bodies(
        self, whole: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        seat = whole.seats
        away = dot(seat.contacts - paper_prototype.body_centres()[:, None], seat.pad_normals)
        assert np.abs(away + paper_prototype.balls.body_radius[:, None]).max() < 1e-9
        assert np.abs(norm(seat.pad_normals) - 1).max() < 1e-12

    def test_pads_stand_at_the_angle_of_the_spec_a_third_of_a_turn_apart(
        self, whole: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        normal = whole.seats.pad_normals
        tilt = dot(normal, paper_prototype.normals()[:, None])
        assert np.degrees(np.arccos(tilt)) == pytest.approx(np.full(tilt.shape, 50.0))
        pairs = dot(normal, np.roll(normal, 1, axis=1))
        apart = np.cos(np.radians(50)) ** 2 - np.sin(np.radians(50)) ** 2 / 2
        assert pairs == pytest.approx(np.full(pairs.shape, apart))

    def test_frames_are_right_handed_and_their_first_row_points_to_the_camera(
        self, whole: BaseLayout
    ) -> None:
        axes = whole.seats.axes
        assert np.linalg.det(axes) == pytest.approx(np.ones(len(axes)))
        assert (axes[:, 0] @ whole.frame[0] > 0).all()

    def test_magnets_do_not_touch(self, whole: BaseLayout) -> None:
        seat = whole.seats
        top = seat.bottom - KEYS.magnet_height_mm
        assert top - seat.radius == pytest.approx(np.full(len(seat), KEYS.magnet_gap_mm))
        pads = seat.radius * np.sin(seat.tilt) - seat.pad * np.cos(seat.tilt)
        assert (seat.pocket < pads).all()

    def test_glue_needs_no_magnet(self, prototype: PrototypeLayout) -> None:
        seat = seat_layout(keys(hold="glue"), prototype)
        assert (seat.magnet == 0).all()
        assert seat.bottom == pytest.approx(seat.radius + KEYS.magnet_gap_mm)

    def test_balls_go_in_past_the_pads_of_others(self, whole: BaseLayout) -> None:
        assert insertion_clearance(whole.seats).min() > OFF_PATH_MM

    def test_a_ball_that_cannot_go_in_straight_goes_in_at_a_slant(
        self, paper_design: MirrorDesign
    ) -> None:
        prototype = prototype_layout(load_spec(None, ["prototype.k=10"]), paper_design)
        seat = seat_layout(KEYS, prototype)
        slant = np.degrees(
            np.arccos(np.clip(-dot(seat.insertion, seat.axis) / norm(seat.insertion), -1, 1))
        )
        assert 5 < slant.max() < 21
        # On its way out it leaves its own pads.
        assert dot(seat.insertion[:, None], seat.pad_normals).min() > 0
        assert insertion_clearance(seat).min() > OFF_PATH_MM


class TestLight:
    def test_all_light_is_within_the_level(
        self, whole: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        random = np.random.default_rng(1)
        for cone in light_hulls(paper_prototype.balls.outline, whole.light.pinhole, 30.0):
            share = random.random((len(cone), 500, 1))
            middle = cone.start[:, None] + share * (cone.end - cone.start)[:, None]
            reach = cone.start_radius[:, None] * (1 - share[..., 0])
            reach = reach + cone.end_radius[:, None] * share[..., 0]
            turn = 2 * np.pi * random.random(reach.shape)
            rim = reach[..., None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
            assert whole.light.excess(middle + rim).max() <= -2 * KEYS.light_clearance_mm + 1e-9

    def test_the_wall_is_beyond_it(self, whole: BaseLayout) -> None:
        parts = np.stack([whole.inner[:-1], whole.inner[1:]], axis=1)
        assert whole.light.min_excess(parts).min() >= 0

    def test_the_bound_of_a_facet_is_below_all_of_it(self) -> None:
        random, region = np.random.default_rng(2), LightSpheroid(140.0, 250.0)
        facets = random.normal(size=(200, 3, 3)) * 100
        weights = random.dirichlet([1, 1, 1], size=(200, 40))
        inside = region.excess(weights @ facets).min(axis=1)
        assert (region.min_excess(facets) <= inside + 1e-9).all()

    def test_a_boss_in_the_light_is_refused(self, prototype: PrototypeLayout) -> None:
        with pytest.raises(SpecError, match=r"into the light: make prototype\.base\.pad_angle_deg"):
            base_layout(keys(light_clearance_mm=12.0), prototype)


class TestProfile:
    def test_hull(self) -> None:
        points = np.array([[0, 0], [1, 2], [2, 2.5], [3, 0], [1.5, 1]], dtype=float)
        assert hull(points).tolist() == [[0, 0], [1, 2], [2, 2.5], [3, 0]]

    def test_offset_lines_keep_their_distance(self, whole: BaseLayout) -> None:
        away = distance_outside(whole.inner, offset(whole.inner, 5.0))
        assert away == pytest.approx(np.full(len(away), 5.0))

    def test_thinned_lines_go_round(self) -> None:
        line = np.array([[0, 0], [2, 4], [2.5, 4.6], [6, 7], [12, 7]], dtype=float)
        short = thinned(line, 2.0)
        assert len(short) == 4
        assert distance_outside(short, line).max() <= 1e-12
        assert short[[0, -1]].tolist() == line[[0, -1]].tolist()

    def test_trimmed_and_prolonged(self) -> None:
        line = np.array([[0, 0], [2, 4], [6, 6]], dtype=float)
        assert trimmed(line, 4.0).tolist() == [[0, 0], [2, 4], [4, 5]]
        assert trimmed(line, 8.0).tolist() == [[0, 0], [2, 4], [8, 7]]

    def test_bosses_begin_inside_and_end_outside_of_the_wall(self, whole: BaseLayout) -> None:
        seat, frame = whole.seats, whole.frame
        for length, sign in ((seat.front, -1), (seat.back, 1)):
            for side in (-1, 1):
                point = seat.centre + length[:, None] * seat.axis
                point = (point + side * seat.boss[:, None] * seat.axes[:, 0]) @ frame.T
                at = np.stack([point[:, 0], norm(point[:, 1:])], axis=1)
                line = whole.inner if sign < 0 else whole.outer
                assert (sign * distance_outside(line, at)).min() > -1e-9

    def test_the_sector_holds_all_bosses(
        self, whole: BaseLayout, paper_prototype: PrototypeLayout
    ) -> None:
        low, high = whole.sector
        azimuth = paper_prototype.placement.azimuth
        assert low < azimuth.min() < azimuth.max() < high
        assert (
            whole.outermost(paper_prototype.placement.swing) > paper_prototype.placement.outermost
        )
        assert whole.outermost(paper_prototype.placement.swing) < np.radians(160)
        assert len(whole.ribs) == KEYS.ribs
        assert (np.diff(whole.ribs) > 0).all()


class TestHub:
    def test_it_stands_beyond_the_light(self, whole: BaseLayout) -> None:
        held = whole.hub
        assert whole.light.excess(np.array([held.front, 0.0])) >= 0
        assert held.front > held.back > held.face == whole.hub.face

    @pytest.mark.parametrize(
        ("drive", "circle", "hole"),
        [("nema17-belt", 28.0, 4.0), ("nema17-direct", 16.0, 4.0), ("stage-60", 50.0, 6.6)],
    )
    def test_patterns(self, drive: str, circle: float, hole: float) -> None:
        held = hub_layout(keys(drive=drive), -60.0)
        assert norm(held.holes) == pytest.approx(np.full(4, circle / 2))
        assert held.hole == hole
        assert held.disc > circle / 2 + hole / 2 + 2
        assert held.source

    def test_a_shaft_too_thick(self) -> None:
        with pytest.raises(SpecError, match=r"prototype.base.shaft_mm 9 or less"):
            hub_layout(keys(drive="nema17-direct", shaft_mm=12.0), -60.0)


class TestRefused:
    @pytest.mark.parametrize(
        ("changed", "text"),
        [
            ({"pad_angle_deg": 70.0, "pad_mm": 8.0}, "would close round it: make"),
            ({"clearance_mm": 0.1, "pad_mm": 6.0}, "do not stand out of its cup: make"),
            ({"magnets_mm": [40.0]}, "no magnet fits between the pads of ball 1: add one of"),
        ],
    )
    def test_seats(self, prototype: PrototypeLayout, changed: dict[str, object], text: str) -> None:
        with pytest.raises(SpecError, match=text):
            base_layout(keys(**changed), prototype)

    def test_pads_in_the_way_of_other_balls(self, prototype: PrototypeLayout) -> None:
        close = replace(prototype.placement, azimuth=prototype.placement.azimuth * 0)
        small = replace(
            prototype.balls.poses,
            apex=prototype.balls.poses.apex * 0 + prototype.balls.poses.apex[:1],
        )
        crowded = replace(prototype, placement=close, balls=replace(prototype.balls, poses=small))
        with pytest.raises(SpecError, match="is where another ball is inserted"):
            seat_layout(KEYS, crowded)

    def test_a_ball_next_to_the_axis(self, prototype: PrototypeLayout) -> None:
        seat = seat_layout(KEYS, prototype)
        frame = prototype.half.ellipsoid.frame()
        near = replace(seat, centre=seat.centre @ frame.T * [1.0, 0.1, 0.1] @ frame)
        with pytest.raises(SpecError, match="is too near to the axis for its seat"):
            sector(KEYS, near, prototype)

    def test_balls_all_round_the_axis(self, prototype: PrototypeLayout) -> None:
        spread = replace(prototype.placement, azimuth=np.radians([-170.0, -60.0, 60.0, 170.0]))
        with pytest.raises(SpecError, match=r"would go 3\d\d degrees round its axis"):
            base_layout(KEYS, replace(prototype, placement=spread))
