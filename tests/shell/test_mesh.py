import numpy as np
import pytest

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.reflection import miss_distances
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.spec.errors import SpecError
from tbcad.output.overview import overview
from tbcad.shell.cell_outlines import CellOutlines
from tbcad.shell.facets import Facets, facet_coverage, middles, mirror_facets
from tbcad.shell.halves import camera_a_mesh, check_mirrors, shell_envelope
from tests.mirror_arrays import mirror_design

INWARD_FOOT = (
    ["n=2", "camera_mm=[191.1, 0, -156.1]", "semi_minor_mm=72.5", "capture_diameter_mm=23.4"],
    ["n=3", "camera_mm=[163.6, 0, -127]", "semi_minor_mm=67.9", "capture_diameter_mm=24.6"],
)
SHORT_ARCS = (
    ["n=3", "camera_mm=[97.2, 0, -52]", "semi_minor_mm=35.4", "capture_diameter_mm=20"],
    ["n=3", "camera_mm=[62.3, 0, -50.2]", "semi_minor_mm=36.1", "capture_diameter_mm=22.2"],
)
LONG = ["n=5", "camera_mm=[363.5, 0, -145.4]", "semi_minor_mm=115.5", "capture_diameter_mm=47.1"]
RADIUS = 1000.0


def facets_of(mirrors: MirrorDesign) -> Facets:
    array = mirrors.arrays[0]
    return mirror_facets(mirrors.spec, array.modelled_cells, array.apex_distance)


def normals_of(corner: np.ndarray) -> np.ndarray:
    """Normals (t, 3) of triangles (t, 3, 3), as long as twice their areas."""
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])


def test_facets_lie_on_their_spheres_within_the_chord_error(small_design: MirrorDesign) -> None:
    facets = facets_of(small_design)
    surfaces = small_design.arrays[0].modelled_cells.surfaces
    corner = facets.vertices[facets.triangles]
    for k in range(3):
        assert np.abs(surfaces.value(facets.mirror, corner[:, k])).max() < 1e-9
    depth = np.abs(surfaces.value(facets.mirror, corner.mean(axis=1)))
    assert depth.max() < small_design.spec.mesh.chord_error_mm


@pytest.mark.parametrize("options", [*([f"n={n}"] for n in (3, 5)), *INWARD_FOOT], ids=str)
def test_all_facets_face_the_light(options: list[str]) -> None:
    """At n = 3 and 5 the foot cuts cells in corners so sharp that a mitred strip would fold.

    In long ellipsoids a cell's side at the foot bends so far inward that not all of the outline is
    in sight of its points' mean.
    """
    mirrors = mirror_design(*options)
    facets, surfaces = facets_of(mirrors), mirrors.arrays[0].modelled_cells.surfaces
    corner = facets.vertices[facets.triangles]
    toward_light = surfaces.gradient(facets.mirror, corner.mean(axis=1))
    assert dot(normals_of(corner), toward_light).min() > 0


