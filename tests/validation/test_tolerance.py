"""The fast model of simulated builds against closed forms, slow tracing and the verification."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tbcad_verify.record.export import Export

from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.montecarlo.builds import scaled
from tbcad.tolerancing.montecarlo.coverage import coverage, mirror_coverage, pointing
from tbcad.tolerancing.montecarlo.draws import ShellDraws, draw
from tbcad.tolerancing.montecarlo.edge_model import EdgeModel, EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tests.tolerancing.exact_builds import (
    bisected_coverage,
    read_record_of,
    traced_coverage,
    verified_coverage,
    write_meshes,
)

# What a careless maker might leave; even scale only, as the slow means know no other.
COARSE = Errors(
    sphere_centre=Error(0.05),
    sphere_radius=Error(0.05),
    scale_isotropic=Error(0.002),
    camera_shift=Error(0.2),
    coating=Error(0.01, 0.005),
)
POSED = replace(COARSE, shell_shift=Error(0.2), shell_tilt=Error(0.002))
TARGET = 60.0


def halves_of(made: MirrorDesign) -> EdgeModels:
    return edge_models(reflectors(made))


@pytest.fixture(scope="module")
def halves(small_design: MirrorDesign) -> EdgeModels:
    return halves_of(small_design)


def perfect(half: EdgeModel) -> ShellDraws:
    return draw(Errors(), 1, range(1), len(half))[0]


def row(*vector: float) -> np.ndarray:
    return np.array([vector])


# Without errors


@pytest.mark.parametrize("settings", [("n=5",), ("n=4", "radius_rule=flat")])
def test_without_errors_it_is_the_design(settings: tuple[str, ...]) -> None:
    """To the accuracy of the design's own samples, 1e-5 mm; the next test goes farther."""
    made = design(load_spec(None, settings))
    for array, fast in zip(made.arrays, halves_of(made), strict=True):
        one = mirror_coverage(fast, perfect(fast))
        assert one.diameter[0] == pytest.approx(array.coverage, abs=2e-5)
        assert (one.crossings[0, ~fast.halved] % 2 == 1).all()


def test_without_errors_it_is_the_paper_design(paper_design: MirrorDesign) -> None:
    """Within 1e-6 mm of the slow tracing with finer samples.

    The coverage that the design records is off by up to 5.6e-6 mm: its samples' parabola.
    """
    halves = halves_of(paper_design)
    draws = tuple(perfect(fast) for fast in halves)
    for half, fast, drawn in zip(paper_design.arrays, halves, draws, strict=True):
        found = mirror_coverage(fast, drawn).diameter[0]
        assert np.abs(found - traced_coverage(half, drawn, 0)).max() < 1e-6
        assert np.abs(found - half.coverage).max() < 1e-5
    every, _ = coverage(halves, draws)
    assert every.shape == (1, 1657)
    assert every.min() == pytest.approx(60.6, abs=1e-3)


# One error whose effect is known


def designed_rays(half: EdgeModel) -> tuple[np.ndarray, np.ndarray]:
    """Rays off the apices, and their points nearest to the object's middle, (m, 3) each."""
    apex, normal = half.table[:-2, :3], half.table[:-2, 3:6]
    way = apex - half.view.pinhole
    way = way - 2 * np.einsum("mx,mx->m", way, normal)[:, None] * normal
    way /= np.linalg.norm(way, axis=1)[:, None]
    return way, apex - np.einsum("mx,mx->m", apex, way)[:, None] * way


def test_what_moves_together_changes_nothing(halves: EdgeModels) -> None:
    """Shell and camera turned about the object's middle; rays then turn by as much."""
    turn, view = row(0.01, -0.02, 0.03), halves[0].view
    rotation = Rotation.from_rotvec(turn[0])
    shift = rotation.apply(view.pinhole) - view.pinhole
    still = perfect(halves[0])
    moved = replace(still, shell_tilt=turn, camera_tilt=turn, camera_shift=shift[None])
    before, after = mirror_coverage(halves[0], still), mirror_coverage(halves[0], moved)
    assert after.diameter == pytest.approx(before.diameter, abs=1e-9)
    assert after.pixels == pytest.approx(before.pixels, rel=1e-9)
    angle, offset = pointing(halves[0], moved)
    way, nearest = designed_rays(halves[0])
    turned = np.arccos(np.einsum("mx,mx->m", way, rotation.apply(way)))
    # Of a mirror on the seam the object's point that its ray was aimed at has not moved.
    left = np.cross(rotation.apply(nearest) - nearest, rotation.apply(way))
    assert offset[0] == pytest.approx(np.linalg.norm(left, axis=1), abs=1e-9)
    assert offset[0, ~halves[0].halved].max() < 1e-9
    assert angle[0] == pytest.approx(turned, abs=1e-9)


