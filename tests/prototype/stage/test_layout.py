"""The stage and its keep-out volume: closed forms against sampled distances."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from tbcad.core.geometry.primitives import Cylinder, box
from tbcad.core.geometry.rotations import even_angles, rotated_about_x, unit_circle
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.core.spec.prototype import FrameSpec, PrototypeSpec, StageSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.keepout import EXACT, EXACT_MM, KeepOut, SweptSection, min_distance
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import (
    GRAZING_MM,
    WALL_MM,
    StageLayout,
    bore_radius,
    led_poses,
    stage_layout,
)
from tbcad.prototype.stage.leds import (
    MIN_SEEN,
    NOISE_PX,
    calibration_estimate,
    hidden_by_object,
    virtual_cameras,
    visible,
)
from tests.mirror_arrays import mirror_array

PARTS = load_parts()
SIZED = load_spec(None).prototype
CAPTURE = 30.0
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def stage_with(
    spec: PrototypeSpec, small_prototype: PrototypeLayout, keep_out: KeepOut
) -> Callable[..., StageLayout]:
    """A stage with other keys; floor_mm is the frame's."""

    def of(keep_out: KeepOut = keep_out, **changed: Any) -> StageLayout:
        sections = {
            "post_diameter_mm": changed.pop("post", 20.0),
            "frame": FrameSpec(floor_mm=changed.pop("floor_mm", SIZED.frame.floor_mm)),
            "stage": StageSpec.model_validate(dict(SIZED.stage) | changed),
        }
        return stage_layout(spec.model_copy(update=sections), small_prototype, keep_out, PARTS)

    return of


@pytest.fixture(scope="module")
def refusal(stage_with: Callable[..., StageLayout]) -> Callable[..., str]:
    def refused(**changed: Any) -> str:
        with pytest.raises(SpecError) as caught:
            stage_with(**changed)
        return str(caught.value)

    return refused


