"""Photographs of a simulated run: the same by themselves, right in place, light and noise."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tbcad.core.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.core.optics.camera import Camera, LensCamera, without_distortion
from tbcad.core.optics.led_dome import dome_images
from tbcad.core.optics.pedestals.cells import NO_WALLS
from tbcad.core.optics.sphere_forms import TERM_COUNT, Forms
from tbcad.light.simulate.capture.sensor import (
    PixelMaps,
    SimulatedSensor,
    generator,
    pixel_directions,
    pixel_maps,
    recorded,
)
from tbcad.light.simulate.prototype.ball_rays import balls_between
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.rig.machine.designed import BuiltPrototype
from tbcad.rig.machine.machine import Machine
from tbcad.rig.simulated_run import led_light as module
from tbcad.rig.simulated_run.led_light import Occluders, led_light
from tbcad.rig.simulated_run.photographs import (
    ImagingChain,
    PointSpread,
    add_points,
    blurred,
    phases_of,
)
from tests.simulated_runs import BRIGHT, Small, small_run

SENSOR = SimulatedSensor(grains=0, hot_share=0.0)
CAMERA = LensCamera(
    np.zeros(3), np.eye(3), np.full(2, 300.0), np.array([159.5, 119.5]), np.zeros(5), 320, 240
)
FLAT = PixelMaps(np.ones((240, 320), dtype=np.float32), np.zeros(0, dtype=np.int64), np.zeros(0))
EMPTY = Occluders(None, None)
VIEW = Camera(
    np.array([0.0, 0.0, -100.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), 801, 601, 1
)


def photographed(
    sensor: SimulatedSensor, light: float | None, maps: PixelMaps = FLAT
) -> np.ndarray:
    even = None if light is None else np.full((240, 320), light, dtype=np.float32)
    return recorded(sensor, maps, even, generator(1, 2))


def test_mean_and_variance_of_light() -> None:
    image = photographed(SENSOR, 0.5).astype(float)
    number = SENSOR.largest / SENSOR.full_electrons
    mean = 0.5 * SENSOR.full_electrons + SENSOR.dark_electrons
    variance = (mean + SENSOR.read_electrons**2) * number**2 + 1 / 12
    pixels = image.size
    assert image.mean() == pytest.approx(number * mean, abs=4 * np.sqrt(variance / pixels))
    # The variance of a normal sample's variance is 2 / n of its square.
    assert image.var() == pytest.approx(variance, rel=4 * np.sqrt(2 / pixels) + 0.01)


def test_colours_have_noise_of_their_own() -> None:
    image = photographed(SENSOR, 0.5).astype(float).reshape(-1, 3)
    assert abs(np.corrcoef(image[:, 0], image[:, 1])[0, 1]) < 4 / np.sqrt(len(image))


def test_darkness_is_drawn_one_by_one_as_often_as_the_noise_says() -> None:
    sensor = replace(SENSOR, read_electrons=6.0)
    image = photographed(sensor, None)
    spread = np.sqrt(sensor.dark_electrons + sensor.read_electrons**2)
    step = sensor.full_electrons / sensor.largest
    share = stats.norm.sf((step / 2 - sensor.dark_electrons) / spread)
    count = int((image > 0).sum())
    assert count == pytest.approx(share * image.size, abs=4 * np.sqrt(share * image.size))


def test_saturation_and_bits() -> None:
    assert (photographed(SENSOR, 2.0) == 255).all()
    sixteen = photographed(replace(SENSOR, bits=16, noise=0.0), 0.5)
    assert sixteen.dtype == np.uint16
    assert sixteen.shape == (240, 320)
    assert (sixteen == round((5000 + SENSOR.dark_electrons) * 65535 / 10_000)).all()
    for seconds in (0.5, 2.0):  # the dark signal grows with the exposure
        sensor = replace(SENSOR, bits=16, noise=0.0)
        image = recorded(sensor, FLAT, None, generator(3), seconds)
        assert (image == round(seconds * sensor.dark_electrons * 65535 / 10_000)).all()


def test_hot_pixels_are_hot_in_every_photograph() -> None:
    sensor = SimulatedSensor(grains=0, hot_share=1e-3, hot_electrons=4000.0)
    maps = pixel_maps(CAMERA, pixel_directions(CAMERA), sensor, seed=3)
    assert len(maps.hot) == round(1e-3 * 320 * 240)
    dark, light = (photographed(sensor, level, maps).reshape(-1, 3) for level in (None, 0.1))
    # Neither dark nor, with 1000 electrons of light more, full.
    bright = maps.hot[(maps.hot_electrons > 1000) & (maps.hot_electrons < 7000)]
    assert len(bright) > 10
    assert (dark[bright] > 15).all()
    assert (light[bright].mean(axis=1) > dark[bright].mean(axis=1)).all()


def test_a_lens_loses_light_as_the_fourth_power_of_the_cosine() -> None:
    maps = pixel_maps(CAMERA, pixel_directions(CAMERA), SENSOR, seed=3)
    tangent = np.hypot(159.5, 119.5) / 300
    assert maps.transmission[0, 0] == pytest.approx(1 / (1 + tangent**2) ** 2, rel=1e-5)


def test_dust_darkens_some_pixels_and_brightens_none() -> None:
    directions = pixel_directions(CAMERA)
    clean = pixel_maps(CAMERA, directions, SENSOR, seed=3).transmission
    dusty = pixel_maps(CAMERA, directions, replace(SENSOR, grains=5), seed=3).transmission
    assert (dusty <= clean).all()
    assert 0.75 < (dusty / clean).min() < 0.98


def machine_of(centre: list[list[float]], radius: list[float], led: list[float]) -> BuiltPrototype:
    machine = Machine(
        camera=without_distortion(VIEW),
        axis=np.array([0.0, 0.0, 1.0]),
        axis_point=np.zeros(3),
        angle=np.zeros(1),
        centre=np.array(centre),
        radius=np.array(radius),
        leds=np.array([led]),
    )
    return BuiltPrototype(machine, machine.centre, machine.radius)


ONE = machine_of([[0.0, 0.0, 50.0]], [10.0], [30.0, 5.0, -20.0])


def test_one_ball_shows_one_led_where_the_machine_says() -> None:
    every = np.zeros(1, dtype=np.int64)
    pixel, area = led_light(ONE, 0, False, EMPTY).of(0)
    image = dome_images(
        ONE.machine.camera, ONE.machine.centre, ONE.machine.radius, ONE.machine.leds, module.DOME_MM
    )
    place = ONE.machine.highlights(every, every, every)[0]
    assert area @ pixel / area.sum() - place == pytest.approx(image.centroid[0], abs=5e-3)
    assert area.sum() == pytest.approx(image.area[0], rel=5e-3)
    tiny = led_light(ONE, 0, False, EMPTY, dome=1e-4).pixel
    assert tiny == pytest.approx(np.broadcast_to(place, tiny.shape), abs=1e-3)


def test_a_ball_in_the_way_hides_the_led() -> None:
    in_way = machine_of([[0.0, 0.0, 50.0], [17.0, 2.5, 9.0]], [10.0, 4.0], [30.0, 5.0, -20.0])
    pixel = led_light(in_way, 0, False, EMPTY).pixel
    place = in_way.machine.highlights(*np.zeros((3, 1), dtype=np.int64))[0]
    assert not (norm(pixel - place) < 3).any()


def test_balls_between_points() -> None:
    ball = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]])
    start = np.array([[-3.0, 0.0, 0.0], [-3.0, 1.1, 0.0], [-3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    end = np.array([[3.0, 0.0, 0.0], [3.0, 1.1, 0.0], [-2.0, 0.0, 0.0], [-3.0, 0.0, 0.0]])
    hidden = balls_between(start, end, ball, NO_WALLS.of_mirrors(1))
    assert hidden.tolist() == [True, False, False, False]


def test_an_object_in_the_way_hides_the_led_and_turns_with_the_run() -> None:
    def light(z: float, turned: bool) -> float:
        built = machine_of([[60.0, 0.0, z]], [10.0], [-20.0, 0.0, -5.0])
        scene = prepared_scene(built_in_object(24.0)).embree
        return float(led_light(built, 0, turned, Occluders(scene, None)).area.sum())

    free = machine_of([[60.0, 0.0, 30.0]], [10.0], [-20.0, 0.0, -5.0])
    whole = led_light(free, 0, False, EMPTY).area.sum()
    straight, turned = light(30.0, False), light(30.0, True)
    assert straight < 0.9 * whole
    assert turned < whole
    assert straight != turned


def test_light_reflected_twice_obeys_the_law_on_both_balls() -> None:
    two = machine_of([[-12.0, 0.0, 50.0], [14.0, 0.0, 50.0]], [10.0, 12.0], [5.0, 20.0, -20.0])
    balls = module.balls_of_frame(two, 0)
    first, last = np.array([0, 1]), np.array([1, 0])
    place = np.repeat(two.machine.leds, 2, axis=0)
    pinhole = two.machine.camera.pinhole
    one, then = module._path(balls, first, last, place, pinhole)
    for ball, point, before, after in (
        (first, one, place, then),
        (last, then, one, np.broadcast_to(pinhole, one.shape)),
    ):
        normal = (point - balls[ball, :3]) / balls[ball, 3:4]
        bisector = unit(unit(before - point) + unit(after - point))
        # Each of five rounds gains a digit: of a light so weak a thousandth of a pixel is enough.
        assert norm(np.cross(normal, bisector)).max() < 1e-4
        assert (dot(normal, bisector) > 0).all()
    weak = led_light(two, 0, False, EMPTY)
    places = two.machine.camera.project(then)
    near = [norm(weak.pixel - place).min() for place in places]
    assert min(near) < 1e-3, "no second reflection is followed"
    faintest = weak.area[[int(norm(weak.pixel - place).argmin()) for place in places]].min()
    assert 0 < faintest < 0.1 * weak.area.sum()


STOPS = (20, 40)


@pytest.fixture(scope="module")
def small(export_folder: Path) -> Small:
    return small_run(export_folder, STOPS)


def test_a_photograph_does_not_depend_on_the_others(small: Small, export_folder: Path) -> None:
    alone = small_run(export_folder, STOPS[1:])
    number = [frame.stop for frame in small.run.frames].index(STOPS[1])
    whole = small.run.frame_photographs(number, phases_of(4))
    some = alone.run.frame_photographs(0, ("led_2", "lit"))
    assert (whole["led_2"] == some["led_2"]).all()
    assert (whole["lit"] == some["lit"]).all()
    other = small.run.frame_photographs(number - 1, ("dark",))["dark"]
    assert (other != whole["dark"]).any()  # noise of its own


def test_forms_are_seen_in_both_runs(small: Small) -> None:
    """Fronts with a form of no height are spheres; one of some micrometres moves the picture."""
    built = small.run.built
    k, axes = len(built.body_radius), perpendicular_axes(unit(-built.machine.centre))

    def lit(number: int, height: float) -> np.ndarray:
        forms = Forms(np.full((k, TERM_COUNT), height), axes, np.full(k, 4.0))
        formed = replace(built, machine=replace(built.machine, forms=forms))
        run = replace(small.run, built=formed)
        return np.asarray(run.frame_photographs(number, ("lit",))["lit"])

    for turn in (0, 180):
        number = [frame.object_turn_deg for frame in small.run.frames].index(turn)
        spheres = small.run.frame_photographs(number, ("lit",))["lit"]
        assert (lit(number, 0.0) == spheres).all()
        assert (lit(number, 5e-3) != spheres).any()


def test_light_ends_at_darkness_and_saturation(small: Small) -> None:
    sensor = SimulatedSensor(noise=0.0, hot_share=0.0)
    chain = ImagingChain(sensor, led_light=(50.0, 0.0, BRIGHT, BRIGHT))
    images = replace(small.run, chain=chain).frame_photographs(0, phases_of(4))
    assert images["led_1"].max() == 255
    assert images["led_2"].max() == 0


# So wide that sums over pixels are integrals: what is left of one cycle a pixel is 6e-5.
SPREAD = PointSpread(separation_px=1.0, lens_px=0.7)


def spread_point(place: tuple[float, float]) -> np.ndarray:
    image = np.zeros((21, 31), dtype=np.float32)
    add_points(image, np.array([place]), np.array([2.0]), SPREAD)
    return image


@pytest.mark.parametrize("place", [(15.0, 10.0), (14.3, 9.8), (15.49, 10.51)])
def test_sum_centroid_and_width(place: tuple[float, float]) -> None:
    image = spread_point(place)
    row, column = np.indices(image.shape)
    assert image.sum() == pytest.approx(2, rel=1e-4)
    assert (image * column).sum() / 2 == pytest.approx(place[0], abs=2e-3)
    assert (image * row).sum() / 2 == pytest.approx(place[1], abs=2e-3)
    # Variances add: two images half a pixel to each side, the lens, a pixel's width.
    width = (image * (column - place[0]) ** 2).sum() / 2
    assert width == pytest.approx(0.5**2 + 0.7**2 + 1 / 12, rel=2e-3)


def test_light_beyond_the_edge_is_lost() -> None:
    assert spread_point((-0.5, 10.0)).sum() == pytest.approx(1, rel=1e-4)
    assert spread_point((-9.0, 10.0)).sum() == 0


def test_a_picture_is_blurred_as_points_are() -> None:
    picture = np.zeros((21, 31, 3), dtype=np.float32)
    picture[10, 15] = (2.0, 1.0, 0.5)
    found = blurred(picture, SPREAD)
    assert found[..., 0] == pytest.approx(spread_point((15.0, 10.0)), abs=1e-5)
    assert found.sum(axis=(0, 1)) == pytest.approx([2, 1, 0.5], rel=1e-4)
