import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.balls.groups import group_mirrors


def test_one_group_is_the_mean(paper_array: MirrorArray) -> None:
    groups = group_mirrors(paper_array.polar, paper_array.mirrors.radius, 1, 0.25)
    assert groups.polar == pytest.approx([paper_array.polar.mean()])
    assert groups.radius == pytest.approx([paper_array.mirrors.radius.mean()])


def test_by_polar_angle_alone_groups_are_bands(paper_array: MirrorArray) -> None:
    groups = group_mirrors(paper_array.polar, paper_array.mirrors.radius, 16, 0.0)
    order = np.argsort(paper_array.polar, kind="stable")
    assert (np.diff(groups.group_of[order]) >= 0).all()
    assert (np.diff(groups.polar) > 0).all()


def test_every_mirror_is_in_the_nearest_group(paper_array: MirrorArray) -> None:
    """What k-means promises, whatever its start."""
    polar, radius = np.degrees(paper_array.polar), paper_array.mirrors.radius
    groups = group_mirrors(paper_array.polar, radius, 16, 0.25)
    away = (polar[:, None] - np.degrees(groups.polar)) ** 2
    away += (0.25 * (radius[:, None] - groups.radius)) ** 2
    assert (away.argmin(axis=1) == groups.group_of).all()


def test_worst_direction_is_nearly_the_least_possible(paper_array: MirrorArray) -> None:
    """16 even bands over 90 degrees would be off by 2.81 at most."""
    groups = group_mirrors(paper_array.polar, paper_array.mirrors.radius, 16, 0.25)
    error = np.degrees(np.abs(groups.polar[groups.group_of] - paper_array.polar))
    assert error.max() < 3.2


@pytest.mark.parametrize("k", [848, 847, 5000])
def test_more_groups_than_mirrors(paper_array: MirrorArray, k: int) -> None:
    with pytest.raises(SpecError, match=rf"prototype.k is {k}, but camera a has 847 mirrors"):
        group_mirrors(paper_array.polar, paper_array.mirrors.radius, k, 0.25)


@settings(max_examples=60)
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
