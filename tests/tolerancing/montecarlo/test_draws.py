from dataclasses import fields, replace

import numpy as np
import pytest

from tbcad.tolerancing.montecarlo.draws import ShellDraws, draw
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors

M = 4
ALL = Errors(**{field.name: Error(0.001) for field in fields(Errors)})
# The foot moves where neighbours share a warp, see test_warp.
NAMES = [field.name for field in fields(ShellDraws) if field.name != "foot"]


def test_a_build_is_the_same_alone_or_among_others() -> None:
    together = draw(ALL, 5, range(7), M)
    for half, alone in zip(together, draw(ALL, 5, range(4, 5), M), strict=True):
        for name in NAMES:
            assert np.array_equal(getattr(half, name)[4:5], getattr(alone, name)), name


def test_builds_seeds_and_halves_differ() -> None:
    a, b = draw(ALL, 5, range(2), M)
    other, _ = draw(ALL, 6, range(2), M)
    for name in NAMES:
        assert np.all(getattr(a, name)[0] != getattr(a, name)[1]), name
        assert np.all(getattr(a, name) != getattr(other, name)), name
        assert np.all(getattr(a, name) != getattr(b, name)), name


def test_kinds_are_drawn_apart() -> None:
    """No error is another one over again."""
    drawn = draw(ALL, 5, range(1), M)
    alike = ("shell_shift", "shell_tilt", "camera_shift", "camera_tilt", "centre")
    every = np.concatenate([getattr(half, name).ravel() for half in drawn for name in alike])
    assert len(np.unique(every)) == len(every)


@pytest.mark.parametrize("kind", ["sphere_centre", "scale_isotropic", "camera_tilt", "facets"])
def test_without_one_kind_the_others_stay(kind: str) -> None:
    """Sensitivities then compare the same builds."""
    full, less = (
        draw(errors, 5, range(2), M)[0] for errors in (ALL, replace(ALL, **{kind: Error()}))
    )
    changed = [
        name for name in NAMES if not np.array_equal(getattr(full, name), getattr(less, name))
    ]
    goes_into = {"sphere_centre": "centre", "scale_isotropic": "scale", "facets": "facets"}
    assert changed == [goes_into.get(kind, kind)]


def test_twice_the_spread_is_twice_the_error() -> None:
    one, two = (draw(Errors(sphere_centre=Error(s)), 5, range(2), M)[1] for s in (0.1, 0.2))
    assert two.centre == pytest.approx(2 * one.centre, rel=1e-15)


def test_normal_errors_have_mean_and_standard_deviation() -> None:
    centre = draw(Errors(sphere_centre=Error(0.3, 0.1)), 1, range(200), 50)[0].centre
    count = centre.size
    assert centre.mean() == pytest.approx(0.1, abs=4 * 0.3 / np.sqrt(count))
    assert centre.std() == pytest.approx(0.3, rel=4 / np.sqrt(2 * count))


def test_uniform_errors_fill_their_half_width() -> None:
    shift = draw(Errors(camera_shift=Error(0.3, 0.1, "uniform")), 1, range(400), M)[0].camera_shift
    assert np.abs(shift - 0.1).max() <= 0.3
    assert shift.min() < -0.19
    assert shift.max() > 0.39
    assert shift.std() == pytest.approx(0.3 / np.sqrt(3), rel=0.1)


def test_what_one_build_or_one_shell_has_in_common() -> None:
    a, b = draw(Errors(scale_axis=Error(0.01), coating=Error(0.02, 0.005)), 1, range(3), M)
    assert np.array_equal(a.scale, b.scale)
    assert len(np.unique(a.scale)) == 9
    assert np.all(a.radius == a.radius[:, :1])
    assert np.all(a.radius != b.radius)
    isotropic, other = draw(Errors(scale_isotropic=Error(0.01)), 1, range(3), M)
    assert np.all(isotropic.scale == isotropic.scale[:, :1])
    assert np.all(isotropic.scale != other.scale)


def test_no_errors_and_no_builds() -> None:
    perfect, _ = draw(Errors(), 1, range(2), M)
    assert np.array_equal(perfect.scale, np.ones((2, 3)))
    assert not perfect.centre.any()
    none, _ = draw(ALL, 1, range(0), M)
    assert (len(none), none.centre.shape, none.radius.shape) == (0, (0, M, 3), (0, M))
