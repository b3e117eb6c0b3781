"""The mirrors come out of the triangles, and only they; what was moved is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import Delaunay
from tbcad_verify.mesh.holes import round_holes
from tbcad_verify.mesh.mesh import Mesh, indexed_mesh
from tbcad_verify.mesh.segments import Edges, count_folds, creases, measure_edges, rounding
from tbcad_verify.shell.mirrors_found import checks
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.shell.recover import recover

from tbcad.cad.formats.mesh_files import write_stl
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.load import load_spec
from tbcad.output.manifest import write_manifest
from tbcad.shell.halves import camera_a_mesh
from tests.verify.optical_setups import optical_setup_of
from tests.verify.synthetic_export import Cells

RNG = np.random.default_rng(7)
PINHOLE = np.array([100.0, 0, -100])


def test_every_facet_goes_to_its_mirror(optical_setup: OpticalSetup, exact_cells: Cells) -> None:
    owner = optical_setup.owner()[optical_setup.recovery.segments.label]
    count = len(exact_cells.faces)
    ids = optical_setup.export.mirrors.ids
    names = [f"a{exact_cells.mirrors[k]['number']:04d}" for k in exact_cells.face_mirror]
    assert [ids[k] for k in owner[:count]] == names
    walls = len(optical_setup.mesh.faces) // 2
    assert (owner[count:walls] == -1).all()


def test_recovered_within_a_micrometre(optical_setup: OpticalSetup) -> None:
    assert optical_setup.match.centre_error.max() < 1e-3
    assert optical_setup.match.radius_error.max() < 1e-3
    assert all(check.passed for check in checks(optical_setup, "x")[0])


def test_centres_swapped_in_the_record_are_named(export_folder: Path) -> None:
    optical_setup = optical_setup_of(export_folder)
    order = np.arange(len(optical_setup.export.mirrors))
    order[[15, 16]] = 16, 15
    other = optical_setup.export.mirrors.take(order)
    spheres = {name: getattr(other, name) for name in ("cx", "cy", "cz", "radius_mm")}
    mirrors = optical_setup.export.mirrors.model_copy(update=spheres)
    swapped = replace(optical_setup, export=replace(optical_setup.export, mirrors=mirrors))
    errors = np.linalg.norm(optical_setup.mirrors.centre() - mirrors.columns("cx", 3), axis=0)
    swapped = replace(swapped, match=replace(optical_setup.match, centre_error=errors))
    said = {c.name: c.detail for c in checks(swapped, "x")[0]}
    assert "a0016 has the place of a0017, a0017 has the place of a0016" in said["centre error"]


def frame(normal: np.ndarray) -> np.ndarray:
    """(3, 3) rows: two axes at right angles to a direction, and the direction itself."""
    n = normal / np.linalg.norm(normal)
    e = np.cross(n, [0, 1, 0])
    e /= np.linalg.norm(e)
    return np.stack([e, np.cross(n, e), n])


def closed_cap(radius: float, warp: float) -> Mesh:
    """A spherical cap that faces camera and object, with a cone behind it, badly triangulated.

    The triangles are Delaunay's for points that are then moved along the sphere: the result has
    concave edges inside one sphere.
    """
    a = 2 * np.pi * np.arange(60) / 60
    rim = 4 * np.stack([np.cos(a), np.sin(a)])
    inner = 3.7 * np.sqrt(RNG.random(400)) * np.stack([np.cos(b := RNG.random(400) * 7), np.sin(b)])
    flat = np.hstack([rim, inner])
    faces = Delaunay(flat.T).simplices
    (a, b), (c, d) = (flat[:, faces[:, k]] - flat[:, faces[:, 0]] for k in (1, 2))
    turned = a * d - b * c < 0
    faces[turned] = faces[turned][:, ::-1]
    flat[:, 60:] += warp * np.sin(3 * flat[::-1, 60:])
    points = np.vstack([flat, np.sqrt(radius**2 - (flat**2).sum(axis=0)) - radius])
    hub = np.array([[0], [0], [-8.0]])
    back = [[(j + 1) % 60, j, points.shape[1]] for j in range(60)]
    place = np.array([0, 0, 60.0])
    turn = frame((PINHOLE - place) / np.linalg.norm(PINHOLE - place) - [0, 0, 1])
    points = np.hstack([points, hub]).T @ turn + place
    points = points.astype(np.float32).astype(np.float64)
    return indexed_mesh(points, np.vstack([faces, back]).astype(np.int32))


@pytest.mark.parametrize("radius", [7.0, 60.0])
def test_concave_edges_inside_a_sphere_do_not_split_it(radius: float) -> None:
    mesh = closed_cap(radius, 0.12)
    edges = measure_edges(mesh)
    inside = edges.half[creases(mesh, edges) & (edges.angle < 0)]
    assert inside.size > 20  # or the test tests nothing
    found = recover(mesh, PINHOLE, 30)
    assert found.mirror.sum() == 1
    mirror = int(np.flatnonzero(found.mirror)[0])
    assert (found.segments.label[:-60] == mirror).all()
    assert 1 / found.fits.surfaces.curvature[mirror] == pytest.approx(radius, abs=5e-3)


def test_what_faces_away_is_no_mirror() -> None:
    mesh = closed_cap(20.0, 0.0)
    assert recover(mesh, PINHOLE, 30).mirror.sum() == 1
    assert recover(mesh, np.array([0.0, 0, 300]), 30).mirror.sum() == 0
    turned = indexed_mesh(mesh.points, mesh.faces[:, ::-1].copy())
    assert recover(turned, PINHOLE, 30).mirror.sum() == 0
    assert recover(mesh, None, 30).mirror.sum() == 0


def test_a_misshapen_patch_is_no_mirror() -> None:
    """Astigmatism of ten micrometres over the patch: smooth, but no sphere."""
    mesh = closed_cap(20.0, 0.0)
    x = mesh.points - mesh.points.mean(axis=0)
    bent = mesh.points + 1e-2 * (x[:, 1:2] / 4) ** 2 * [0, 0, 1]
    found = recover(indexed_mesh(bent, mesh.faces), PINHOLE, 30)
    assert found.mirror.sum() == 0
    assert found.fits.form[found.segments.label[0]] > 1e-3


def test_splinters_are_no_spheres() -> None:
    """A rough surface falls into splinters that each fit some sphere: too few points to tell."""
    mesh = closed_cap(20.0, 0.0)
    rough = mesh.points + 4e-3 * RNG.normal(size=mesh.points.shape)
    found = recover(indexed_mesh(rough, mesh.faces), PINHOLE, 30)
    assert (found.fits.area[found.mirror] < 0.1 * found.fits.area.max()).all()


def test_a_fold_is_seen() -> None:
    """A vertex pulled across its neighbours: closed still, but folded."""
    mesh = closed_cap(20.0, 0.0)
    assert recover(mesh, PINHOLE, 30).folds == 0
    points = mesh.points.copy()
    inner = mesh.faces[np.argmax(mesh.faces.min(axis=1) > 100)]
    points[inner[0]] += 3 * (points[inner[1]] - points[inner[0]])
    assert recover(indexed_mesh(points, mesh.faces), PINHOLE, 30).folds > 0


def test_a_countersink_is_no_mirror() -> None:
    """A cone's rim and tip lie on a sphere; its facets do not follow it."""
    a = 2 * np.pi * np.arange(60) / 60
    rim = np.stack([4 * np.cos(a), 4 * np.sin(a), np.zeros(60)])
    tips = np.array([[0, 0], [0, 0], [1.2, -5.0]])
    local = np.hstack([rim, tips])
    ends = [[j, (j + 1) % 60, 60] for j in range(60)] + [[(j + 1) % 60, j, 61] for j in range(60)]
    mesh = closed_cap(20.0, 0.0)
    points = local.T @ frame(mesh.area[:, :-60].sum(axis=1)) + [0, 0, 60]
    found = recover(indexed_mesh(points, np.array(ends, np.int32)), PINHOLE, 30)
    tip = found.segments.label[0]
    assert (found.segments.label[:60] == tip).all()
    assert found.fits.form[tip] < 1e-6
    assert not found.mirror.any()


