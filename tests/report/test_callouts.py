"""Call-outs: circles apart from each other, lines that do not cross."""

import itertools

import numpy as np
import pytest

from tbcad.report.exploded import RADIUS, Callout, cross, place_callouts

SIZE = (1500, 950)


@pytest.mark.parametrize("seed", range(20))
def test_lines_do_not_cross_and_circles_do_not_overlap(seed: int) -> None:
    random = np.random.default_rng(seed)
    anchors = random.uniform((200, 50), (1300, 900), (random.integers(1, 20), 2)).tolist()
    placed = place_callouts([Callout(k, 1, (x, y)) for k, (x, y) in enumerate(anchors)], SIZE)
    assert sorted(one.callout.number for one in placed) == [*range(len(anchors))]
    for a, b in itertools.combinations(placed, 2):
        assert np.hypot(*np.subtract(a.middle, b.middle)) > 2 * RADIUS
        assert not cross(a.middle, a.callout.anchor, b.middle, b.callout.anchor)
    assert all(0 < one.middle[1] < SIZE[1] for one in placed)
