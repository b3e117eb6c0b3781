"""Highlights of a machine that rotates; machine.json gives back the machine that was written."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.camera import Camera, without_distortion
from tbcad.core.optics.reflection import reflection_points
from tbcad.errors import InputError
from tbcad.records.run import Frame
from tbcad.rig.machine.machine import Machine, read_machine, write_machine

FORWARD = unit(np.array([-0.2, 0.0, 1.0]))
DESIGNED = Camera(
    np.array([100.0, 0.0, -100.0]), FORWARD, np.array([0.0, -1.0, 0.0]), 2080, 1552, 1.55
)
CAMERA = replace(without_distortion(DESIGNED), distortion=np.array([-0.05, 0.01, 1e-3, -5e-4, 0.0]))
FRAMES = tuple(Frame(object_turn_deg=0, stop=s, base_angle_deg=10.0 * s) for s in (1, 2))
MACHINE = Machine(
    camera=CAMERA,
    axis=unit(np.array([1.0, 0.0, -1.0])),
    axis_point=np.array([0.1, 0.2, 0.3]),
    angle=np.array([0.2, 0.4]),
    centre=np.array([[60.0, 10.0, 40.0], [70.0, -20.0, 30.0], [80.0, 5.0, 20.0]]),
    radius=np.array([10.0, 15.0, 20.0]),
    leds=np.array([[18.0, 14.0, -8.0], [-10.0, -20.0, -5.0]]),
    shift=np.array([[0.01, 0.0, -0.02], [0.0, 0.03, 0.0]]),
)


def test_round_trip(tmp_path: Path) -> None:
    write_machine(tmp_path / "machine.json", replace(MACHINE, shift=None), FRAMES)
    assert read_machine(tmp_path / "machine.json")[0].shift is None
    write_machine(tmp_path / "machine.json", MACHINE, FRAMES)
    found, frames = read_machine(tmp_path / "machine.json")
    assert frames == FRAMES
    assert found.centre == pytest.approx(MACHINE.centre, abs=0)
    assert found.angle == pytest.approx(MACHINE.angle, rel=1e-15)
    assert found.shift == pytest.approx(MACHINE.shift, abs=0)
    assert found.camera.distortion == pytest.approx(CAMERA.distortion, abs=0)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("axis", [1.0, 0.0, -1.0], "no unit vectors"),
        ("angle_deg", [1.0], "another number of angles"),
        ("shift_mm", [[0.0, 0.0, 0.0]], "another number of shifts"),
        ("spheres", [{"centre_mm": [0, 0, 0], "radius_mm": -1}], "greater than 0"),
    ],
)
def test_refused(tmp_path: Path, key: str, value: object, message: str) -> None:
    path = tmp_path / "machine.json"
    write_machine(path, MACHINE, FRAMES)
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    with pytest.raises(InputError, match=message):
        read_machine(path)


def test_spheres_turn_about_the_axis_and_shift_together() -> None:
    assert MACHINE.shift is not None
    frame, sphere = np.array([0, 1, 1]), np.array([2, 2, 0])
    still = replace(MACHINE, shift=None).centres(frame, sphere)
    away = norm(still - MACHINE.axis_point)
    assert away == pytest.approx(norm(MACHINE.centre[sphere] - MACHINE.axis_point))
    assert (still[1] - still[0]) @ MACHINE.axis == pytest.approx(0, abs=1e-12)
    assert MACHINE.centres(frame, sphere) - still == pytest.approx(MACHINE.shift[frame])


def test_highlight_is_where_light_is_reflected() -> None:
    frame, sphere, led = np.array([1]), np.array([0]), np.array([1])
    pixel = MACHINE.highlights(frame, sphere, led)
    centre, pinhole = MACHINE.centres(frame, sphere), MACHINE.camera.pinhole
    point = reflection_points(centre, MACHINE.radius[sphere], MACHINE.leds[led], pinhole)
    assert MACHINE.camera.directions(pixel) == pytest.approx(unit(point - pinhole), abs=1e-9)
