"""What close-ups show: a section of the facets, and fields of both halves of a seam mirror."""

from pathlib import Path

import numpy as np
import pytest

from tbcad.core.optics.windows import seam_gaps
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.report.close_ups import cells_aimed_at_origin, edge_of_field, seam_mirror
from tbcad.report.shell_pictures import section_of
from tests.mirror_arrays import mirror_design
from tests.shell_meshes import export_with_meshes

GROOVE = 0.3
RADIUS = 30.0
FACETS_MM = 0.02  # that facets and a crest between two of their corners may be off


def shells(folder: Path, edges: str) -> ExportedDesign:
    """Of a small design."""
    made = mirror_design("n=8", f"shell.edges={edges}", f"shell.groove_mm={GROOVE}")
    return export_with_meshes(folder, made)


@pytest.fixture(scope="module")
def valley(tmp_path_factory: pytest.TempPathFactory) -> ExportedDesign:
    return shells(tmp_path_factory.mktemp("valley"), "valley")


@pytest.fixture(scope="module")
def pedestal(tmp_path_factory: pytest.TempPathFactory) -> ExportedDesign:
    return shells(tmp_path_factory.mktemp("pedestal"), "pedestal")


def test_a_valleys_bottom_is_on_both_spheres(valley: ExportedDesign) -> None:
    section = section_of(valley, 40)
    mirrors = valley.reflectors[0].mirrors
    for edge, pair in zip(section.edges, (section.mirrors[:2], section.mirrors[1:]), strict=True):
        # In the section's own plane, where a sphere is a circle about a point off the plane.
        place = placed(valley, section.mirrors, edge.bottom)
        off = np.linalg.norm(place - mirrors.centre[list(pair)], axis=1)
        assert off == pytest.approx(1 / mirrors.curvature[list(pair)], abs=FACETS_MM)
        assert "opening 1" in edge.words
        assert edge.depth > 0.1


def test_a_groove_is_as_wide_as_the_spec_has_it_and_deep(
    valley: ExportedDesign, pedestal: ExportedDesign
) -> None:
    for edge, other in zip(
        section_of(pedestal, 40).edges, section_of(valley, 40).edges, strict=True
    ):
        width = float(edge.words.split()[1])
        assert GROOVE <= width < 2 * GROOVE
        assert edge.depth > other.depth + 3 * GROOVE


def placed(export: ExportedDesign, mirrors: tuple[int, int, int], point: np.ndarray) -> np.ndarray:
    """A point of a section in the frame of the design."""
    apex, pinhole = export.reflectors[0].mirrors.apex, export.reflectors[0].camera.pinhole
    first, middle, last = (apex[k] for k in mirrors)
    along = (last - first) / np.linalg.norm(last - first)
    across = np.cross(along, pinhole - middle)
    across /= np.linalg.norm(across)
    return np.asarray(middle + point @ np.stack([along, np.cross(across, along)]))


@pytest.mark.parametrize("edges", ["valley", "pedestal"])
def test_halves_aimed_at_the_origin_leave_a_gap_and_built_ones_none(
    edges: str, request: pytest.FixtureRequest
) -> None:
    export = request.getfixturevalue(edges)
    reflector, mirror = export.reflectors[0], seam_mirror(export)
    assert reflector.mirrors.apex[mirror, 0] == pytest.approx(0, abs=1e-9)
    along = np.linspace(-RADIUS, RADIUS, 2001)
    before = cells_aimed_at_origin(reflector)
    gap = seam_gaps(before, reflector.camera.pinhole, RADIUS)
    assert gap[mirror] == gap.max() > 1
    for cells, expected in ((before, gap[mirror]), (reflector.cells, 0.0)):
        edge = edge_of_field(cells, reflector, mirror, along)
        assert max(0, 2 * edge.max()) == pytest.approx(expected, abs=1e-2)
