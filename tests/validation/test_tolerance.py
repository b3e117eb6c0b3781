"""The fast model of simulated builds against closed forms, slow tracing and brute force.

Of mirrors that meet in valleys and of those on pedestals.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.reflection import miss_distances
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.as_made import as_made
from tbcad.tolerancing.montecarlo.builds import CoverageCase, scaled, simulate
from tbcad.tolerancing.montecarlo.coverage import mirror_coverage, pointing
from tbcad.tolerancing.montecarlo.draws import ShellDraws, draw
from tbcad.tolerancing.montecarlo.edge_model import EdgeModel, EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.process.process import BUILT_IN, load_process, process_errors
from tests.mirror_arrays import mirror_design
from tests.tolerancing.exact_builds import (
    bisected_coverage,
    displaced_coverage,
    drawn,
    last_inside,
    traced_coverage,
    warp_fields,
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
SLA = Errors(warp=Error(0.0346, length=50.0))
WIDE = 16.0  # mm, of a mirror about its apex; wider ones bend as no sphere with astigmatism does
PEDESTAL = "shell.edges=pedestal"


def small(edges: str) -> MirrorDesign:
    return mirror_design("n=6", f"shell.edges={edges}")


@cache
def models(edges: str) -> EdgeModels:
    return edge_models(reflectors(small(edges)))


@pytest.fixture
def halves() -> EdgeModels:
    return models("valley")


@pytest.fixture
def parted() -> EdgeModels:
    """Of mirrors on pedestals."""
    return models("pedestal")


def perfect(half: EdgeModel) -> ShellDraws:
    return draw(Errors(), 1, range(1), len(half))[0]


def row(*vector: float) -> np.ndarray:
    return np.array([vector])


# Without errors


@pytest.mark.parametrize(
    "settings",
    [
        ("n=5",),
        ("n=4", "radius_rule=flat"),
        (PEDESTAL, "n=2"),
        (PEDESTAL, "n=5", "shell.groove_mm=0.5"),
        (PEDESTAL, "n=4", "radius_rule=flat"),
    ],
)
def test_without_errors_it_is_the_design(settings: tuple[str, ...]) -> None:
    """To the accuracy of the design's samples, and of the slow tracing, which knows no planes."""
    made = mirror_design(*settings)
    halves = edge_models(reflectors(made))
    for array, half, one in zip(
        made.arrays, halves, drawn(halves, Errors(), range(1)), strict=True
    ):
        found = mirror_coverage(half, one)
        if "radius_rule=flat" not in settings:
            assert np.abs(found.diameter[0] - traced_coverage(array, one, 0)).max() < 1e-6
        allowed = 5e-5 if PEDESTAL in settings else 2e-5
        assert found.diameter[0] == pytest.approx(array.coverage, abs=allowed)
        assert (found.crossings[0, ~half.halved] % 2 == 1).all()


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
    offset = pointing(halves[0], moved)
    way, nearest = designed_rays(halves[0])
    # Of a mirror on the seam the object's point that its ray was aimed at has not moved.
    left = np.cross(rotation.apply(nearest) - nearest, rotation.apply(way))
    assert offset[0] == pytest.approx(np.linalg.norm(left, axis=1), abs=1e-9)
    assert offset[0, ~halves[0].halved].max() < 1e-9


def test_moved_shell_is_moved_camera_and_object(halves: EdgeModels) -> None:
    """All rays pass by what is left behind: to first order the shell's shift, across the ray."""
    shift = row(0.3, -0.2, 0.1)
    still = perfect(halves[0])
    together = replace(still, shell_shift=shift, camera_shift=shift)
    way, _ = designed_rays(halves[0])
    across = shift - np.einsum("mx,kx->mk", way, shift) * way
    assert pointing(halves[0], together)[0] == pytest.approx(np.linalg.norm(across, axis=1))


@pytest.mark.parametrize("size", [0.98, 1.03])
def test_larger_build_covers_more_in_proportion(halves: EdgeModels, size: float) -> None:
    still = perfect(halves[0])
    pinhole = halves[0].view.pinhole
    larger = replace(still, scale=row(size, size, size), camera_shift=(size - 1) * pinhole[None])
    before, after = mirror_coverage(halves[0], still), mirror_coverage(halves[0], larger)
    assert after.diameter == pytest.approx(size * before.diameter, abs=1e-9)
    offset = pointing(halves[0], larger)
    # The rays of mirrors on the seam, which are aimed beside the middle, keep their proportion too.
    beside = np.linalg.norm(designed_rays(halves[0])[1], axis=1)
    assert offset[0] == pytest.approx(abs(size - 1) * beside, abs=1e-12)


# Random builds


@pytest.mark.parametrize(
    ("edges", "share", "least"),
    [("valley", 0.1, 0.5), ("valley", 4.0, 20.0), ("pedestal", 0.06, 0.1), ("pedestal", 0.6, 1.0)],
)
def test_random_builds_against_slow_tracing(edges: str, share: float, least: float) -> None:
    """10 builds of 2 x 103 mirrors, cells cut anew (by the walls of the design): within 1e-6 mm."""
    halves = models(edges)
    for array, half, one in zip(
        small(edges).arrays, halves, drawn(halves, scaled(POSED, share), range(10)), strict=True
    ):
        found = mirror_coverage(half, one).diameter
        slow = np.stack([traced_coverage(array, one, k) for k in range(10)])
        assert np.abs(found - slow).max() < 1e-6
        assert np.abs(found - array.coverage).max() > least  # it is no small thing


