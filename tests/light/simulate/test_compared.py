"""Comparisons of views: a difference has shades with a scale, and letters that can be read."""

import numpy as np

from tbcad.common.figure_files import shade_bytes
from tbcad.light.simulate.image_files import GAP_PX, compared, difference


def test_the_difference_is_that_of_the_worst_channel() -> None:
    """Nothing, a quarter of white in blue alone, and more than half of it."""
    truth = np.zeros((1, 3, 3), dtype=np.uint8)
    picture = np.array([[[0, 0, 0], [9, 0, 64], [200, 0, 0]]], dtype=np.uint8)
    expected = shade_bytes(np.array([0, 64 / 127.5, 1]))
    assert (difference(truth, picture)[0] == expected).all()
    assert (difference(picture, truth)[0] == expected).all()


def test_the_scale_runs_through_all_shades_above_the_difference() -> None:
    black = np.zeros((480, 640, 3), dtype=np.uint8)
    sheet = compared({"depth": black, "ray-traced": black})
    label = sheet.shape[0] - 480
    assert sheet.shape[1] == 3 * 640 + 2 * GAP_PX
    assert label >= sheet.shape[1] / 60  # letters are a sixtieth of the width
    shown = {tuple(colour) for colour in sheet[label // 2, 2 * (640 + GAP_PX) :].tolist()}
    ends = shade_bytes(np.array([0.0, 1.0])).tolist()
    assert {tuple(end) for end in ends} <= shown
    assert tuple(ends[1]) not in {tuple(c) for c in sheet[label // 2, : 2 * 640].tolist()}


def test_shades_rise_in_lightness_for_any_colour_vision() -> None:
    """Machado, Oliveira, Fernandes (2009): protanopia and deuteranopia."""
    light = (shade_bytes(np.linspace(0, 1, 17)) / 255.0) ** 2.2
    for seen in (
        np.eye(3),
        [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
        [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    ):
        luminance = light @ np.array(seen).T @ [0.2126, 0.7152, 0.0722]
        assert (np.diff(luminance) > 0).all()
