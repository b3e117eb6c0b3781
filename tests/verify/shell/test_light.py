"""Every pixel against brute force on exact spheres; what stands in the way is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from tbcad_verify.mesh import rays
from tbcad_verify.mesh.surfaces import distance_before_mirror, nearest_to_origin
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.report.checks import Check
from tbcad_verify.shell import coverage, light, pixels
from tbcad_verify.shell.optics import OpticalSetup

from tests.exported_files import edit_json
from tests.verify.optical_setups import optical_setup_of
from tests.verify.synthetic_export import PIN, Cells, Design, export, sign, stl


def pixel_directions(optical_setup: OpticalSetup) -> np.ndarray:
    """(N, 3) directions of camera a's pixels, row by row, from the definition."""
    c = optical_setup.cameras[0]
    focal = c.width / 2 / np.tan(c.hfov / 2)
    down = np.cross(c.forward, c.right)
    j, i = np.meshgrid(np.arange(c.width), np.arange(c.height))
    x, y = j.ravel() + 0.5 - c.width / 2, i.ravel() + 0.5 - c.height / 2
    return c.forward + (x[:, None] * c.right + y[:, None] * down) / focal


@pytest.fixture(scope="module")
def tally(optical_setup: OpticalSetup) -> light.PixelTally:
    return light.full_sensor(optical_setup.sensor_scene(optical_setup.cameras[0]))


