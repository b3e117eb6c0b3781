"""Where ribs and rings are left out: not where numbers are, and no short rest is left."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.gaps import MIN_PART_MM, STEP_MM, _runs, rib_gaps, ring_arcs
from tbcad.prototype.base.layout import BaseLayout, base_layout


@pytest.fixture(scope="module")
def base(paper_prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(BaseSpec(), paper_prototype)


def test_arcs_miss_every_number(base: BaseLayout) -> None:
    seats = base.local_seats
    for ring in base.rings:
        z, r = ring.mean(axis=0)
        for low, high in ring_arcs(base, ring, *base.sector):
            assert (high - low) * ring[:, 1].max() >= MIN_PART_MM - STEP_MM
            azimuth = np.linspace(low, high, 500)
            points = np.stack([r * np.cos(azimuth), r * np.sin(azimuth), 0 * azimuth + z], axis=1)
            for k in range(len(seats)):
                offset = points - (seats.centre[k] + seats.back[k] * seats.axis[k])
                along = offset @ seats.axis[k]
                beside = np.linalg.norm(offset - along[:, None] * seats.axis[k], axis=1)
                assert not ((along > 0) & (beside < seats.boss[k])).any()


def test_a_rib_without_bosses_is_whole_and_others_are_not(base: BaseLayout) -> None:
    sides = [0.0, -0.5, -0.5, -1.0]
    counts = [len(rib_gaps(base, a, s)) for a, s in zip(base.ribs.tolist(), sides, strict=True)]
    assert counts[0] == counts[-1] == 0  # the edges' ribs stand beyond all bosses
    assert max(counts) > 0


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.floats(0.1, 10))
def test_runs_are_the_free_places_without_the_short_ones(free: list[bool], shortest: float) -> None:
    at = np.arange(len(free), dtype=float)
    found = _runs(at, np.array(free), shortest)
    for low, high in found:
        assert all(free[int(low) : int(high) + 1])
        assert high - low >= shortest
        assert low == 0 or not free[int(low) - 1]
    text = "".join("x" if one else " " for one in free)
    assert len(found) == sum(len(run) - 1 >= shortest for run in text.split())
