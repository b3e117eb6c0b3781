"""What the fast model makes of one half; tests/validation holds it against other means."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.montecarlo.coverage import coverage, mirror_coverage, virtual_camera_numbers
from tbcad.tolerancing.montecarlo.draws import ShellDraws, draw
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_model
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tests.tolerancing.exact_builds import surrounded


def none(halves: EdgeModels, builds: int = 1) -> tuple[ShellDraws, ShellDraws]:
    return draw(Errors(), 1, range(builds), len(halves[0]))


def test_virtual_cameras_share_halved_mirrors(halves: EdgeModels) -> None:
    which, m = virtual_camera_numbers(halves[1].halved), len(halves[0])
    halved = halves[0].halved
    assert len(np.unique(which)) == which.max() + 1 == 2 * m - halved.sum() == 193
    assert np.array_equal(which[:m], np.arange(m))
    assert np.array_equal(which[m:][halved], np.flatnonzero(halved))
    assert (which[m:][~halved] >= m).all()


def test_facets_take_as_much_of_the_coverage(halves: EdgeModels) -> None:
    draws = draw(Errors(facets=Error(0, 0.4)), 1, range(1), len(halves[0]))
    lost = coverage(halves, none(halves)) - coverage(halves, draws)
    assert lost == pytest.approx(0.4, abs=1e-12)


def test_lesser_half_of_a_mirror_on_the_seam_counts(halves: EdgeModels) -> None:
    a, b = none(halves)
    shrunk = replace(b, radius=np.where(halves[1].halved, 0.2, 0.0)[None])
    both = coverage(halves, (a, shrunk))
    one, other = mirror_coverage(halves[0], a), mirror_coverage(halves[1], shrunk)
    halved = halves[0].halved
    lesser = (other.diameter < one.diameter)[0, halved]
    assert 0 < lesser.sum() < halved.sum()
    least = np.where(lesser, other.diameter[0, halved], one.diameter[0, halved])
    assert np.array_equal(both[0, : len(halved)][halved], least)


def test_mirror_that_its_neighbours_swallow_sees_nothing(halves: EdgeModels) -> None:
    """Its sphere moved back behind theirs, it has no cell."""
    lost = int(np.flatnonzero(~halves[0].halved)[10])
    a, b = none(halves)
    centre = np.zeros_like(a.centre)
    centre[0, lost] = -5 * halves[0].table[lost, 3:6]
    sees = coverage(halves, (replace(a, centre=centre), b))
    assert sees[0, lost] == 0
    assert np.delete(sees[0], lost).min() > 0


@pytest.mark.parametrize(("shift", "all_look"), [(3.0, True), (45.0, False), (60.0, False)])
def test_mirror_that_looks_past_the_object_sees_nothing(
    halves: EdgeModels, small_design: MirrorDesign, shift: float, all_look: bool
) -> None:
    """Its rays may miss the middle by far and yet not surround it."""
    a, _ = none(halves)
    moved = replace(a, camera_shift=np.array([[0.0, shift, 0.0]]))
    one, whole = mirror_coverage(halves[0], moved), ~halves[0].halved
    wanted = surrounded(small_design.arrays[0], moved.camera_shift[0])
    assert np.array_equal(one.crossings[0, whole] % 2 == 1, wanted[whole])
    assert wanted[whole].all() == all_look


def test_mirror_that_sends_light_sideways_surrounds_the_object() -> None:
    """Off mirror a0022 rays fan out to 96 degrees from its axis: some never meet the screen."""
    options = ["n=3", "camera_mm=[70, 0, -38.8]", "semi_minor_mm=33.8", "capture_diameter_mm=20"]
    mirrors = design(load_spec(None, options))
    a, b = (edge_model(at) for at in reflectors(mirrors))
    sees = coverage((a, b), none((a, b)))
    assert sees[0, : len(a)] == pytest.approx(mirrors.arrays[0].coverage, abs=1e-3)


def test_errors_larger_than_a_mirror_are_refused(halves: EdgeModels) -> None:
    draws = draw(Errors(sphere_radius=Error(0, -1e3)), 1, range(1), len(halves[0]))
    with pytest.raises(InputError, match=r"sphere_radius_um.*make the errors smaller"):
        coverage(halves, draws)


SPHERES = ("sphere_centre", "sphere_radius", "camera_shift", "facets")


@pytest.mark.parametrize(
    ("kinds", "size"),
    [
        *product([SPHERES], [1e-6, 1e-3, 0.1]),
        *product([("sphere_centre", "waviness")], [1e-4, 2e-3]),
    ],
)
def test_same_minimum_where_only_that_is_asked(
    halves: EdgeModels, kinds: tuple[str, ...], size: float
) -> None:
    """Parts of edges that are passed over change no bit of it."""
    errors = Errors(**{kind: Error(size) for kind in kinds}, scale_axis=Error(size / 20))
    draws = draw(errors, 5, range(4), len(halves[0]))
    whole, worst = (coverage(halves, draws, only) for only in (False, True))
    assert np.array_equal(worst.min(axis=1), whole.min(axis=1))
    assert (worst >= whole - 1e-9).all()


def test_planar_mirrors_with_a_thick_coat_move_and_stay_planar() -> None:
    """Their cells are cut by straight edges; all moved along their normals they stay alike."""
    flat = design(load_spec(None, ["n=4", "radius_rule=flat"]))
    a, b = (edge_model(at) for at in reflectors(flat))
    bare = coverage((a, b), draw(Errors(), 1, range(1), len(a)))
    coated = coverage((a, b), draw(Errors(coating=Error(0, 0.05)), 1, range(1), len(a)))
    assert bare[0, : len(a)] == pytest.approx(flat.arrays[0].coverage, abs=1e-5)
    assert 0 < np.abs(coated - bare).max() < 1