def test_moved_shell_is_moved_camera_and_object(halves: EdgeModels) -> None:
    """All rays pass by what is left behind: to first order the shell's shift, across the ray."""
    shift = row(0.3, -0.2, 0.1)
    still = perfect(halves[0])
    together = replace(still, shell_shift=shift, camera_shift=shift)
    way, _ = designed_rays(halves[0])
    across = shift - np.einsum("mx,kx->mk", way, shift) * way
    assert pointing(halves[0], together)[1][0] == pytest.approx(np.linalg.norm(across, axis=1))
    assert pointing(halves[0], together)[0].max() < 1e-12


@pytest.mark.parametrize("size", [0.98, 1.03])
def test_larger_build_covers_more_in_proportion(halves: EdgeModels, size: float) -> None:
    still = perfect(halves[0])
    pinhole = halves[0].view.pinhole
    larger = replace(still, scale=row(size, size, size), camera_shift=(size - 1) * pinhole[None])
    before, after = mirror_coverage(halves[0], still), mirror_coverage(halves[0], larger)
    assert after.diameter == pytest.approx(size * before.diameter, abs=1e-9)
    assert after.pixels == pytest.approx(before.pixels, rel=1e-9)
    angle, offset = pointing(halves[0], larger)
    # The rays of mirrors on the seam, which are aimed beside the middle, keep their proportion too.
    beside = np.linalg.norm(designed_rays(halves[0])[1], axis=1)
    assert offset[0] == pytest.approx(abs(size - 1) * beside, abs=1e-12)
    assert angle.max() < 1e-12


