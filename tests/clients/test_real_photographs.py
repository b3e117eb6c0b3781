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
    STEP,
    compared,
    kept,
    machine,
    our_light,
    steps,
)

pytestmark = pytest.mark.clients
RENDERERS = ("mitsuba", "blender")
DARK, BRIGHT = 10.0, 100.0  # levels
INCIDENCE_DEG = 55.0


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
    assert np.sqrt(np.mean(apart[binary_erosion(lit, iterations=2)] ** 2)) < 3


@pytest.mark.parametrize("renderer", RENDERERS)
def test_highlights_are_as_bright(matt: np.ndarray, glossy: np.ndarray, renderer: str) -> None:
    theirs = kept(f"{renderer}_gloss")
    lit = (compared() > 0) & (np.maximum(matt, kept(f"{renderer}_matt")).max(axis=2) > DARK)
    ours = (glossy - matt)[..., 0]
    assert ours[lit].mean() == pytest.approx(theirs[lit].mean(), rel=0.03)
    assert np.corrcoef(ours[lit], theirs[lit])[0, 1] > 0.9


@pytest.fixture(scope="module")
def on_ball() -> np.ndarray:
    """The highlight of a lamp alone, in the steps of those that are kept, (h, w)."""
    lamps, ball = machine().lamps, patterned_ball(BALL_MM)
    lamp = replace(lamps, places=lamps.places[[BALL_LAMP]], inward=lamps.inward[[BALL_LAMP]])
    shiny, matt = (our_light(ball, lamp, gloss)[..., 0] for gloss in (ROUGHNESS, None))
    return STEP * steps(shiny - matt).astype(np.float64)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_highlights_are_where_theirs_are(on_ball: np.ndarray, renderer: str) -> None:
    """One on the ball in each mirror: its centroid, pixels.

    Those at larger angles of incidence are as bright as the lamp: theirs are cut out with it.
    """
    toward = machine().lamps.places[BALL_LAMP]
    cosine = machine().reflector.u @ toward / np.linalg.norm(toward)
    apart, theirs = [], kept(f"{renderer}_ball")
    for number in 1 + np.flatnonzero(np.degrees(np.arccos(cosine)) / 2 < INCIDENCE_DEG):
        own = compared() == number
        if theirs[own].max(initial=0) > BRIGHT:
            middles = [
                np.average(np.argwhere(own), axis=0, weights=one[own]) for one in (on_ball, theirs)
            ]
            apart.append(middles[0] - middles[1])
    assert len(apart) > 20
    assert np.sqrt(np.mean(np.square(apart))) < 0.05
