"""Light of LEDs over one ball and over two, and what is in its way."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import Camera, without_distortion
from tbcad.core.optics.led_dome import dome_images
from tbcad.core.optics.pedestals.cells import NO_WALLS
from tbcad.light.simulate.prototype.ball_rays import balls_between
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.rig.machine.designed import BuiltPrototype
from tbcad.rig.machine.machine import Machine
from tbcad.rig.simulated_run import led_light as module
from tbcad.rig.simulated_run.led_light import Occluders, led_light

EMPTY = Occluders(None, None)
VIEW = Camera(
    np.array([0.0, 0.0, -100.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), 801, 601, 1
)


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