class TestStage:
    def test_leds_are_where_the_spec_has_them_clear_of_light_and_base(
        self, stage: StageLayout, stage_with: Callable[..., StageLayout]
    ) -> None:
        found = led_poses(stage)
        assert [name for name, _, _ in found] == ["led_1", "led_2", "led_3", "led_4"]
        assert [tuple(place) for _, place, _ in found] == list(SIZED.stage.leds_mm)
        assert all((direction == UP).all() for _, _, direction in found)
        assert stage.light > -GRAZING_MM
        assert stage.swept > FrameSpec().clearance_mm
        assert stage.sizes.post == 10.0
        bare = stage_with(leds_mm=[])
        assert led_poses(bare) == []
        names = [component.name for component in bare.components]
        assert names == ["stage_disc", "stage_crown"]
        assert bare.post.part == "TUBE-20x2x250"

    def test_the_studs_take_the_disc_two_ways_round(self, stage: StageLayout) -> None:
        disc, crown = stage.components
        holes = np.array([hole.start[:2] for hole in disc.removed if isinstance(hole, Cylinder)])
        studs = np.array([b.start[:2] for b in crown.added[1:3] if isinstance(b, Cylinder)])
        assert holes == pytest.approx(studs)
        assert holes[0] == pytest.approx(-holes[1])

    def test_what_does_not_fit_is_refused(
        self, refusal: Callable[..., str], keep_out: KeepOut
    ) -> None:
        def moved(number: int, *place: float) -> dict[str, object]:
            places = list(SIZED.stage.leds_mm)
            return {"leds_mm": [*places[: number - 1], place, *places[number:]]}

        one_side = [(23.5, 0.0, -8.0), (18.8, 14.0, -6.0), (18.8, -14.0, -3.0), (10.5, 21.0, -8.0)]
        level = [(x, y, -8.0) for x, y, _ in SIZED.stage.leds_mm]
        disc = np.array([[-90.0, 0.0], [110.0, 0.0], [110.0, 150.0], [-90.0, 150.0]])
        swept = replace(keep_out, sections=(SweptSection(disc, -np.pi, np.pi),))
        cases: tuple[tuple[dict[str, object], str], ...] = (
            ({"post": 0.0}, "hollow hub is not supported"),
            ({"post": 6.0}, "8 or more"),
            ({"top_mm": -29.0}, "set prototype.stage.top_mm from"),
            ({"top_mm": 5.0}, "to 0"),
            ({"disc_mm": 60.0}, "does not fit into the capture sphere"),
            ({"disc_mm": 6.0}, "no room for its studs"),
            ({"led": "LED-5"}, "LED 1 with its pillar reaches"),
            ({"floor_mm": -60.0}, "make prototype.frame.floor_mm"),
            ({"leds_mm": level}, "nearly in one plane"),
            ({"leds_mm": one_side}, "of 4 LEDs past an object in its room"),
            (moved(1, 20.0, 17.5, -15.0), "LED 1 with its pillar reaches"),
            (moved(1, 10.6, 7.5, -22.0), "LED 1 is too low for its pocket"),
            (
                moved(3, -3.4, 8.0, -13.5),
                "LED 3 is in the object's room: move it outward to 23.4 mm",
            ),
            (moved(4, 5.1, 22.9, -3.0), "LED 4 collides with LED 3"),
            ({"keep_out": replace(keep_out, used=keep_out.used + np.pi)}, "mm inside the light of"),
            ({"keep_out": swept}, "prototype.post_diameter_mm or prototype.k smaller"),
        )
        for changed, message in cases:
            assert message in refusal(**changed)

    def test_leds_are_seen_as_in_a_march_along_their_rays(
        self, small_prototype: PrototypeLayout, stage: StageLayout
    ) -> None:
        """Two or more from each camera, past the object."""
        room = SIZED.stage.object_diameter_mm / 2
        cameras = virtual_cameras(small_prototype)
        seen = visible(SIZED.stage, stage.leds, cameras, stage.led, CAPTURE)
        assert seen.sum(axis=1).min() >= 2
        for i, place in enumerate(stage.leds):
            way = unit(cameras - place)
            points = place + np.arange(0.0, 80.0, 0.1)[:, None, None] * way
            across, height = norm(points[..., :2]), points[..., 2]
            inside = (across < room) & (height > SIZED.stage.top_mm)
            object_hides = (inside & (height < np.sqrt(CAPTURE**2 - room**2))).any(axis=0)
            hidden = hidden_by_object(SIZED.stage, stage.leds, cameras, CAPTURE)[:, i]
            assert (hidden != object_hides).mean() < 0.02  # rays that graze, between two steps


class TestKeepOut:
    def test_light_is_where_rays_are(
        self, small_prototype: PrototypeLayout, keep_out: KeepOut
    ) -> None:
        """Rays from points of the capture sphere to points of the part in use, at its stops."""
        rng = np.random.default_rng(5)
        outline, stops = small_prototype.balls.outline, small_prototype.stops
        frame = small_prototype.array.ellipsoid.frame()
        for mirror in rng.choice(len(small_prototype.array), 12, replace=False).tolist():
            ball = int(small_prototype.fit.ball[mirror])
            azimuth = small_prototype.placement.azimuth[ball] + stops.angle[stops.stop[mirror]]
            rim = rotated_about_x(outline[ball], np.full(outline.shape[1], azimuth)) @ frame
            start = CAPTURE * unit(rng.normal(size=(len(rim), 3)))
            ends = [start, np.broadcast_to(small_prototype.array.camera.pinhole, rim.shape)]
            for other in ends:
                share = rng.uniform(size=(len(rim), 1))
                assert (keep_out.to_light(other + share * (rim - other)) < 1e-6).all()

    def test_swept_holds_carrier_and_balls_at_all_angles(
        self, small_prototype: PrototypeLayout, carrier: BaseLayout, keep_out: KeepOut
    ) -> None:
        seat, around = carrier.seats, unit_circle(even_angles(24))
        rims = seat.centre + seat.back[:, None] * seat.axis
        rims = rims[:, None] + seat.boss[:, None, None] * (around @ seat.axes[:, :2])
        ends = rims.reshape(-1, 3)
        for angle in np.linspace(
            small_prototype.stops.angle[0], small_prototype.stops.angle[-1], 7
        ).tolist():
            local = rotated_about_x(ends @ carrier.frame.T, np.full(len(ends), angle))
            assert (keep_out.to_swept(local @ carrier.frame) == 0).all()
            assert (keep_out.to_swept(small_prototype.body_centres(angle)) < -5).all()
            for azimuth in carrier.sector:
                turn = np.full(len(carrier.outer), azimuth + angle)
                line = np.column_stack([carrier.outer, 0 * turn])
                points = rotated_about_x(line, turn) @ carrier.frame
                assert keep_out.to_swept(points).max() < 1e-6

    def test_the_sphere_is_no_obstacle_to_itself(self, keep_out: KeepOut) -> None:
        inside = 0.9 * CAPTURE * unit(np.random.default_rng(7).normal(size=(50, 3)))
        assert (keep_out.to_light(inside) < 0).all()
        assert (keep_out.to_light_outside_sphere(inside) > 0).all()

    def test_smallest_distance_of_a_box_to_a_point(self) -> None:
        body = box(np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0]), np.eye(3))
        for point, away in ((np.zeros(3), np.sqrt(14)), (np.array([2.0, 3.0, 10.0]), 4.0)):
            found = min_distance(partial(distance, point), [body])
            assert away - max(EXACT_MM, EXACT * away) - 1e-9 <= found <= away