def exact(cells: Cells, d: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """First mirror of camera a along each ray (-1: none or cut off), and whether it is useful.

    The first ball that a ray enters is the mirror; seam and foot cut.
    """
    first, mirror = np.full(len(d), np.inf), np.full(len(d), -1)
    miss = np.full(len(d), np.inf)
    for k, (c, r, n) in enumerate(cells.spheres):
        o = PIN - c
        a, b = (d * d).sum(axis=1), d @ o
        rest = b * b - a * (o @ o - r * r)
        t = np.where(rest > 0, (-b - np.sqrt(np.abs(rest))) / a, np.inf)
        x = PIN + np.where(np.isfinite(t), t, 0)[:, None] * d
        ok = (t > 0) & (t < first) & ((x - c) @ n > 0.5 * r)
        first[ok], mirror[ok] = t[ok], k
        normal = (x - c) / r
        out = d - 2 * (d * normal).sum(axis=1)[:, None] * normal
        near = x - ((x * out).sum(axis=1) / (out * out).sum(axis=1))[:, None] * out
        miss[ok] = np.linalg.norm(near, axis=1)[ok]
    x = PIN + np.where(np.isfinite(first), first, 0)[:, None] * d
    outside = (x[:, 0] < 0) | (x[:, 2] < -12) | ~np.isfinite(first)
    mirror[outside] = -1
    return mirror, (miss <= radius) & ~outside


def test_pixel_counts_against_brute_force(
    optical_setup: OpticalSetup, exact_cells: Cells, tally: light.PixelTally
) -> None:
    mirror, useful = exact(exact_cells, pixel_directions(optical_setup), optical_setup.radius)
    expected = np.bincount(mirror[useful], minlength=len(exact_cells.mirrors))
    found = tally.pixels[: len(exact_cells.mirrors)]
    assert tally.pixels[len(exact_cells.mirrors) :].sum() == 0
    # Only pixels on the very edge of a cell may differ: the mesh has chords for arcs.
    assert np.abs(found - expected).max() <= 2
    assert found.sum() > 4000
    assert abs(tally.on_mirrors - (mirror[:: light.SAMPLED] >= 0).sum()) < 20
    assert tally.blocked.sum() == 0


def test_nearest_way_against_brute_force(
    optical_setup: OpticalSetup, exact_cells: Cells, tally: light.PixelTally
) -> None:
    d = pixel_directions(optical_setup)
    useful = exact(exact_cells, d, optical_setup.radius)[1]
    d = d[useful]
    foot = -(d @ PIN) / (d * d).sum(axis=1)
    expected = np.linalg.norm(PIN + foot[:, None] * d, axis=1).min()
    assert tally.nearest.min() == pytest.approx(expected, rel=0.02)


def test_chunks_and_threads_do_not_matter(
    optical_setup: OpticalSetup, monkeypatch: pytest.MonkeyPatch
) -> None:
    sensor = optical_setup.sensor_scene(optical_setup.cameras[1])
    one = light.full_sensor(sensor)
    monkeypatch.setattr(rays, "RAYS_A_CHUNK", 999)
    monkeypatch.setattr(rays, "THREADS", 3)
    two = light.full_sensor(sensor)
    for name in ("pixels", "blocked", "on_mirrors", "twice", "nearest", "spread"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_hits_in_float64(optical_setup: OpticalSetup) -> None:
    d = rays.pixel_rows(optical_setup.cameras[0], 90, 100)
    origin = optical_setup.cameras[0].pinhole[:, None]
    facet = rays.first_hits(optical_setup.scene, origin, d)
    hit = np.flatnonzero(facet >= 0)
    t = rays.distances_to_planes(optical_setup.scene, facet[hit], origin, d[:, hit])
    x = origin + t * d[:, hit]
    corners = optical_setup.mesh.points[optical_setup.mesh.faces[facet[hit]]]
    inside = trimesh.triangles.points_to_barycentric(corners, x.T)
    assert inside.min() > -1e-4
    back = np.einsum("nij,ni->nj", corners, inside)
    np.testing.assert_allclose(back, x.T, atol=1e-9)


def pixel_checks(optical_setup: OpticalSetup) -> dict[str, Check]:
    return {check.name: check for check in pixels.checks(optical_setup, None, "x")[0]}


def with_post(folder: Path, low: list[float], high: list[float]) -> Path:
    """Add a part to the export: a box, in the way."""
    box = trimesh.creation.box(bounds=[low, high])
    (folder / "post.stl").write_bytes(stl(box.triangles.astype(np.float32)))
    part = {"name": "post", "stl": "post.stl"}
    edit_json(folder / "design.json", lambda design: design["parts"].append(part))
    return sign(folder)


def test_a_post_between_camera_and_mirrors_is_named(export_folder: Path) -> None:
    optical_setup = optical_setup_of(with_post(export_folder, [66, 9, -23], [68, 11, -21]))
    found = coverage.checks(optical_setup, coverage.measure(optical_setup), "x")[0]
    (visible,) = (one for one in found if one.name == "mirrors visible")
    assert visible.passed is False
    assert "behind post (no mirror)" in visible.detail


def test_the_paths_to_the_zenith_mirror_limit_the_object(tmp_path: Path) -> None:
    """DESIGN.md section 3: 62.0 mm, at the zenith mirror where it is aimed at the origin."""
    optical_setup = optical_setup_of(export(tmp_path / "x", Design(aim=0.0))[0])
    camera = optical_setup.cameras[0]
    zenith = np.flatnonzero(optical_setup.u[2] > 1 - 1e-12)[:1]
    start = optical_setup.export.mirrors.columns("px", 3)[:, zenith] + 0.3
    seen = optical_setup.seen(camera)
    small = pixels.rim_rays(seen, zenith, start, optical_setup.u[:, zenith], np.array([1e-3]))
    way = distance_before_mirror(seen, small.direction, small.lines.reach)
    assert 2 * way.mean() == pytest.approx(62.0, abs=0.05)


def test_an_object_too_large_stands_in_the_light(optical_setup: OpticalSetup) -> None:
    for diameter, passed in ((40.0, True), (75.0, False)):
        big = replace(optical_setup, export=replace(optical_setup.export, target_mm=diameter))
        assert pixel_checks(big)["object clearance"].passed is passed


def test_ring_grazes_the_capture_sphere(optical_setup: OpticalSetup) -> None:
    camera = optical_setup.cameras[0]
    ring = pixels._ring(optical_setup, camera, None)
    assert ring.error.max() < 1e-6
    np.testing.assert_allclose(norm(nearest_to_origin(ring.lines)), optical_setup.radius, atol=1e-6)
    assert np.bincount(ring.mirror).max() == pixels.AZIMUTHS


def test_a_narrow_camera_cuts_mirrors_off(export_folder: Path) -> None:
    design = export_folder / "design.json"
    edit_json(design, lambda one: [camera.update(hfov_deg=70.0) for camera in one["cameras"]])
    lines = pixel_checks(optical_setup_of(export_folder))
    assert lines["frame margin"].passed is False
    assert "partly out of the frame: a0" in lines["frame margin"].detail


def test_the_rim_is_looked_for_only_where_a_mirror_reaches(optical_setup: OpticalSetup) -> None:
    """A mirror that sees little fails for that, and not for being out of frame as well."""
    found = coverage.measure(optical_setup)
    short = replace(found, fitted=np.full_like(found.fitted, 10.0))
    ring = pixels._ring(optical_setup, optical_setup.cameras[0], short)
    np.testing.assert_allclose(norm(nearest_to_origin(ring.lines)), 5.0, atol=1e-6)


def test_margins_by_hand(optical_setup: OpticalSetup) -> None:
    camera = optical_setup.cameras[0]
    corner = camera.forward + camera.right * np.tan(camera.hfov / 2)
    d = np.stack([camera.forward, corner, -camera.forward], axis=1)
    found = pixels.margins(camera, d)
    assert found[0] == pytest.approx(camera.height / 2)
    assert found[1] == pytest.approx(0, abs=1e-9)
    assert found[2] == -np.inf
