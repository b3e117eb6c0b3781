"""What close-ups show: a section of the facets, and fields of both halves of a seam mirror."""

import itertools
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tbcad.app.cli import run
from tbcad.cad.drafting.callouts import RADIUS as CALLOUT_RADIUS
from tbcad.cad.drafting.callouts import Callout, cross, place_callouts
from tbcad.core.mirrors.array import design
from tbcad.core.mirrors.record import write_record
from tbcad.core.optics.windows import seam_gaps
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.prototype.assembly_steps.exploded import offsets
from tbcad.prototype.assembly_steps.machine import read_machine
from tbcad.report.close_ups import cells_aimed_at_origin, edge_of_field, seam_mirror
from tbcad.report.shell_pictures import mirror_of_facets, read_modelled, section_of
from tbcad.shell.facets import mirror_facets
from tbcad.shell.halves import camera_a_mesh
from tests.exported_files import contents
from tests.mirror_arrays import mirror_design
from tests.prototype.assembly_steps.test_steps import LOOSE, belt_design, write
from tests.shell_meshes import export_with_meshes

GROOVE, EDGES = 0.3, ("valley", "pedestal")
RADIUS = 30.0
FACETS_MM = 0.02  # that facets and a crest between two of their corners may be off
SIZE = (1500, 950)
ROOT = Path(__file__).parents[2]
AFTERNOON = ROOT / "designs" / "afternoon-print.toml"
SAMPLE = ROOT / "docs" / "sample"


@pytest.fixture(scope="module")
def shells(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ExportedDesign]:
    """Of a small design, by the kind of edges."""
    found = {}
    for edges in EDGES:
        made = mirror_design("n=8", f"shell.edges={edges}", f"shell.groove_mm={GROOVE}")
        found[edges] = export_with_meshes(tmp_path_factory.mktemp(edges), made)
    return found


def test_a_valleys_bottom_is_on_both_spheres(shells: dict[str, ExportedDesign]) -> None:
    valley = shells["valley"]
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
    shells: dict[str, ExportedDesign],
) -> None:
    valley, pedestal = (section_of(shells[edges], 40).edges for edges in EDGES)
    for edge, other in zip(pedestal, valley, strict=True):
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


@pytest.mark.parametrize("edges", EDGES)
def test_halves_aimed_at_the_origin_leave_a_gap_and_built_ones_none(
    edges: str, shells: dict[str, ExportedDesign]
) -> None:
    export = shells[edges]
    reflector, mirror = export.reflectors[0], seam_mirror(export)
    assert reflector.mirrors.apex[mirror, 0] == pytest.approx(0, abs=1e-9)
    along = np.linspace(-RADIUS, RADIUS, 2001)
    before = cells_aimed_at_origin(reflector)
    gap = seam_gaps(before, reflector.camera.pinhole, RADIUS)
    assert gap[mirror] == gap.max() > 1
    for cells, expected in ((before, gap[mirror]), (reflector.cells, 0.0)):
        edge = edge_of_field(cells, reflector, mirror, along)
        assert max(0, 2 * edge.max()) == pytest.approx(expected, abs=1e-2)


@pytest.mark.parametrize("seed", range(20))
def test_lines_do_not_cross_and_circles_do_not_overlap(seed: int) -> None:
    random = np.random.default_rng(seed)
    anchors = random.uniform((200, 50), (1300, 900), (random.integers(1, 20), 2)).tolist()
    placed = place_callouts([Callout(k, 1, (x, y)) for k, (x, y) in enumerate(anchors)], SIZE)
    assert sorted(one.callout.number for one in placed) == [*range(len(anchors))]
    for a, b in itertools.combinations(placed, 2):
        assert np.hypot(*np.subtract(a.middle, b.middle)) > 2 * CALLOUT_RADIUS
        assert not cross(a.middle, a.callout.anchor, b.middle, b.callout.anchor)
    assert all(0 < one.middle[1] < SIZE[1] for one in placed)


def test_bodies_are_moved_against_their_screws_and_away_from_what_is_there(tmp_path: Path) -> None:
    machine = read_machine(write(tmp_path, belt_design(), LOOSE))
    moved = offsets(machine, frozenset({"wheel", "zero_disc", "M3x16_1"}))
    along = [moved[name][2] for name in ("M3x16_1", "wheel", "zero_disc")]
    assert along == sorted(along)
    assert along[-1] < 0
    assert all(np.all(offset[:2] == 0) for offset in moved.values())
    moved = offsets(machine, frozenset({"motor", "M3x12_1"}))
    assert moved["M3x12_1"][2] < 0 < moved["motor"][2]


@pytest.mark.parametrize(
    ("file", "options"),
    [
        (None, ["n=3"]),
        (None, ["n=4", "radius_rule=flat"]),
        (None, ["n=5", "coating_um=400"]),
        (AFTERNOON, []),
    ],
    ids=["n = 3", "flat", "coat", "afternoon-print"],
)
def test_facets_belong_to_the_mirrors_that_they_were_made_for(
    file: Path | None, options: list[str], tmp_path: Path
) -> None:
    """All facets of the casing are grey, also where three corners lie on the edge of a mirror."""
    mirrors = design(load_spec(file, options))
    write_record(tmp_path, mirrors, shells=False)
    mesh, array = camera_a_mesh(mirrors), mirrors.arrays[0]
    made = mirror_facets(mirrors.spec, array.modelled_cells, array.apex_distance).mirror
    corners = mesh.vertices.astype(np.float32).astype(np.float64)[mesh.triangles]
    mirror, found = mirror_of_facets(corners, read_modelled(tmp_path, "a")[0])
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    front = np.arange(len(mesh.triangles)) < len(made)
    assert area[found != front].sum() < 1e-4 * area[front].sum()
    other = mirror[: len(made)] != made  # slivers along an edge lie on both of its mirrors
    assert area[: len(made)][other].sum() < 1e-4 * area[front].sum()
    assert not found[~front].any()


@pytest.fixture
def export(tmp_path: Path) -> Path:
    folder = tmp_path / "exports"
    shutil.copytree(SAMPLE, folder)
    return folder


@pytest.mark.slow
@pytest.mark.skipif(
    sys.platform == "linux" and not (shutil.which("xvfb-run") or os.environ.get("DISPLAY")),
    reason="no screen, and no xvfb-run",
)
def test_the_shells_are_drawn_whole(export: Path) -> None:
    """The same bytes each time, and both halves."""
    before, out = contents(export), export.parent / "shell.png"
    assert run(["picture", str(export), "--out", str(out)]) == 0
    first = out.read_bytes()
    assert run(["picture", str(export), "--out", str(out), "--force"]) == 0
    assert out.read_bytes() == first
    assert contents(export) == before
    picture = np.asarray(Image.open(out).convert("L"))
    assert all((half < 255).mean() > 0.2 for half in np.split(picture, 2, axis=1))