def distance(point: np.ndarray, at: np.ndarray) -> np.ndarray:
    return norm(at - point)


def test_the_covariance_is_that_of_centres_solved_from_noisy_highlights() -> None:
    """Least squares on 400 noisy photographs of the LEDs that a mirror sees."""
    array, mirror = mirror_array("n=6"), 20
    domes, cameras = np.array(SIZED.stage.leds_mm), array.ellipsoid.camera_distance * array.u
    seen = ~hidden_by_object(SIZED.stage, domes, cameras[[mirror]], CAPTURE)
    leds, rng = domes[seen[0]], np.random.default_rng(2)
    centre, radius = array.mirrors.centre[mirror], array.mirrors.radius[mirror]
    pinhole = array.camera.pinhole

    def highlights(centres: np.ndarray) -> np.ndarray:
        radii = np.full(len(centres), radius)
        points = [reflection_points(centres, radii, place, pinhole) for place in leds]
        return np.concatenate([array.camera.project(point) for point in points], axis=1)

    true = highlights(centre[None])
    noisy = true + NOISE_PX * rng.normal(size=(400, true.shape[1]))
    solved = np.repeat(centre[None], 400, axis=0)
    for _ in range(6):
        steps = [highlights(solved + 1e-4 * axis) for axis in np.eye(3)]
        slope = np.stack([(one - highlights(solved)) / 1e-4 for one in steps], axis=2)
        rest = noisy - highlights(solved)
        solved += np.stack(
            [np.linalg.lstsq(a, b, rcond=None)[0] for a, b in zip(slope, rest, strict=True)]
        )
    spread = np.sqrt(np.linalg.eigvalsh(np.cov(solved.T))[-1])
    estimate = calibration_estimate(SIZED.stage, array, domes, CAPTURE)
    assert spread == pytest.approx(estimate.worst[mirror], rel=0.1)
    assert estimate.seen.min() >= MIN_SEEN
    assert (estimate.across < estimate.worst).all()
    # More LEDs tell more.
    more = np.vstack([domes, [[0.0, -23.4, -6.0]]])
    many = calibration_estimate(SIZED.stage, array, more, CAPTURE)
    assert (many.worst <= estimate.worst * (1 + 1e-9)).all()
    assert many.record().centre_um_median < estimate.record().centre_um_median


def test_walls_of_the_neck_can_be_printed() -> None:
    assert bore_radius(6.0, True) == 3.0
    assert bore_radius(2.4, True) == pytest.approx(2.4 - WALL_MM)
    assert bore_radius(0.7, False) == 0.0
    for neck, wired in ((2.2, True), (0.6, False), (-0.1, False)):
        with pytest.raises(SpecError, match=r"leaves a neck of \d\.\d mm diameter"):
            bore_radius(neck, wired)
