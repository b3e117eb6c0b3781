"""Recorded poses and figures: a build's are right, and others are off by what was changed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tbcad_verify.record.export import Export
from tbcad_verify.record.poses import (
    POSE_MM,
    contradictions,
    directions,
    figure_errors,
    geodesic,
    malformed,
    missing_directions,
    pose_errors,
    virtual_cameras,
)

ROW = 3


def changed(export: Export, column: str, by: float) -> Export:
    """The record with one number of one mirror changed."""
    values = getattr(export.mirrors, column).copy()
    values[ROW] += by
    return replace(export, mirrors=export.mirrors.model_copy(update={column: values}))


def test_a_build_is_right(sample: Export) -> None:
    assert pose_errors(sample).max() < POSE_MM
    assert figure_errors(sample).max() < POSE_MM
    assert missing_directions(sample) == ([], 0)
    assert contradictions(sample) == malformed(sample.mirrors) == []


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("what", ["u", "p", "n"])
def test_another_pose_is_off(sample: Export, what: str, axis: str) -> None:
    errors = pose_errors(changed(sample, what + axis, 1e-5))
    assert 1e-7 < errors[ROW] < 5e-3
    assert np.delete(errors, ROW).max() < POSE_MM


@pytest.mark.parametrize(
    ("column", "by", "off"),
    [
        ("size_mm", 0.5, 0.5),
        *((name, 1.0, np.pi / 180) for name in ("theta0_deg", "theta1_deg", "polar_deg")),
        ("azimuth_deg", 360.0, 0.0),
        ("azimuth_deg", -1.0, np.pi / 180),
    ],
)
def test_other_figures_are_off(sample: Export, column: str, by: float, off: float) -> None:
    errors = figure_errors(changed(sample, column, by))
    assert errors[ROW] == pytest.approx(off, abs=1e-9)
    assert np.delete(errors, ROW).max() < POSE_MM


def test_a_direction_elsewhere_is_misplaced_and_its_vertex_missing(sample: Export) -> None:
    wrong, missing = missing_directions(changed(sample, "uy", 1e-8))
    assert (wrong, missing) == ([sample.mirrors.ids[ROW]], 0)
    away = changed(sample, "uy", 2.0)
    assert missing_directions(away)[1] == 1


@pytest.mark.parametrize("n", [2, 3, 4, 6, 7])
def test_the_polyhedron_has_all_vertices(n: int) -> None:
    points = geodesic(n)
    assert points.shape == (3, 10 * n * n + 2)
    assert np.linalg.norm(points, axis=0) == pytest.approx(np.ones(points.shape[1]))
    assert points.sum(axis=1) == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_stretch_that_the_mirrors_do_not_have_is_found(sample: Export) -> None:
    optics = sample.spec.optics.model_copy(update={"stretch": (1.1, 1.0)})
    other = replace(sample, spec=sample.spec.model_copy(update={"optics": optics}))
    misplaced, _ = missing_directions(other)
    u = sample.mirrors.columns("ux", 3)
    moved = (np.abs(u[0]) > 1e-9) & (np.hypot(u[1], u[2]) > 1e-9)
    assert misplaced == sorted(np.array(sample.mirrors.ids)[moved])
    assert figure_errors(other)[moved].min() > POSE_MM


def test_directions_are_stretched_along_x_and_y(sample: Export) -> None:
    optics = sample.spec.optics.model_copy(update={"stretch": (1.5, 0.8)})
    u, v = geodesic(optics.n), directions(optics)
    assert np.linalg.norm(v, axis=0) == pytest.approx(np.ones(v.shape[1]))
    assert v[0] * u[2] == pytest.approx(1.5 * u[0] * v[2])
    assert v[1] * u[2] == pytest.approx(0.8 * u[1] * v[2])


def test_halves_on_the_seam_are_one_virtual_camera(sample: Export) -> None:
    mirrors = sample.mirrors
    found = virtual_cameras(mirrors)
    on_seam = np.abs(mirrors.columns("ux", 3)[0]) < 1e-9
    assert (found.halved == on_seam).all()
    assert found.count == len(mirrors) - on_seam.sum() // 2
    pairs = [np.flatnonzero(found.index == k) for k in np.unique(found.index[on_seam])]
    for one, two in pairs:
        assert mirrors.ids[one][1:] == mirrors.ids[two][1:]
        assert {mirrors.camera[one], mirrors.camera[two]} == {"a", "b"}