def test_uneven_scale_against_brute_force(halves: EdgeModels) -> None:
    """Spheres become ellipsoids of up to 1 % out of round."""
    errors = replace(COARSE, camera_shift=Error(), scale_axis=Error(0.01))
    mirror, (_, one) = 30, draw(errors, 3, range(1), len(halves[0]))
    assert np.ptp(one.scale) > 0.005
    found = mirror_coverage(halves[1], one).diameter[0, mirror]
    slow = bisected_coverage(small("valley").arrays[1], one, 0, mirror)
    assert found == pytest.approx(slow, abs=1e-4)


# On pedestals


def test_a_mirror_that_is_off_changes_no_other(parted: EdgeModels) -> None:
    half, alone = parted[0], 40
    still = drawn(parted, Errors(), range(1))[0]
    centre, form = np.zeros_like(still.centre), np.zeros_like(still.form)
    centre[0, alone], form[0, alone] = [0.05, -0.04, 0.06], 0.002
    before, after = (
        mirror_coverage(half, one) for one in (still, replace(still, centre=centre, form=form))
    )
    # With waviness an edge is displaced along plane and sphere: by nothing where there is none.
    changed = np.flatnonzero(np.abs(after.diameter - before.diameter)[0] > 1e-9)
    assert changed.tolist() == [alone]
    spheres = mirror_coverage(half, replace(still, centre=centre)).diameter[0]
    assert np.flatnonzero(spheres != before.diameter[0]).tolist() == [alone]


def walled_coverage(half: EdgeModel, draws: ShellDraws, mirror: int, ways: int = 4_000) -> float:
    """Coverage of a mirror of the first build by where each way from its apex leaves its planes."""
    apex, normal, curvature = half.apex[mirror], half.normal[mirror], half.table[mirror, 6]
    scale, radius = draws.scale[0], 1 / curvature + draws.radius[0, mirror]
    centre = apex - normal / curvature + draws.centre[0, mirror]
    own = half.walls.mirror == mirror
    point = half.walls.point[own] + draws.wall[0, own, None] * half.walls.normal[own]
    planes = [
        *zip(point, half.walls.normal[own], strict=True),
        *half.table[-2:, :6].reshape(2, 2, 3),
    ]

    def inside(out: np.ndarray) -> np.ndarray:
        return np.all([(centre + radius * out - p) @ n >= 0 for p, n in planes], axis=0)

    out = last_inside(normal, 60 / radius, inside, ways)
    built = out / scale
    built /= np.linalg.norm(built, axis=1, keepdims=True)
    x = scale * (centre + radius * out)
    return float(2 * miss_distances(half.view.pinhole, x, built).min())


def test_moved_walls_and_uneven_scale_against_brute_force(parted: EdgeModels) -> None:
    mirror = 30
    errors = Errors(sphere_centre=Error(0.03), sphere_radius=Error(0.03), scale_axis=Error(0.01))
    one = drawn(parted, errors, range(1))[1]
    moved = np.random.default_rng(2).normal(0, 0.1, one.wall.shape)
    found = mirror_coverage(parted[1], replace(one, wall=moved)).diameter[0, mirror]
    slow = walled_coverage(parted[1], replace(one, wall=moved), mirror)
    assert found == pytest.approx(slow, abs=1e-4)
    assert abs(found - mirror_coverage(parted[1], one).diameter[0, mirror]) > 0.02


@pytest.mark.parametrize("edges", ["valley", "pedestal"])
def test_warped_builds_against_displaced_material(edges: str) -> None:
    """Halves whose every point is displaced: walls go along with the mirrors that they end."""
    halves = models(edges)
    fields, numbers = warp_fields(halves, SLA, range(1))
    draws = drawn(halves, SLA, range(1))
    for side, (half, array) in enumerate(zip(halves, small(edges).arrays, strict=True)):
        fast = mirror_coverage(half, draws[side]).diameter
        fixed = replace(draws[side], wall=np.zeros_like(draws[side].wall))
        without = mirror_coverage(half, fixed).diameter
        whole = ~half.halved & (half.cell_radius < WIDE)
        exact = displaced_coverage(array, fields[side], numbers[0, side])
        assert fast[0].min() == pytest.approx(exact.min(), abs=0.05)
        assert np.abs(fast[0] - exact)[whole].max() < 0.05
        if edges == "pedestal":
            assert np.abs(without[0] - exact)[whole].max() > 0.2


def test_errors_of_neighbours_cost_less_than_where_spheres_meet(
    halves: EdgeModels, parted: EdgeModels
) -> None:
    """Centres and radii off by 5 um each: less than a third."""
    errors = Errors(sphere_centre=Error(0.005), sphere_radius=Error(0.005))
    pedestal, valley = (
        simulate(CoverageCase(of, errors, 1, worst_only=True), 40).worst.mean()
        for of in (parted, halves)
    )
    assert 60.6 - 0.1 > pedestal > 60.6 - 0.7
    assert 3 * (60.6 - pedestal) < 60.6 - valley


def test_every_build_says_how_it_would_be_made() -> None:
    """Good processes by all builds, others by the first ones of which three failed."""
    made = small("pedestal")
    cameras = reflectors(made)
    found = as_made(cameras, made.spec)
    assert found.reason == ""
    assert {one.process for one in found.processes} == set(BUILT_IN)
    assert {one.builds for one in found.processes} >= {5, 50}
    for one in found.processes:
        errors = process_errors(load_process(one.process))
        every = simulate(CoverageCase(edge_models(cameras), errors, 1, worst_only=True), 50).worst
        bad = np.append(0, (every < 60).cumsum())  # of the first k
        assert bad[50] < 3 if one.share >= 0.95 else bad[one.builds] >= 3 > bad[one.builds - 5]
        assert round(one.share * one.builds) == one.builds - bad[one.builds]
