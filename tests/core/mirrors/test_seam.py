import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorArray, design
from tbcad.core.optics.reflection import reflected_rays
from tbcad.core.optics.windows import aimed, cut_positions, seam_gaps
from tbcad.core.spec.load import load_spec


def array_of(*options: str) -> MirrorArray:
    return design(load_spec(None, list(options))).arrays[0]


@pytest.fixture(scope="module")
def traced() -> MirrorArray:
    return array_of("n=6")


@pytest.fixture(scope="module")
def paper() -> MirrorArray:
    return array_of("n=6", "mirrors.radius_rule=paper")


def aims(array: MirrorArray) -> np.ndarray:
    """Where the rays over the apices pierce the planes through the origin across u, (m, 3)."""
    apex, pinhole = array.mirrors.apex, array.ellipsoid.pinhole
    ray = reflected_rays(pinhole, apex, array.mirrors.normal)
    length = (apex * array.u).sum(axis=1) / (ray * array.u).sum(axis=1)
    return np.asarray(apex - length[:, None] * ray)


def test_a_mirror_is_aimed_at_a_point_of_the_x_axis(paper: MirrorArray) -> None:
    wanted = np.linspace(0, 3, len(paper))
    turned = aimed(paper.mirrors, paper.ellipsoid.pinhole, wanted)
    ray = reflected_rays(paper.ellipsoid.pinhole, turned.apex, turned.normal)
    to_point = np.column_stack([-wanted, 0 * wanted, 0 * wanted]) - turned.apex
    along = to_point / np.linalg.norm(to_point, axis=1)[:, None]
    assert np.abs(ray - along).max() < 1e-12
    assert (turned.normal[0] == paper.mirrors.normal[0]).all()


def test_only_halved_mirrors_are_aimed_elsewhere(traced: MirrorArray) -> None:
    at, halved = aims(traced), traced.cells.halved
    assert np.abs(at[~halved]).max() < 1e-9
    assert np.abs(at[halved, 1:]).max() < 1e-9
    assert (at[halved, 0] < 0).all()
    assert at[halved, 0].min() > -4


def test_halves_overlap_by_the_margin(traced: MirrorArray) -> None:
    """Over the object and its margin each half sees half the margin beyond x = 0, no more."""
    position = cut_positions(traced.cells, traced.ellipsoid.pinhole, 30.3)
    assert position[traced.cells.halved] == pytest.approx(-0.3, abs=1e-4)
    assert (position[~traced.cells.halved] == -np.inf).all()
    assert not seam_gaps(traced.cells, traced.ellipsoid.pinhole, 30.0).any()


def test_halves_that_overlap_anyway_are_not_aimed() -> None:
    """Of a small object a planar mirror's halves see each their side, up to x = 0."""
    flat = array_of("n=4", "mirrors.radius_rule=flat", "capture_diameter_mm=20")
    assert np.abs(aims(flat)).max() < 1e-9
    assert not seam_gaps(flat.cells, flat.ellipsoid.pinhole, 10.0).any()
    assert flat.coverage.min() > 21


def test_a_gap_counts_against_coverage(paper: MirrorArray) -> None:
    gap = seam_gaps(paper.cells, paper.ellipsoid.pinhole, 30.0)
    halved = paper.cells.halved
    assert not gap[~halved].any()
    assert gap[halved].max() > 3
    wide = gap > 0
    assert (paper.coverage[wide] <= 60 - gap[wide]).all()
