"""The prototype of the paper's design, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.mirrors.array import MirrorDesign, design
from tbcad.optics.reflection import reflected_rays
from tbcad.prototype.balls.alternatives import ball_alternatives
from tbcad.prototype.balls.layout import PrototypeLayout, planned_pictures, prototype_layout
from tbcad.prototype.balls.selection import (
    COVERAGE_ROUNDING_MM,
    BallCandidates,
    ball_candidates,
    ball_fit,
    choose_balls,
)
from tbcad.prototype.balls.stops import min_stabbing_points, plan_stops, stop_requests
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec

SPEC = load_spec(None)
KEYS = SPEC.prototype
DEGREE = np.radians(1)


@pytest.fixture(scope="module")
def made(paper_design: MirrorDesign) -> PrototypeLayout:
    return prototype_layout(SPEC, paper_design)


@pytest.fixture(scope="module")
def here(made: PrototypeLayout) -> BallCandidates:
    return ball_candidates(made.half, made.groups, 60.0)


def small(made: MirrorDesign, *options: str) -> PrototypeLayout:
    return prototype_layout(load_spec(None, ["n=6", *options]), made)


class TestBalls:
    def test_all_mirrors_show_the_whole_target(self, made: PrototypeLayout) -> None:
        assert made.fit.coverage.min() > 60
        assert made.fit.coverable.all()

    def test_the_next_larger_ball_would_not(
        self, made: PrototypeLayout, here: BallCandidates
    ) -> None:
        catalogue, stock = made.balls.catalogue, made.balls.stock
        larger = np.where(
            made.balls.cap,
            made.balls.radius + 0.11,
            catalogue.diameter[np.minimum(stock + 1, len(catalogue) - 1)] / 2,
        )
        assert (made.groups.minimum(here.coverage(larger, moved=True)) < 60).all()

    def test_groups_beyond_stock_get_caps(self, made: PrototypeLayout) -> None:
        beyond = made.balls.radius > 30
        assert (made.balls.cap == beyond).all()
        assert 0 < beyond.sum() < 5
        assert (made.balls.mass_g[beyond] == 0).all()
        assert made.balls.size[0].startswith("cap R 4")

    def test_a_caps_edge_lies_on_its_front_and_on_its_ball(self, made: PrototypeLayout) -> None:
        balls, cap = made.balls, made.balls.cap
        edge = balls.used_radius[cap] + KEYS.cap_rim_mm
        drop = balls.radius[cap] - np.sqrt(balls.radius[cap] ** 2 - edge**2)
        on_ball = np.hypot(edge, balls.body_depth[cap] - drop)
        assert on_ball == pytest.approx(balls.body_radius[cap])

    def test_a_balls_body_is_itself(self, made: PrototypeLayout) -> None:
        bought = ~made.balls.cap
        assert (made.balls.body_centre[bought] == made.balls.centre[bought]).all()

    def test_without_caps_the_largest_ball(
        self, made: PrototypeLayout, here: BallCandidates
    ) -> None:
        balls = choose_balls(here, KEYS.model_copy(update={"caps": False}), made.balls.catalogue)
        assert balls.radius.max() == 30
        assert not balls.cap.any()

    def test_nearest(self, made: PrototypeLayout, here: BallCandidates) -> None:
        keys = KEYS.model_copy(update={"snap": "nearest"})
        balls = choose_balls(here, keys, made.balls.catalogue)
        every = made.balls.catalogue.diameter / 2
        away = np.abs(every - made.groups.radius[:, None]).min(axis=1)
        bought = ~balls.cap
        assert np.abs(balls.radius - made.groups.radius)[bought] == pytest.approx(away[bought])
        assert ball_fit(here, balls, keys).coverage.min() < 60

    def test_pictures_left_in_place_need_tiny_balls(
        self, made: PrototypeLayout, here: BallCandidates
    ) -> None:
        keys = KEYS.model_copy(update={"picture": "fixed"})
        balls = choose_balls(here, keys, made.balls.catalogue)
        found = ball_fit(here, balls, keys)
        assert not found.coverable.all()
        assert (found.coverage_fixed[found.coverable] >= 60 - COVERAGE_ROUNDING_MM).all()
        assert found.kept_share < 0.05

    def test_cost_of_each_choice(self, small_design: MirrorDesign) -> None:
        spec, made = small_design.spec, small(small_design)
        found = {
            c.name: c for c in ball_alternatives(spec, made.half, made.groups, made.balls.catalogue)
        }
        assert found["cover, with caps"].kept_share == pytest.approx(made.fit.kept_share)
        assert found["cover, with caps"].below_target == 0
        assert found["cover, balls only"].kept_share < found["cover, with caps"].kept_share
        assert found["nearest, with caps"].below_target > 10


class TestPlaces:
    def test_apices_stay_on_the_ellipsoid(self, made: PrototypeLayout) -> None:
        apex = made.apices(0.3)
        pinhole = made.half.camera.pinhole
        assert norm(apex) + norm(apex - pinhole) == pytest.approx(
            np.full(len(made), 2 * made.half.ellipsoid.semi_major)
        )
        assert made.centres(0.3) == pytest.approx(
            apex - made.balls.radius[:, None] * made.normals(0.3)
        )

    def test_no_two_balls_come_closer_than_the_wall(self, made: PrototypeLayout) -> None:
        centre, radius = made.body_centres(), made.balls.body_radius
        gap = norm(centre[:, None] - centre) - radius[:, None] - radius
        np.fill_diagonal(gap, np.inf)
        assert gap.min() > KEYS.ball_wall_mm
        assert gap.min() < KEYS.ball_wall_mm + 0.05  # and are no farther than they must

    def test_no_ball_stands_in_anothers_light(self, made: PrototypeLayout) -> None:
        """Rays off every ball by brute force against every other ball."""
        outline, balls = made.balls.outline, made.balls
        camera, frame = made.half.camera.pinhole, made.half.ellipsoid.frame()
        for share in (0.0, 0.5, 1.0):
            inner = balls.poses.apex[:, None] + share * (outline - balls.poses.apex[:, None])
            centre = balls.centre[:, None]
            normal = unit(inner - centre)
            point = centre + balls.radius[:, None, None] * normal
            for j in range(len(made)):
                turn = made.placement.azimuth[j]
                rotation = np.array(
                    [
                        [1, 0, 0],
                        [0, np.cos(turn), -np.sin(turn)],
                        [0, np.sin(turn), np.cos(turn)],
                    ]
                )
                x, n = point[j] @ rotation.T @ frame, normal[j] @ rotation.T @ frame
                out = reflected_rays(camera, x, n)
                end = x - dot(x, out)[:, None] * out
                assert norm(end).max() < 30 + 1e-6
                others = np.arange(len(made)) != j
                for target in (np.broadcast_to(camera, x.shape), end):
                    gap = clear(x, target, made.body_centres()[others])
                    assert (gap - balls.body_radius[others]).min() > KEYS.light_margin_mm

    def test_post_and_camera_stay_clear_over_the_swing(self, made: PrototypeLayout) -> None:
        view = made.half.camera
        back = view.pinhole - KEYS.camera_length_mm * view.forward
        for angle in np.linspace(-1, 1, 41) * made.placement.swing / 2:
            centre = made.body_centres(angle)
            post = clear(np.zeros((1, 3)), np.array([[0, 0, -400.0]]), centre)[0]
            body = clear(view.pinhole[None], back[None], centre)[0]
            assert (post - made.balls.body_radius - 10).min() > KEYS.ball_wall_mm - 1e-3
            assert (body - made.balls.body_radius - 30).min() > KEYS.ball_wall_mm - 1e-3

    def test_swing_is_proved_least_and_less_than_greedy(self, made: PrototypeLayout) -> None:
        assert made.placement.swing_bound == pytest.approx(made.placement.swing, abs=1e-3)
        assert made.placement.swing < made.greedy_placement.swing - DEGREE
        assert made.placement.swing / DEGREE < 205

    def test_outermost_is_that_of_the_edges(self, made: PrototypeLayout) -> None:
        """By the seats' edges themselves, at both ends of the swing."""
        frame = made.half.ellipsoid.frame()
        far = 0.0
        for angle in (-made.placement.swing / 2, made.placement.swing / 2):
            _, out, across = (made.body_centres(angle) @ frame.T).T
            half = np.arcsin((made.balls.body_radius + KEYS.ball_wall_mm) / np.hypot(out, across))
            far = max(far, (np.abs(np.arctan2(across, out)) + half).max())
        assert made.placement.outermost == pytest.approx(far, abs=1e-6)


