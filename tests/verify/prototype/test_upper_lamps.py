"""LEDs above the object in wrong files: another place, another light, no pair, bodies elsewhere."""

from __future__ import annotations

from itertools import pairwise
from unittest.mock import Mock

import numpy as np
import pytest
from tbcad_verify.mesh.mesh import indexed_mesh
from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.bodies import body_scene
from tbcad_verify.prototype.light import ball_views
from tbcad_verify.prototype.light.upper_lamps import _faults, _meets_face
from tbcad_verify.record.prototype import UpperLamps
from tbcad_verify.types import Floats

SIDES = 24


def recorded(**changes: object) -> UpperLamps:
    """Two LEDs at y and -y, 50 mm from the middle."""
    leds = [
        {
            "names": [f"board_{k}", f"rod_{k}"],
            "position_mm": [0.0, 40.0 * side, 30.0],
            "direction": [0.0, -0.8 * side, -0.6],
            "head_mm": [[0.0, 40.0 * side, 30.0], [0.0, 43.2 * side, 32.4]],
            "rod_mm": [[0, 43.0 * side, 32.0], [0, 46.0 * side, 28.0], [0, 70.0 * side, -60.0]],
        }
        for k, side in ((1, 1.0), (2, -1.0))
    ]
    value = {
        "part": "STAR-3535-8",
        "leds": leds,
        "candela_each": 0.4 * 15.0 / np.pi,
        "current_ma": 15.0,
        "head_diameter_mm": 8.0,
        "rod_diameter_mm": 1.5,
        "tolerance_mm": 0.75,
    }
    return UpperLamps.model_validate({**value, **changes}, strict=False)


def tube(start: Floats, end: Floats, diameter: float) -> Floats:
    """Points round a cylinder's ends."""
    way = (end - start) / np.linalg.norm(end - start)
    angle = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)[:, None]
    side = np.cross(way, [1.0, 0.0, 0.0])
    ring = diameter / 2 * (np.cos(angle) * side + np.sin(angle) * np.cross(way, side))
    return np.vstack([start + ring, end + ring])


def drawn(upper: UpperLamps) -> dict[str, Shape]:
    """Shapes as they are recorded."""
    none, shapes = np.zeros((0, 3), dtype=np.int64), {}
    for led in upper.leds:
        shapes[led.names[0]] = tube(*led.head, upper.head_diameter), none
        parts = [tube(*ends, upper.rod_diameter) for ends in pairwise(led.rod)]
        shapes[led.names[1]] = np.vstack(parts), none
    return shapes


def test_as_recorded() -> None:
    upper = recorded()
    assert list(_faults(upper, drawn(upper))) == []


@pytest.mark.parametrize(
    ("name", "shift", "text"),
    [
        ("board_1", [0.0, 1.0, 0.0], "board_1 is drawn 0.8 mm out"),
        ("rod_2", [3.0, 0.0, 0.0], "rod_2 is drawn 3 mm out"),
        ("board_2", [0.0, -0.16, 0.12], "board_2 is drawn 0.2"),
    ],
)
def test_bodies_elsewhere_are_refused(name: str, shift: list[float], text: str) -> None:
    upper = recorded()
    shapes = drawn(upper)
    shapes[name] = shapes[name][0] + shift, shapes[name][1]
    assert any(text in fault for fault in _faults(upper, shapes)), list(_faults(upper, shapes))


def test_a_missing_rod_more_light_and_a_single_led_are_refused() -> None:
    upper = recorded()
    shapes = drawn(upper)
    del shapes["rod_1"]
    assert list(_faults(upper, shapes)) == ["rod_1 is not drawn"]
    bright = recorded(candela_each=4.0)
    assert any("4 cd are not those" in fault for fault in _faults(bright, drawn(upper)))
    alone = upper.model_copy(update={"leds": upper.leds[:1]})
    assert any("half turn" in fault for fault in _faults(alone, drawn(upper)))


def test_only_the_front_of_what_shines_dazzles() -> None:
    upper = recorded()
    led = upper.leds[0]
    point = np.array([[0.0, -80.0, -60.0], [0.0, 80.0, 60.0], [5.0, -80.0, -60.0]])
    along = np.array([[0.0, 0.8, 0.6], [0.0, -0.8, -0.6], [0.0, 0.8, 0.6]])
    assert _meets_face(led, upper, point, along).tolist() == [True, False, False]


def test_rays_that_boards_stop_are_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of four rays one is stopped on its way to the ball, one after it, one beyond the object."""
    corners = np.array([[x, y, 0.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    board = indexed_mesh(corners, np.array([[0, 1, 3], [0, 3, 2]], dtype=np.int32))
    point = np.array([[0.0, 0.0, -5.0], [0.2, 0.1, 5.0], [0.2, 0.1, 5.0], [5.0, 0.0, 5.0]])
    pinhole, down = np.array([0.0, 0.0, 20.0]), np.tile([0.0, 0.0, -1.0], (4, 1))
    before = (point - pinhole) / np.linalg.norm(point - pinhole, axis=1)[:, None]
    paths = ball_views.RayPaths(point, before, down, np.array([1.0, 9.0, 4.0, 9.0]))
    pixel = Mock(mirror=np.zeros(4, dtype=np.intp))
    monkeypatch.setattr(ball_views, "ray_paths", lambda *_: paths)
    measured = Mock(above=body_scene({"board": board}), context=Mock(pinhole=pinhole))
    stopped = ball_views.stopped_above(measured, pixel)
    assert stopped.tolist() == [True, True, False, False]
    assert not ball_views.stopped_above(Mock(above=body_scene({})), pixel).any()