def lever(half: EdgeModel, start: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First-order offset and angle of rays to apices P moved by start and turned by (m, 3).

    A ray along d that meets the tangent plane x off the apex finds the normal turned by x k
    there, so that it leaves turned by the mirror image of its own turn and by
    -2 ((d . x k) N + (d . N) x k), and arrives |P| farther at x and |P| times that, across itself.
    """
    apex, normal, curvature = np.split(half.table[:-2], [3, 6], axis=1)
    way = apex - half.view.pinhole
    far = np.linalg.norm(way, axis=1)[:, None]
    d = way / far

    def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.sum(a * b, axis=1)[:, None]

    x = start + far * turn
    x = x - d * dot(x, normal) / dot(d, normal)
    bent = -2 * curvature * (dot(d, x) * normal + dot(d, normal) * x)
    bent += turn - 2 * dot(turn, normal) * normal
    out = d - 2 * dot(d, normal) * normal
    moved = x + np.linalg.norm(apex, axis=1)[:, None] * bent
    moved = moved - dot(moved, out) * out
    return np.linalg.norm(moved, axis=1), np.linalg.norm(bent, axis=1)


def shifted(half: EdgeModel, size: float) -> tuple[ShellDraws, np.ndarray, np.ndarray]:
    shift = size * row(1.0, 2.0, -1.0)
    return replace(perfect(half), camera_shift=shift), shift, np.zeros((1, 3))


def tilted(half: EdgeModel, size: float) -> tuple[ShellDraws, np.ndarray, np.ndarray]:
    turn = size / 100 * row(1.0, 2.0, -1.0)
    way = half.table[:-2, :3] - half.view.pinhole
    way /= np.linalg.norm(way, axis=1)[:, None]
    return replace(perfect(half), camera_tilt=turn), np.zeros((1, 3)), np.cross(turn, way)


def longer(half: EdgeModel, size: float) -> tuple[ShellDraws, np.ndarray, np.ndarray]:
    """A pixel then stands for an angle of lesser tangent from the optical axis."""
    way = half.table[:-2, :3] - half.view.pinhole
    way /= np.linalg.norm(way, axis=1)[:, None]
    forward = half.view.forward
    radial = way - (way @ forward)[:, None] * forward
    turn = -size / 100 * (radial - np.sum(radial * way, axis=1)[:, None] * way)
    return replace(perfect(half), focal=np.array([1 + size / 100])), np.zeros((1, 3)), turn


@pytest.mark.parametrize("error", [shifted, tilted, longer])
def test_pointing_error_is_the_lever_of_a_curved_mirror(
    halves: EdgeModels,
    error: Callable[[EdgeModel, float], tuple[ShellDraws, np.ndarray, np.ndarray]],
) -> None:
    for array in halves:
        draws, start, turn = error(array, 1e-4)
        offset, angle = lever(array, start, turn)
        found_angle, found_offset = pointing(array, draws)
        assert found_offset[0] == pytest.approx(offset, rel=1e-3, abs=1e-8)
        assert found_angle[0] == pytest.approx(angle, rel=1e-3, abs=1e-10)


def test_radius_of_one_mirror_alone(halves: EdgeModels, small_design: MirrorDesign) -> None:
    """Its own coverage by brute force; its neighbours see less or more, all others the same."""
    half, alone = small_design.arrays[0], 40
    radius = np.zeros((1, len(half)))
    radius[0, alone] = 0.1
    drawn = replace(perfect(halves[0]), radius=radius)
    found = mirror_coverage(halves[0], drawn).diameter[0]
    assert found[alone] == pytest.approx(bisected_coverage(half, drawn, 0, alone), abs=1e-4)
    before = mirror_coverage(halves[0], perfect(halves[0])).diameter[0]
    faces = half.cells.arcs.faces
    touched = np.unique(faces[(faces == alone).any(axis=1)])
    others = np.setdiff1d(np.arange(len(half)), touched)
    assert np.array_equal(found[others], before[others])
    assert (found[touched[touched < len(half)]] != before[touched[touched < len(half)]]).any()


def test_coat_too_thick_is_radii_too_large(halves: EdgeModels) -> None:
    m = len(halves[0])
    coat, _ = draw(Errors(coating=Error(0, 0.03)), 1, range(1), m)
    radii, _ = draw(Errors(sphere_radius=Error(0, 0.03)), 1, range(1), m)
    both = [mirror_coverage(halves[0], one).diameter for one in (coat, radii)]
    assert np.array_equal(*both)
    assert (both[0] != mirror_coverage(halves[0], perfect(halves[0])).diameter).all()


# Random builds


@pytest.mark.parametrize("share", [0.1, 4.0])
def test_random_builds_against_slow_tracing(
    halves: EdgeModels, small_design: MirrorDesign, share: float
) -> None:
    """20 builds of 2 x 103 mirrors, within 1e-6 mm (asked for: 1e-4)."""
    errors = scaled(POSED, share)
    for half, fast, drawn in zip(
        small_design.arrays, halves, draw(errors, 7, range(20), len(halves[0])), strict=True
    ):
        found = mirror_coverage(fast, drawn).diameter
        slow = np.stack([traced_coverage(half, drawn, k) for k in range(20)])
        assert np.abs(found - slow).max() < 1e-6
        assert np.abs(found - half.coverage).max() > 5 * share  # it is no small thing


def test_uneven_scale_against_brute_force(halves: EdgeModels, small_design: MirrorDesign) -> None:
    """Spheres become ellipsoids of up to 1 % out of round."""
    errors = replace(COARSE, camera_shift=Error(), scale_axis=Error(0.01))
    mirror, (_, drawn) = 30, draw(errors, 3, range(1), len(halves[0]))
    assert np.ptp(drawn.scale) > 0.005
    found = mirror_coverage(halves[1], drawn).diameter[0, mirror]
    assert found == pytest.approx(
        bisected_coverage(small_design.arrays[1], drawn, 0, mirror), abs=1e-4
    )


# Verification of the files of builds


@pytest.fixture(scope="module")
def record(small_design: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Export:
    return read_record_of(small_design, tmp_path_factory.mktemp("made"))


@pytest.mark.parametrize(("errors", "build"), [(COARSE, 0), (POSED, 20)])
def test_random_builds_against_the_verification_of_their_meshes(
    halves: EdgeModels, small_design: MirrorDesign, record: Export, errors: Errors, build: int
) -> None:
    """Both shells meshed, written, read, mirrors found and measured: within 0.05 mm.

    The verification takes x = 0 for the seam, so mirrors halved by a moved seam are left out.
    """
    draws = draw(errors, 5, range(build, build + 1), len(halves[0]))
    fast, _ = coverage(halves, draws)
    kept = np.ones(fast.shape[1], dtype=bool)
    kept[: len(halves[0])] = (errors is COARSE) | ~halves[0].halved
    write_meshes(small_design, draws, 0, record.folder)
    shifts = {name: drawn.camera_shift[0] for name, drawn in zip("ab", draws, strict=True)}
    assert np.abs(fast[0] - verified_coverage(record, shifts))[kept].max() < 0.05
    assert fast.min() < TARGET - 1  # the meshes are not the design's
