"""Photographs through a real lens, as Mitsuba and Blender give them (`render_real`).

A knot with shadows on itself before six lamps, matt and glossy, and highlights on a ball.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from tbcad.light.simulate.scene.object import patterned_ball
from tests.clients.real_machine import (
    BALL_LAMP,
    BALL_MM,
    ROUGHNESS,
    compared,
    kept,
    machine,
    our_light,
)

pytestmark = pytest.mark.clients
RENDERERS = ("mitsuba", "blender")
DARK, BRIGHT = 10.0, 30.0  # levels


@pytest.fixture(scope="module")
def matt() -> np.ndarray:
    return our_light(machine().subject, machine().lamps, None)


@pytest.fixture(scope="module")
def glossy() -> np.ndarray:
    return our_light(machine().subject, machine().lamps, ROUGHNESS)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_lamps_and_shadows(matt: np.ndarray, renderer: str) -> None:
    """Levels of 255 where the object is lit: what is left is 2 x 2 rays at its edges."""
    theirs = kept(f"{renderer}_matt")
    lit = (compared() > 0) & (np.maximum(matt, theirs).max(axis=2) > DARK)
    apart = matt - theirs
    assert lit.sum() > 50_000
    assert abs(apart[lit].mean()) < 0.5  # of 47: nothing is scaled to fit
    assert np.sqrt(np.mean(apart[lit] ** 2)) < 5
    assert np.sqrt(np.mean(apart[binary_erosion(lit, iterations=2)] ** 2)) < 2.5


@pytest.mark.parametrize("renderer", RENDERERS)
def test_highlights_are_as_bright(matt: np.ndarray, glossy: np.ndarray, renderer: str) -> None:
    theirs = kept(f"{renderer}_gloss")
    lit = (compared() > 0) & (np.maximum(matt, kept(f"{renderer}_matt")).max(axis=2) > DARK)
    ours = (glossy - matt)[..., 0]
    assert ours[lit].mean() == pytest.approx(theirs[lit].mean(), rel=0.03)
    assert np.corrcoef(ours[lit], theirs[lit])[0, 1] > 0.9


@pytest.mark.parametrize("renderer", RENDERERS)
def test_highlights_are_where_theirs_are(renderer: str) -> None:
    """One on the ball in each mirror: its middle, pixels."""
    lamps, ball = machine().lamps, patterned_ball(BALL_MM)
    lamp = replace(lamps, places=lamps.places[[BALL_LAMP]], inward=lamps.inward[[BALL_LAMP]])
    levels = [our_light(ball, lamp, gloss)[..., 0] for gloss in (ROUGHNESS, None)]
    ours, theirs = levels[0] - levels[1], kept(f"{renderer}_ball")
    apart = []
    for number in range(1, compared().max() + 1):
        place = np.argwhere(compared() == number)
        light = [one[compared() == number] for one in (ours, theirs)]
        if light[1].max(initial=0) > BRIGHT:
            middles = [(one @ place) / one.sum() for one in light]
            apart.append(middles[0] - middles[1])
    assert len(apart) > 20
    assert np.sqrt(np.mean(np.square(apart))) < 0.05
