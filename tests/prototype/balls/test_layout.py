"""The prototype of the paper's design, and what is refused."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.mirrors.array import design as mirror_design
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.prototype.balls.layout import (
    MORE_BALLS,
    BallFit,
    PrototypeLayout,
    ball_counts,
    ball_fit,
    prototype_layout,
)
from tbcad.prototype.balls.placement import greedy_placement, min_swing_placement
from tbcad.prototype.balls.selection import (
    COVERAGE_ROUNDING_MM,
    BallCandidates,
    Balls,
    ball_candidates,
    choose_balls,
    coverable,
)
from tbcad.prototype.balls.stops import plan_stops, stop_requests
from tests.prototype.conftest import PAPER

LIMITS = PAPER.prototype
DEGREE = np.radians(1)


@pytest.fixture(scope="module")
def prototype(paper_prototype: PrototypeLayout) -> PrototypeLayout:
    return paper_prototype


@pytest.fixture(scope="module")
def candidates(prototype: PrototypeLayout) -> BallCandidates:
    return ball_candidates(prototype.array, prototype.groups, 60.0)


def small(design: MirrorDesign, *options: str) -> PrototypeLayout:
    return prototype_layout(load_spec(None, ["n=6", *options]), design)


class TestBalls:
    def test_all_mirrors_show_the_whole_target_and_the_next_larger_ball_would_not(
        self, prototype: PrototypeLayout, candidates: BallCandidates
    ) -> None:
        assert prototype.fit.coverage.min() >= 60 + LIMITS.ball_margin_mm - COVERAGE_ROUNDING_MM
        assert coverable(candidates, prototype.balls.catalogue, moved=True).all()
        balls, catalogue = prototype.balls, prototype.balls.catalogue
        next_size = np.minimum(balls.stock + 1, len(catalogue) - 1)
        larger = np.where(balls.cap, balls.radius + 0.11, catalogue.diameter[next_size] / 2)
        shown = prototype.groups.minimum(candidates.coverage(larger, moved=True))
        assert (shown < 60 + LIMITS.ball_margin_mm).all()
        beyond = balls.radius > 30
        assert (balls.cap == beyond).all()
        assert 0 < beyond.sum() < 5
        assert (balls.mass_g[beyond] == 0).all()
        assert balls.size[0].startswith("cap R 4")
        # A cap's edge lies on its front and on its ball.
        edge = balls.used_radius[beyond] + LIMITS.cap_rim_mm
        drop = balls.radius[beyond] - np.sqrt(balls.radius[beyond] ** 2 - edge**2)
        on_ball = np.hypot(edge, balls.body_depth[beyond] - drop)
        assert on_ball == pytest.approx(balls.body_radius[beyond])

    def test_a_margin_is_shown_besides(self, small_design: MirrorDesign) -> None:
        # As many balls for both: more would show more.
        plain, made = (
            small(small_design, "prototype.k=8", f"ball_margin_mm={margin}") for margin in (0, 1.5)
        )
        assert 60 < plain.fit.coverage.min() < 61.5 < made.fit.coverage.min()
        # Pixels are still those that see the capture sphere itself.
        assert made.fit.pixels_shell.tolist() == plain.fit.pixels_shell.tolist()
        assert 0.9 < made.fit.pixels.sum() / plain.fit.pixels.sum() < 1

    def test_other_rules(self, prototype: PrototypeLayout, candidates: BallCandidates) -> None:
        """Without caps, of the nearest sizes, and with pictures left in place: tiny balls."""
        catalogue, groups = prototype.balls.catalogue, prototype.groups

        def fitted(**rule: object) -> tuple[Balls, BallFit]:
            limits = LIMITS.model_copy(update=rule)
            balls = choose_balls(candidates, limits, catalogue)
            return balls, ball_fit(candidates, balls, prototype.fit.pixels_shell)

        balls, _ = fitted(caps="none")
        assert balls.radius.max() == 30
        assert not balls.cap.any()
        balls, fit = fitted(snap="nearest")
        distance = np.abs(catalogue.diameter / 2 - groups.radius[:, None]).min(axis=1)
        off = np.abs(balls.radius - groups.radius)
        assert off[~balls.cap] == pytest.approx(distance[~balls.cap])
        assert fit.coverage.min() < 60
        _, fit = fitted(picture="fixed")
        seen = coverable(candidates, catalogue, moved=False)
        assert not seen.all()
        assert (fit.coverage_fixed[seen] >= 60 - COVERAGE_ROUNDING_MM).all()
        assert fit.kept_share < 0.05

    def test_cost_of_each_choice(self, small_design: MirrorDesign) -> None:
        prototype = small(small_design)
        rows = {row.name: row for row in prototype.alternatives}
        own, bare = rows["cover, with caps"], rows["cover, balls only"]
        assert own.pixels_kept_share == pytest.approx(prototype.fit.kept_share)
        assert own.mirrors_below_target == 0
        assert bare.pixels_kept_share < own.pixels_kept_share
        assert rows["nearest, with caps"].mirrors_below_target > 10


class TestPlaces:
    def test_apices_stay_on_the_ellipsoid_and_balls_a_wall_apart(
        self, prototype: PrototypeLayout
    ) -> None:
        apex, pinhole = prototype.apices(0.3), prototype.array.camera.pinhole
        both = np.full(len(prototype), 2 * prototype.array.ellipsoid.semi_major)
        assert norm(apex) + norm(apex - pinhole) == pytest.approx(both)
        behind = prototype.balls.radius[:, None] * prototype.normals(0.3)
        assert prototype.centres(0.3) == pytest.approx(apex - behind)
        centre, radius = prototype.body_centres(), prototype.balls.body_radius
        gap = norm(centre[:, None] - centre) - radius[:, None] - radius
        np.fill_diagonal(gap, np.inf)
        assert 0 < gap.min() - LIMITS.ball_wall_mm < 0.05  # and are no farther than they must

    def test_swing_is_the_minimum_less_than_greedy_and_outermost_that_of_the_edges(
        self, prototype: PrototypeLayout
    ) -> None:
        placement, frame, far = prototype.placement, prototype.array.ellipsoid.frame(), 0.0
        assert placement.swing_bound == pytest.approx(placement.swing, abs=1e-3)
        assert placement.swing < greedy_placement(prototype.problem).swing - DEGREE
        assert placement.swing / DEGREE < 205
        for angle in (-placement.swing / 2, placement.swing / 2):
            _, out, across = (prototype.body_centres(angle) @ frame.T).T
            reach = prototype.balls.body_radius + LIMITS.ball_wall_mm
            half = np.arcsin(reach / np.hypot(out, across))
            far = max(far, (np.abs(np.arctan2(across, out)) + half).max())
        assert placement.outermost == pytest.approx(far, abs=1e-6)


class TestStops:
    def test_every_mirror_is_served_within_the_limit(self, prototype: PrototypeLayout) -> None:
        stops, ball = prototype.stops, prototype.fit.ball
        sine = np.sin(np.abs(stops.azimuth_error) / 2) * np.sin(prototype.groups.polar[ball])
        assert np.degrees(2 * np.arcsin(sine)).max() <= LIMITS.stop_error_deg + 1e-9
        counts = [len(stops.mirrors(i)) for i in range(len(stops))]
        assert sum(counts) == len(prototype.array)
        assert min(counts) > 0
        for i in range(0, len(prototype.array), 50):  # errors are those of the balls themselves
            apex = prototype.apices(stops.angle[stops.stop[i]])[ball[i]]
            angle = np.arccos(np.clip(unit(apex) @ prototype.array.u[i], -1, 1))
            assert stops.error[i] == pytest.approx(angle, abs=1e-7)

    def test_freed_azimuths_need_fewer_than_those_of_the_swing_alone(
        self, prototype: PrototypeLayout
    ) -> None:
        groups, array = prototype.groups, prototype.array
        requests = stop_requests(groups, array.azimuth, np.radians(LIMITS.stop_error_deg))
        azimuth = min_swing_placement(prototype.problem).azimuth
        other = plan_stops(groups, array.polar, requests, azimuth)
        assert len(prototype.stops) < len(other)


class TestAsked:
    def test_auto_is_the_minimum_number_within_the_limits(self, small_design: MirrorDesign) -> None:
        auto = small(small_design, "prototype.k=auto")
        limits = small_design.spec.prototype

        def within(k: int) -> bool:
            layout = small(small_design, f"prototype.k={k}")
            error = np.degrees(np.abs(layout.stops.polar_error))
            return bool(
                error.max() <= limits.auto_direction_max_deg
                and np.median(error) <= limits.auto_direction_median_deg
                and 100 * (1 - layout.fit.kept_share) <= limits.auto_lost_percent
            )

        assert within(len(auto))
        assert not within(len(auto) - 1)

    def test_auto_tries_more_balls_than_needed_and_then_fewer(
        self, small_design: MirrorDesign
    ) -> None:
        """Where the limits cannot be kept: all from many down to one, each once."""
        options = ["n=6", "auto_direction_max_deg=1e-9", "caps=false", "grade=G3"]
        counts = list(ball_counts(load_spec(None, options), small_design))
        assert counts == list(range(len(counts), 0, -1))
        counts = list(ball_counts(small_design.spec, small_design))
        assert sorted(counts) == list(range(1, counts[0] + MORE_BALLS + 1))
        assert counts[: MORE_BALLS + 1] == sorted(counts[: MORE_BALLS + 1])


class TestRefused:
    def test_what_cannot_be_built(self, small_design: MirrorDesign) -> None:
        cases = (
            ("prototype.k is 104, but camera a has 103 mirrors", "prototype.k=104"),
            (
                "found no place for 16 balls on one base within a swing of 150",
                *("prototype.k=16", "max_swing_deg=150"),
            ),
            ("camera_diameter_mm smaller", "camera_diameter_mm=500", "camera_length_mm=1000"),
            ("no ball of grade G20 up to 0.9 mm", "largest_ball_mm=0.9"),
        )
        for message, *options in cases:
            with pytest.raises(SpecError, match=message):
                small(small_design, *options)
        spec = load_spec(None, ["n=4", "radius_rule=flat"])
        with pytest.raises(SpecError, match=r"needs curved mirrors.*traced or paper"):
            prototype_layout(spec, mirror_design(spec))