def clear(start: np.ndarray, end: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Distances (s, k) of points (k, 3) from segments (s, 3)."""
    way = (end - start)[:, None]
    share = dot(centre - start[:, None], np.broadcast_to(way, (len(start), *centre.shape)))
    share = np.clip(share / (way**2).sum(axis=-1), 0, 1)
    return norm(start[:, None] + share[..., None] * way - centre)


class TestStops:
    def test_every_mirror_is_served_within_the_limit(self, made: PrototypeLayout) -> None:
        stops = made.stops
        across = 2 * np.arcsin(
            np.sin(np.abs(stops.azimuth_error) / 2) * np.sin(made.groups.polar[made.fit.ball])
        )
        assert np.degrees(across).max() <= KEYS.stop_error_deg + 1e-9
        assert sum(len(stops.mirrors(i)) for i in range(len(stops))) == len(made.half)
        assert min(len(stops.mirrors(i)) for i in range(len(stops))) > 0

    def test_errors_are_those_of_the_balls_themselves(self, made: PrototypeLayout) -> None:
        for i in range(0, len(made.half), 50):
            apex = made.apices(made.stops.angle[made.stops.stop[i]])[made.fit.ball[i]]
            angle = np.arccos(np.clip(unit(apex) @ made.half.u[i], -1, 1))
            assert made.stops.error[i] == pytest.approx(angle, abs=1e-7)

    def test_stops_rise_within_the_swing(self, made: PrototypeLayout) -> None:
        assert (np.diff(made.stops.angle) > 0).all()
        assert np.abs(made.stops.angle).max() <= made.placement.swing / 2 + 1e-9

    def test_are_the_fewest_and_fewer_than_greedys(self, made: PrototypeLayout) -> None:
        wanted = stop_requests(made.groups, made.half.azimuth, np.radians(KEYS.stop_error_deg))
        angle = wanted.azimuth - made.placement.azimuth[wanted.ball]
        points, _ = min_stabbing_points(angle - wanted.tolerance, angle + wanted.tolerance)
        assert len(points) == len(made.stops)
        other = plan_stops(made.groups, made.half.polar, wanted, made.greedy_placement.azimuth)
        assert len(made.stops) <= len(other)

    def test_other_half_with_the_object_turned(
        self, made: PrototypeLayout, paper_design: MirrorDesign
    ) -> None:
        """Camera a's mirror sees of the turned object what camera b's would of the straight one."""
        b = paper_design.halves[1]
        assert b.u[made.twin] == pytest.approx(made.half.u * [-1, -1, 1], abs=1e-9)
        shots = planned_pictures(made)
        assert len(shots) == 2 * 847
        assert {shot.mirror for shot in shots} == {*made.half.ids, *b.ids}
        assert [shot.object_angle for shot in shots] == [0.0] * 847 + [np.pi] * 847
        first = [shot.stop for shot in shots[:847]]
        assert first == sorted(first)


class TestAsked:
    def test_same_numbers_every_time(
        self, made: PrototypeLayout, paper_design: MirrorDesign
    ) -> None:
        again = prototype_layout(SPEC, paper_design)
        assert again.placement.azimuth.tobytes() == made.placement.azimuth.tobytes()
        assert again.stops.angle.tobytes() == made.stops.angle.tobytes()
        assert again.balls.size == made.balls.size

    def test_auto_is_the_least_number_within_the_limits(self, small_design: MirrorDesign) -> None:
        auto = small(small_design, "prototype.k=auto")
        keys = load_spec(None).prototype

        def within(k: int) -> bool:
            found = small(small_design, f"prototype.k={k}")
            error = np.degrees(np.abs(found.fit.polar_error))
            return bool(
                error.max() <= keys.auto_direction_max_deg
                and np.median(error) <= keys.auto_direction_median_deg
                and 100 * (1 - found.fit.kept_share) <= keys.auto_lost_percent
            )

        assert within(len(auto))
        assert not within(len(auto) - 1)

    def test_one_ball(self, small_design: MirrorDesign) -> None:
        alone = small(small_design, "prototype.k=1")
        assert len(alone) == 1
        assert alone.placement.swing / DEGREE < 180

    def test_smaller_balls_are_lighter(self, small_design: MirrorDesign) -> None:
        light, heavy = (
            small(small_design, f"prototype.largest_ball_mm={size}") for size in (30, 60)
        )
        assert light.mass_g < heavy.mass_g
        assert light.balls.cap.sum() > heavy.balls.cap.sum()

    def test_no_post_gives_more_room(self, small_design: MirrorDesign) -> None:
        task = small(small_design, "post_diameter_mm=0", "camera_diameter_mm=0").task
        assert (task.max_azimuth == np.pi).all()
        assert (task.min_azimuth == -np.pi).all()


class TestRefused:
    @pytest.mark.parametrize(
        ("options", "told"),
        [
            (["prototype.k=104"], "prototype.k is 104, but camera a has 103 mirrors"),
            (
                ["max_swing_deg=150"],
                "found no place for 16 balls on one base within a swing of 150",
            ),
            (["camera_diameter_mm=500", "camera_length_mm=1000"], "camera_diameter_mm smaller"),
            (["largest_ball_mm=0.9"], "no ball of grade G40 up to 0.9 mm"),
            (['catalogues=["nowhere.csv"]'], "neither metric nor inch nor a file"),
            (
                ["prototype.k=auto", "auto_direction_max_deg=1e-9", "caps=false", "grade=G3"],
                "no number of balls up to 55",
            ),
        ],
    )
    def test_what_cannot_be_built(
        self, small_design: MirrorDesign, options: list[str], told: str
    ) -> None:
        with pytest.raises(SpecError) as caught:
            small(small_design, *options)
        assert told in str(caught.value)
        assert "\n" not in str(caught.value)

    def test_planar_mirrors(self) -> None:
        spec = load_spec(None, ["n=4", "radius_rule=flat"])
        with pytest.raises(SpecError, match=r"needs curved mirrors.*traced or paper"):
            prototype_layout(spec, design(spec))

    def test_an_empty_catalogue(self, small_design: MirrorDesign, tmp_path: Path) -> None:
        path = tmp_path / "none.csv"
        path.write_text("size,diameter_mm,standard,grades,mass_g,source\n")
        keys = small_design.spec.prototype.model_copy(update={"catalogues": (str(path),)})
        spec: Spec = small_design.spec.model_copy(update={"prototype": keys})
        with pytest.raises(SpecError, match=r"none\.csv: an empty catalogue"):
            prototype_layout(spec, small_design)
