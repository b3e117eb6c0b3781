"""Distances between spheres of known radii."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tbcad.light.reconstruction.files import mesh_distance
from tbcad.light.simulate.scene.object import patterned_ball
from tests.light.reconstruction.balls import parallel_rays

RAYS = parallel_rays(lambda away: away < 7, across=41)


def sphere(radius: float) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=5, radius=radius)


def test_of_two_spheres_it_is_the_difference_of_their_radii() -> None:
    found = mesh_distance(sphere(6.5), patterned_ball(7.0), RAYS)
    for value in (found.mean_mm, found.percentile_95_mm, found.hausdorff_mm,
                  found.whole_mean_mm, found.whole_hausdorff_mm):  # fmt: skip
        assert value == pytest.approx(0.5, abs=0.01)


def test_what_no_ray_meets_counts_for_the_whole_alone() -> None:
    """A ball that ends at z = -4, though the true one goes on, seen from above."""
    flat = sphere(7.0)
    points = np.array(flat.vertices)
    points[:, 2] = np.maximum(points[:, 2], -4.0)
    steep = RAYS.direction[:, 2] < -0.9
    above = replace(RAYS, entry=RAYS.entry[steep], direction=RAYS.direction[steep])
    found = mesh_distance(
        trimesh.Trimesh(points, flat.faces, process=False), patterned_ball(7.0), above
    )
    assert found.hausdorff_mm < 0.1
    assert found.whole_hausdorff_mm == pytest.approx(3.0, abs=0.05)
    assert found.whole_mean_mm > found.mean_mm