def rim_facets(
    mirrors: MirrorDesign, written_as: type[np.floating]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mirror (t,), ends on the rim (t, 2, 3) and normal (t, 3) of facets with a side on the rim."""
    facets = facets_of(mirrors)
    on_rim = facets.triangles < len(facets.outlines.vertices)
    rim = on_rim.sum(axis=1) == 2
    corner = facets.vertices.astype(written_as).astype(np.float64)[facets.triangles[rim]]
    edge = corner[on_rim[rim]].reshape(-1, 2, 3)
    return facets.mirror[rim], edge, unit(normals_of(corner))


@pytest.mark.parametrize("options", [["n=3"], *SHORT_ARCS, LONG], ids=str)
def test_facets_cost_less_than_the_margin(options: list[str]) -> None:
    """Arcs shorter than the strip (one has 1.2 micrometres) do not skew facets on long ones.

    Off long mirrors far from the camera a facet's rays shift toward the object's centre.
    """
    mirrors = mirror_design(*options)
    array, (mirror, edge, normal) = mirrors.arrays[0], rim_facets(mirrors, np.float32)
    cut = array.cells.halved[mirror] & (edge[:, :, 0] == 0).all(axis=1)
    pinhole = array.camera.pinhole
    at_ends = miss_distances(pinhole, edge, normal[:, None]).min(axis=1)
    seen = np.full(len(array), np.inf)
    np.minimum.at(seen, mirror[~cut], 2 * at_ends[~cut])
    left = seen.min() - mirrors.spec.optics.capture_diameter_mm
    assert left > mirrors.spec.mirrors.margin_mm / 3


def test_joining_faces_are_flat_to_the_last_bit(small_design: MirrorDesign) -> None:
    mesh, foot = camera_a_mesh(small_design), shell_envelope(small_design).foot
    x, z = mesh.vertices[:, 0], mesh.vertices[:, 2]
    assert x.min() == 0
    assert not np.any((x > 0) & (x < 1e-9))
    assert z.min() == pytest.approx(foot, abs=1e-12)


def outline(corners: list[tuple[float, float]]) -> tuple[CellOutlines, Surfaces]:
    """One cell on top of a sphere that is lit from above; corners run clockwise seen from there."""
    flat = np.array(corners, dtype=float)
    height = np.sqrt(RADIUS**2 - (flat**2).sum(axis=1)) - RADIUS
    points = np.column_stack([flat, height])
    place, none = np.arange(len(points)), np.zeros(0, dtype=np.int64)
    following = np.roll(place, -1)
    cell, corner = np.zeros_like(place), np.ones(len(place), dtype=bool)
    outlines = CellOutlines(
        points, none, none, none, none, cell, place, following, corner, corner.copy()
    )
    up = np.array([[0.0, 0.0, 1.0]])
    return outlines, Surfaces(np.zeros((1, 3)), up, np.array([1 / RADIUS]))


def test_a_convex_cell_has_the_mean_of_its_points() -> None:
    middle = middles(*outline([(0, 0), (0, 6), (6, 6), (6, 0)]))
    assert middle[0, :2] == pytest.approx([3, 3], abs=1e-3)


def test_an_angle_is_seen_whole_from_its_corner_only() -> None:
    """The points of an L, most of them at its ends, have a mean outside of where arms cross."""
    corners = [(0, 0), (0, 9), (2, 9), (2, 2), (9, 2), (9, 0)]
    middle = middles(*outline(corners))
    assert middle[0, :2] == pytest.approx([1, 1], abs=0.02)
    assert norm(middle[0] + [0, 0, RADIUS]) == pytest.approx(RADIUS)


def test_what_no_point_sees_whole_is_refused() -> None:
    corners = [(0, 0), (0, 9), (2, 9), (2, 2), (7, 2), (7, 9), (9, 9), (9, 0)]
    with pytest.raises(
        SpecError, match=r"a0001 bends so far inward .* make optics\.semi_minor_mm larger"
    ):
        middles(*outline(corners))


FOLDED = ["n=3", "camera_mm=[185.4, 0, -136.3]", "semi_minor_mm=51.4", "capture_diameter_mm=20"]


def test_facets_that_would_fold_are_refused() -> None:
    with pytest.raises(SpecError, match=r"a0026 .* facets would fold: one .* is 0\.00\d+ mm wide"):
        check_mirrors(mirror_design(*FOLDED))


# As the verification found them on the files of these designs: by outlines on recovered spheres.
@pytest.mark.parametrize(
    ("options", "shown"),
    [
        (["n=3", "margin_mm=0"], 59.8285148),
        (["n=3", "margin_mm=0.1"], 59.9313265),
        (["n=3", "ray_error_mm=1"], 59.0979393),
        (["n=5", "margin_mm=0.2", "ray_error_mm=0.1", "coating_um=100"], 59.6443208),
    ],
)
def test_what_facets_show_is_what_the_verification_finds(options: list[str], shown: float) -> None:
    mirrors = mirror_design(*options)
    facets, cells = facets_of(mirrors), mirrors.arrays[0].modelled_cells
    assert facet_coverage(mirrors.spec, cells, facets) == pytest.approx(shown, abs=1e-5)
    for refuse in (check_mirrors, overview):  # as a build, and as build --dry-run
        with pytest.raises(SpecError, match=rf"show {shown:.2f} mm, less than .* 60: make mirrors"):
            refuse(mirrors)


def test_a_coat_leaves_the_mirrors_that_the_seam_halves() -> None:
    bare, coated = mirror_design("n=4"), mirror_design("n=4", "coating_um=200")
    halved = bare.arrays[0].modelled_cells.halved
    assert halved.sum() == 9
    for array in coated.arrays:
        assert (array.modelled_cells.halved == halved).all()


def test_margins_that_an_error_names_are_enough() -> None:
    for options in (["n=3", "margin_mm=0.2"], ["n=3"]):
        check_mirrors(mirror_design(*options))
