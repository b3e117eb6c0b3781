import numpy as np
import pytest
import trimesh

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.mirrors.array import MirrorDesign, design
from tbcad.optics.reflection import miss_distances
from tbcad.shell.facets import mirror_facets
from tbcad.spec.load import load_spec
from tests.helpers import body_of, mesh_of


@pytest.mark.parametrize(
    "options",
    [
        ["n=1"],
        ["n=2"],
        ["n=3"],
        ["n=4", "radius_rule=flat"],
        ["n=8", "radius_rule=paper"],
        ["n=13"],
        ["n=5", "camera_mm=[120, 15, -90]"],
        ["n=5", "coating_um=100"],
        ["n=5", "shell.seam_flange.dowels=0"],
    ],
    ids=str,
)
def test_mesh_is_closed_and_oriented(options: list[str]) -> None:
    made = mesh_of(design(load_spec(None, options)))
    every = trimesh.Trimesh(made.vertices, made.triangles, process=False)
    assert every.is_watertight
    assert every.is_winding_consistent
    assert made.volume > 0
    assert made.areas.min() > 0
    other = made.mirrored()
    assert other.volume == pytest.approx(made.volume)


def test_facets_lie_on_their_spheres_and_face_the_light(small_design: MirrorDesign) -> None:
    half = small_design.halves[0]
    made = mirror_facets(
        small_design.spec, half.modelled_cells, half.ellipsoid.radial_distance(half.u)
    )
    surfaces = half.modelled_cells.surfaces
    corner = made.vertices[made.triangles]
    for k in range(3):
        assert np.abs(surfaces.value(made.mirror, corner[:, k])).max() < 1e-9
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert dot(normal, surfaces.gradient(made.mirror, corner.mean(axis=1))).min() > 0


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 7])
def test_no_facet_folds_in_sharp_corners_of_coarse_cells(n: int) -> None:
    """At n = 3 and 5 the foot cuts cells in corners so sharp that a mitred strip would fold."""
    made = design(load_spec(None, [f"n={n}"]))
    half = made.halves[0]
    every = mirror_facets(made.spec, half.modelled_cells, half.ellipsoid.radial_distance(half.u))
    corner = every.vertices[every.triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert (
        dot(normal, half.modelled_cells.surfaces.gradient(every.mirror, corner.mean(axis=1))).min()
        > 0
    )


def test_chord_error_is_kept(small_design: MirrorDesign) -> None:
    half = small_design.halves[0]
    made = mirror_facets(
        small_design.spec, half.modelled_cells, half.ellipsoid.radial_distance(half.u)
    )
    middle = made.vertices[made.triangles].mean(axis=1)
    depth = np.abs(half.modelled_cells.surfaces.value(made.mirror, middle))
    assert depth.max() < small_design.spec.mesh.chord_error_mm


def test_area_of_facets_is_that_of_the_cells(paper_design: MirrorDesign) -> None:
    half = paper_design.halves[0]
    made = mirror_facets(
        paper_design.spec, half.modelled_cells, half.ellipsoid.radial_distance(half.u)
    )
    corner = made.vertices[made.triangles]
    area = norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])) / 2
    assert area.sum() == pytest.approx(half.area.sum(), rel=1e-3)


@pytest.mark.parametrize("error_mm", [0.05, 0.2])
def test_rim_facets_keep_the_ray_error(error_mm: float) -> None:
    """A facet on the rim reflects its rim points within the stated error of the sphere's ray.

    Along its length a facet's normal turns, which moves the ray along the capture sphere's edge
    and hardly from the centre: what counts for coverage is the distance from the centre.
    """
    made = design(load_spec(None, ["n=12", f"ray_error_mm={error_mm}", "chord_error_mm=0.002"]))
    half = made.halves[0]
    pinhole = half.camera.pinhole
    every = mirror_facets(made.spec, half.modelled_cells, half.ellipsoid.radial_distance(half.u))
    on_rim = every.triangles < every.first[-1] + every.steps[-1] - 1
    rim = on_rim.sum(axis=1) == 2
    triangle = every.triangles[rim]
    corner = every.vertices[triangle]
    normal = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    flag = on_rim[rim][:, :, None]
    point = (corner * flag).sum(axis=1) / 2
    exact = unit(half.modelled_cells.surfaces.gradient(every.mirror[rim], point))
    loss = miss_distances(pinhole, point, exact) - miss_distances(pinhole, point, normal)
    # Chords along curved arcs add their own sagitta, bounded by the chord error.
    radius = half.modelled_cells.surfaces.radius[every.mirror[rim]]
    chord = 2 * made.spec.mesh.chord_error_mm * norm(point) / radius
    assert np.quantile(loss - chord, 0.99) < error_mm


def test_joining_faces_are_flat_to_the_last_bit(small_design: MirrorDesign) -> None:
    made, foot = mesh_of(small_design), body_of(small_design).foot
    x, z = made.vertices[:, 0], made.vertices[:, 2]
    assert x.min() == 0
    assert not np.any((x > 0) & (x < 1e-9))
    assert z.min() == pytest.approx(foot, abs=1e-12)