def shell(camera: list[float], semi_minor: float, capture: float) -> tuple[MirrorDesign, Mesh]:
    """Camera a's half of a design of n = 3, in 32-bit floats as in its STL."""
    options = [f"camera_mm={camera}", f"semi_minor_mm={semi_minor}"]
    designed = design(load_spec(None, ["n=3", f"capture_diameter_mm={capture}", *options]))
    mesh = camera_a_mesh(designed)
    points = mesh.vertices.astype(np.float32).astype(np.float64)
    return designed, indexed_mesh(points, mesh.triangles.astype(np.int32))


# Camera and semi-minor axis, mm, and diameter of the capture sphere.
HOLES = (
    [[61.3, 0, -51.4], 82.6, 35],
    [[162.6, 0, -102.7], 117.1, 66.1],
    [[76.6, 0, -54.9], 94.8, 35.3],
)
SMOOTH = [[231.2, 0, -84.1], 53.8, 20], [[197.6, 0, -113.5], 91.2, 26.2]


@pytest.mark.parametrize("optics", HOLES, ids=str)
def test_strips_of_a_hole_are_no_mirrors(optics: tuple[list[float], float, float]) -> None:
    """Strips of holes in the flanges face camera and object, and would send light there."""
    designed, mesh = shell(*optics)
    found = recover(mesh, np.array(optics[0]), optics[2] / 2)
    assert found.mirror.sum() == len(designed.arrays[0])
    strips = found.segments.label[round_holes(mesh, measure_edges(mesh)).wall]
    assert strips.size > 500
    assert not found.mirror[strips].any()


