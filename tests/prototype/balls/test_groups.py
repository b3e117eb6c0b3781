import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.balls.selection import group_mirrors


def test_one_group_is_the_mean_and_many_are_bands_or_refused(paper_array: MirrorArray) -> None:
    polar, radius = paper_array.polar, paper_array.mirrors.radius
    groups = group_mirrors(polar, radius, 1, 0.25)
    assert groups.polar == pytest.approx([polar.mean()])
    assert groups.radius == pytest.approx([radius.mean()])
    bands = group_mirrors(polar, radius, 16, 0.0)
    assert (np.diff(bands.group_of[np.argsort(polar, kind="stable")]) >= 0).all()
    assert (np.diff(bands.polar) > 0).all()
    for k in (848, 5000):
        with pytest.raises(SpecError, match=rf"prototype.k is {k}, but camera a has 847 mirrors"):
            group_mirrors(polar, radius, k, 0.25)


def test_every_mirror_is_in_the_nearest_group(paper_array: MirrorArray) -> None:
    """What k-means promises; 16 even bands over 90 degrees would be off by 2.81 at most."""
    polar, radius = np.degrees(paper_array.polar), paper_array.mirrors.radius
    groups = group_mirrors(paper_array.polar, radius, 16, 0.25)
    away = (polar[:, None] - np.degrees(groups.polar)) ** 2
    away += (0.25 * (radius[:, None] - groups.radius)) ** 2
    assert (away.argmin(axis=1) == groups.group_of).all()
    assert np.abs(np.degrees(groups.polar[groups.group_of]) - polar).max() < 3.2


@settings(max_examples=40)
@given(st.data())
def test_no_group_is_empty_or_it_is_said(data: st.DataObject) -> None:
    count = data.draw(st.integers(1, 30))
    places = st.lists(st.floats(0.1, 3), min_size=count, max_size=count)
    polar, radius = np.array(data.draw(places)), np.array(data.draw(places))
    k = data.draw(st.integers(1, count + 1))
    try:
        groups = group_mirrors(polar, radius, k, 1.0)
    except SpecError as error:
        assert "prototype.k" in str(error)  # noqa: PT017
        return
    assert set(groups.group_of.tolist()) == set(range(k))
    assert groups.minimum(polar) == pytest.approx(
        [polar[groups.group_of == j].min() for j in range(k)]
    )
