"""Simulated builds of mirrors on pedestals against closed forms, slow tracing and verification."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tbcad_verify.record.export import Export

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.reflection import miss_distances
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.montecarlo.builds import CoverageCase, as_made, scaled, simulate
from tbcad.tolerancing.montecarlo.coverage import coverage, mirror_coverage
from tbcad.tolerancing.montecarlo.draws import (
    ShellDraws,
    draw,
    draw_kinds,
    pivots,
    shell_error_shapes,
    smooth_field,
)
from tbcad.tolerancing.montecarlo.edge_model import EdgeModel, EdgeModels, edge_models, warp_maps_of
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.process.process import BUILT_IN, load_process, process_errors
from tests.pedestal_designs import pedestal_design
from tests.tolerancing.exact_builds import (
    displaced_coverage,
    last_inside,
    read_record_of,
    traced_coverage,
    verified_coverage,
    write_meshes,
)

COARSE = Errors(
    sphere_centre=Error(0.03),
    sphere_radius=Error(0.03),
    scale_isotropic=Error(0.002),
    camera_shift=Error(0.2),
    coating=Error(0.01, 0.005),
)
POSED = replace(COARSE, shell_shift=Error(0.2), shell_tilt=Error(0.002))
SLA = Errors(warp=Error(0.0346, length=50.0))
WIDE = 16.0  # mm, of a mirror about its apex: see test_warp


@pytest.fixture(scope="module")
def small() -> MirrorDesign:
    return pedestal_design("n=6")


@pytest.fixture(scope="module")
def halves(small: MirrorDesign) -> EdgeModels:
    return edge_models(reflectors(small))


def drawn(halves: EdgeModels, errors: Errors, builds: range) -> tuple[ShellDraws, ShellDraws]:
    maps, half = warp_maps_of(halves, errors), halves[0]
    return draw(errors, 7, builds, len(half), maps, len(half.walls))


@pytest.mark.parametrize(
    "settings",
    [("n=2",), ("n=5", "shell.groove_mm=0.5"), ("n=4", "radius_rule=flat")],
)
def test_without_errors_it_is_the_design(settings: tuple[str, ...]) -> None:
    made = pedestal_design(*settings)
    models = edge_models(reflectors(made))
    for array, half, one in zip(
        made.arrays, models, drawn(models, Errors(), range(1)), strict=True
    ):
        found = mirror_coverage(half, one)
        if "radius_rule=flat" not in settings:  # the slow tracing knows no planes
            assert np.abs(found.diameter[0] - traced_coverage(array, one, 0)).max() < 1e-6
        assert found.diameter[0] == pytest.approx(array.coverage, abs=5e-5)
        assert (found.crossings[0, ~half.halved] % 2 == 1).all()


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_random_builds_against_slow_tracing(
    halves: EdgeModels, small: MirrorDesign, share: float
) -> None:
    """Cells cut anew from displaced spheres by the walls of the design, within 1e-6 mm."""
    for array, half, one in zip(
        small.arrays, halves, drawn(halves, scaled(POSED, share), range(10)), strict=True
    ):
        found = mirror_coverage(half, one).diameter
        slow = np.stack([traced_coverage(array, one, k) for k in range(10)])
        assert np.abs(found - slow).max() < 1e-6
        assert np.abs(found - array.coverage).max() > 1.5 * share


def test_a_mirror_that_is_off_changes_no_other(halves: EdgeModels) -> None:
    """Not by a bit: neither what they cover nor their pictures."""
    half, alone = halves[0], 40
    still = drawn(halves, Errors(), range(1))[0]
    centre, form = np.zeros_like(still.centre), np.zeros_like(still.form)
    centre[0, alone], form[0, alone] = [0.05, -0.04, 0.06], 0.002
    before, after = (
        mirror_coverage(half, one) for one in (still, replace(still, centre=centre, form=form))
    )
    # With waviness an edge is displaced along plane and sphere: by nothing where there is none.
    for name in ("diameter", "pixels"):
        changed = np.flatnonzero(np.abs(getattr(after, name) - getattr(before, name))[0] > 1e-9)
        assert changed.tolist() == [alone], name
    spheres = mirror_coverage(half, replace(still, centre=centre)).diameter[0]
    assert np.flatnonzero(spheres != before.diameter[0]).tolist() == [alone]


def bisected_coverage(half: EdgeModel, draws: ShellDraws, mirror: int, ways: int = 4_000) -> float:
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


def test_moved_walls_and_uneven_scale_against_brute_force(halves: EdgeModels) -> None:
    mirror = 30
    errors = Errors(sphere_centre=Error(0.03), sphere_radius=Error(0.03), scale_axis=Error(0.01))
    one = drawn(halves, errors, range(1))[1]
    moved = np.random.default_rng(2).normal(0, 0.1, one.wall.shape)
    found = mirror_coverage(halves[1], replace(one, wall=moved)).diameter[0, mirror]
    slow = bisected_coverage(halves[1], replace(one, wall=moved), mirror)
    assert found == pytest.approx(slow, abs=1e-4)
    assert abs(found - mirror_coverage(halves[1], one).diameter[0, mirror]) > 0.02


def test_warped_builds_against_displaced_material(halves: EdgeModels, small: MirrorDesign) -> None:
    """Halves whose every point is displaced: walls go along with the mirrors that they end."""
    length, builds = SLA.warp.length, 1
    chosen = pivots(halves[0].apex, length)
    fields = [smooth_field(half.apex, length, chosen) for half in halves]
    shapes = shell_error_shapes(len(halves[0]), len(chosen))
    numbers = draw_kinds(SLA, 7, range(builds), shapes)["warp"]
    draws = drawn(halves, SLA, range(builds))
    for side, (half, array) in enumerate(zip(halves, small.arrays, strict=True)):
        fast = mirror_coverage(half, draws[side]).diameter
        fixed = replace(draws[side], wall=np.zeros_like(draws[side].wall))
        without = mirror_coverage(half, fixed).diameter
        whole = ~half.halved & (half.cell_radius < WIDE)
        for k in range(builds):
            exact = displaced_coverage(array, fields[side], numbers[k, side])
            assert fast[k].min() == pytest.approx(exact.min(), abs=0.05)
            assert np.abs(fast[k] - exact)[whole].max() < 0.05
            assert np.abs(without[k] - exact)[whole].max() > 0.2


@pytest.fixture(scope="module")
def record(small: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Export:
    return read_record_of(small, tmp_path_factory.mktemp("made"))


def test_random_builds_against_the_verification_of_their_meshes(
    halves: EdgeModels, small: MirrorDesign, record: Export
) -> None:
    """Both shells meshed, written, read, mirrors found and measured by rays: within 0.05 mm."""
    draws = drawn(halves, scaled(COARSE, 0.5), range(1))
    fast, _ = coverage(halves, draws)
    write_meshes(small, draws, 0, record.folder)
    shifts = {name: one.camera_shift[0] for name, one in zip("ab", draws, strict=True)}
    assert np.abs(fast[0] - verified_coverage(record, shifts)).max() < 0.05
    assert fast.min(axis=1).max() < 60.6 - 0.3  # the meshes are not the design's


def test_errors_of_neighbours_cost_less_than_where_spheres_meet(
    halves: EdgeModels, small_design: MirrorDesign
) -> None:
    """Centres and radii off by 5 um each: less than a third."""
    errors = Errors(sphere_centre=Error(0.005), sphere_radius=Error(0.005))
    joined = edge_models(reflectors(small_design))
    pedestal, valley = (
        simulate(CoverageCase(of, errors, 1, worst_only=True), 40).worst.mean()
        for of in (halves, joined)
    )
    assert 60.6 - 0.1 > pedestal > 60.6 - 0.7
    assert 3 * (60.6 - pedestal) < 60.6 - valley


def test_every_build_says_how_it_would_be_made(small: MirrorDesign) -> None:
    """Good processes by all builds, others by the first ones of which three failed."""
    cameras = reflectors(small)
    found = as_made(cameras, small.spec)
    assert found.reason == ""
    assert {one.process for one in found.processes} == set(BUILT_IN)
    assert {one.builds for one in found.processes} >= {5, 50}
    for one in found.processes:
        errors = process_errors(load_process(one.process))
        every = simulate(CoverageCase(edge_models(cameras), errors, 1, worst_only=True), 50).worst
        bad = np.append(0, (every < 60).cumsum())  # of the first k
        assert bad[50] < 3 if one.share >= 0.95 else bad[one.builds] >= 3 > bad[one.builds - 5]
        assert round(one.share * one.builds) == one.builds - bad[one.builds]
