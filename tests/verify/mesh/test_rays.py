"""Rays through pixels, and what they meet."""

from __future__ import annotations

import numpy as np
import pytest
from tbcad_verify.mesh.mesh import Mesh, indexed_mesh, join_meshes
from tbcad_verify.mesh.rays import build_scene, first_hits, pixel_rows, row_chunks, with_image
from tbcad_verify.record.export import Export
from tbcad_verify.shell.measured_shell import flipped_mesh


def test_rays_go_through_the_middle_of_pixels_row_by_row(sample: Export) -> None:
    camera = sample.cameras["a"]
    first, last = 3, 5
    rays = pixel_rows(camera, first, last)
    assert rays.shape == (3, 2 * camera.width)
    assert camera.forward @ rays == pytest.approx(np.ones(2 * camera.width))
    half = np.tan(camera.hfov / 2)
    across = half * (2 * np.arange(camera.width) + 1 - camera.width) / camera.width
    assert camera.right @ rays == pytest.approx(np.tile(across, 2))
    downward = half * (2 * np.array([first, last - 1]) + 1 - camera.height) / camera.width
    assert np.cross(camera.forward, camera.right) @ rays == pytest.approx(
        np.repeat(downward, camera.width)
    )


def test_chunks_are_all_rows_once(sample: Export) -> None:
    camera = sample.cameras["b"]
    rows = [row for low, high in row_chunks(camera) for row in range(low, high)]
    assert rows == list(range(camera.height))


def triangles(side: float) -> Mesh:
    """Loose ones beside the plane x = 0."""
    random = np.random.default_rng(5)
    points = random.normal(size=(300, 1, 3)) + 0.3 * random.normal(size=(300, 3, 3))
    points[..., 0] = side * np.abs(points[..., 0])
    return indexed_mesh(points.reshape(-1, 3), np.arange(900, dtype=np.int32).reshape(-1, 3))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_image_is_met_as_if_it_were_in_embree(side: float) -> None:
    mesh, random = triangles(side), np.random.default_rng(6)
    both = build_scene(join_meshes([mesh, flipped_mesh(mesh)]))
    pair = with_image(build_scene(mesh), mesh)
    assert pair is not None
    every = np.arange(600)
    np.testing.assert_allclose(pair.plane(every), both.plane(every), atol=1e-12)
    origin, d = 2 * random.normal(size=(3, 5000)), random.normal(size=(3, 5000))
    facet = first_hits(both, origin, d)
    np.testing.assert_array_equal(first_hits(pair, origin, d), facet)
    assert (facet >= 300).sum() > 300 < ((facet >= 0) & (facet < 300)).sum()


def test_a_mesh_on_both_sides_has_no_image_beside_it() -> None:
    mesh = join_meshes([triangles(1.0), triangles(-1.0)])
    assert with_image(build_scene(mesh), mesh) is None