@pytest.mark.parametrize("optics", SMOOTH, ids=str)
def test_a_mirror_ends_where_the_foot_goes_on_smoothly(
    optics: tuple[list[float], float, float],
) -> None:
    """The lowest mirror bends into the plane of the foot by less than some mirrors' own facets."""
    designed, mesh = shell(*optics)
    edges = measure_edges(mesh)
    found = recover(mesh, np.array(optics[0]), optics[2] / 2)
    assert found.mirror.sum() == len(designed.arrays[0])
    foot = (mesh.points[mesh.faces][:, :, 2] == np.float32(designed.arrays[0].foot)).all(axis=1)
    mirror = found.mirror[found.segments.label]
    one, two = edges.half // 3, mesh.twin[edges.half] // 3
    border = (foot[one] & mirror[two]) | (mirror[one] & foot[two])
    assert 0.1 < edges.angle[border].min() < 0.2
    assert creases(mesh, edges)[border].all()


def test_a_long_mirror_is_found_where_its_camera_sees_its_apex(tmp_path: Path) -> None:
    """The lowest mirror reaches so far outward that other mirrors' middles are nearer its apex."""
    optics = ["camera_mm=[231.2, 0, -84.1]", "semi_minor_mm=53.8", "capture_diameter_mm=20"]
    designed = design(load_spec(None, ["n=3", *optics]))
    mesh = camera_a_mesh(designed)
    write_stl(tmp_path / "shell_a.stl", mesh)
    write_stl(tmp_path / "shell_b.stl", mesh.mirrored())
    for half in "ab":
        (tmp_path / f"shell_{half}.step").touch()
        (tmp_path / f"shell_{half}.3mf").touch()
    write_record(tmp_path, designed, shells=True)
    write_manifest(tmp_path, "build")
    setup = optical_setup_of(tmp_path)
    mirror = setup.export.mirrors.ids.index("a0022")
    middles = setup.recovery.fits.middle[:, setup.match.segment]
    apex = setup.export.mirrors.columns("px", 3)[:, mirror]
    assert np.linalg.norm(middles - apex[:, None], axis=0).argmin() != mirror
    assert all(check.passed for check in checks(setup, "x")[0])


def test_rounding_never_makes_a_crease() -> None:
    """Facets of a true plane, thin ones too, rounded to float32: no edge may look concave."""
    flat = RNG.random((2000, 2)) * [80, 0.05] + [20, 90]
    flat = np.vstack([flat, RNG.random((500, 2)) * 80 + [20, 20]])
    faces = Delaunay(flat).simplices.astype(np.int32)
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    points = np.column_stack([flat, np.full(len(flat), 9.0)]) @ turn
    mesh = indexed_mesh(points.astype(np.float32).astype(np.float64), faces)
    edges = measure_edges(mesh)
    assert np.abs(edges.angle).max() > 1e-5
    sure = edges.noise < 0.05
    assert (np.abs(edges.angle) <= edges.noise)[sure].all()
    assert not creases(mesh, edges)[sure].any()
    assert rounding(mesh) < 2e-5


def test_an_edge_that_rounding_may_have_folded_is_no_fold() -> None:
    angle, noise = np.array([3.0, -3.0, 3.0, 2.9]), np.array([0.0, 0.0, 0.1, 0.0])
    assert count_folds(Edges(np.arange(4), angle, noise), 0.2) == 2
