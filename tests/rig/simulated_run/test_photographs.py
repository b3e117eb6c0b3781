"""Photographs of a simulated run: the same by themselves, and right in place and light."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.light.simulate.prototype.ball_rays import camera_colours, trace_balls
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.rig.calibration.detection.matching import expected_highlights
from tbcad.rig.machine.designed import machine_runs
from tbcad.rig.simulated_run.led_light import DOME_MM, balls_of_frame
from tbcad.rig.simulated_run.photographs import (
    ImagingChain,
    PointSpread,
    add_points,
    blurred,
    object_light,
    phases_of,
)
from tbcad.rig.simulated_run.sensor import SimulatedSensor, pixel_directions
from tests.simulated_runs import BRIGHT, Small, photograph_centroid, small_run

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


def test_highlights_are_where_the_machine_shows_them(export_folder: Path) -> None:
    exact = ImagingChain(
        SimulatedSensor(noise=0.0, grains=0, hot_share=0.0, bits=16), led_light=BRIGHT
    )
    run = small_run(export_folder, STOPS, chain=exact).run
    images = run.frame_photographs(0, ("led_1", "led_2"))
    expected = expected_highlights(run.built.machine, DOME_MM)
    off = []
    for k in np.flatnonzero((expected.frame == 0) & (expected.led < 2) & expected.inside):
        place = (expected.pixel + expected.centroid)[k]
        image = images[f"led_{expected.led[k] + 1}"].astype(float)
        if image[int(place[1]), int(place[0])] > 5000:
            light = np.maximum(image - np.median(image), 0)
            off.append(np.hypot(*(photograph_centroid(light, place, 6) - place)))
    assert len(off) > 3
    # What is left of one cycle a pixel moves a centroid by up to a hundredth of a pixel.
    assert max(off) < 0.03


def test_the_lit_object_is_what_a_capture_traces(
    small: Small, export: ExportedDesign, plan: Plan
) -> None:
    run, machine = small.run, small.machine
    number = 3
    assert run.frames[number].object_turn_deg == 180
    directions = pixel_directions(machine.camera)[50:500:3]
    mine = object_light(
        machine.camera.pinhole, directions, balls_of_frame(run.built, number), run.scene, True
    )
    _, half = machine_runs(export, plan, machine, run.frames)
    turned = np.array([-1.0, -1.0, 1.0])
    flat = directions.reshape(-1, 3) * turned
    stop = np.full(len(flat), run.frames[number].stop - 1)
    theirs = camera_colours(run.scene, half.camera.pinhole, flat, trace_balls(half, flat, stop))
    same = np.abs(mine.reshape(-1, 3) - theirs).max(axis=1) < 1
    assert (theirs.max(axis=1) > 30).sum() > 300
    assert same.mean() > 0.999


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
