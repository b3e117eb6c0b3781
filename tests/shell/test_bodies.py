"""Shells and their negatives on all kinds of edges: mesh, solid and closed form agree."""

from itertools import product

import pytest
import trimesh
from OCP.BRepCheck import BRepCheck_Analyzer

from tbcad.cad.kernel.checks import properties
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.shell.files import camera_solid, mandrel_solid, shell_properties
from tbcad.shell.halves import camera_a_mandrel_mesh, camera_a_mesh
from tests.helpers import volume
from tests.mirror_arrays import mirror_design
from tests.pedestal_designs import OPTIONS

MESH_OF = {"shell": camera_a_mesh, "mandrel": camera_a_mandrel_mesh}
SOLID_OF = {"shell": camera_solid, "mandrel": mandrel_solid}
# A shell's thin wall makes more of the chords along its rims than a full mandrel.
VOLUME_ERROR = {"shell": 3e-4, "mandrel": 3e-5}
EVERY_BODY = pytest.mark.parametrize(
    ("body", "edges"), list(product(SOLID_OF, ("valley", "pedestal")))
)
MORE = [["n=6", "radius_rule=paper"]]
HOLES = ["n=3", "shell.seam_flange.dowels=0", "shell.foot_flange.bolts=12"]


def made(edges: str, *options: str) -> MirrorDesign:
    return mirror_design(f"shell.edges={edges}", "shell.negative=true", *options)


@EVERY_BODY
@pytest.mark.parametrize("options", [*OPTIONS, *MORE], ids=str)
def test_mesh_is_closed_and_oriented(body: str, edges: str, options: list[str]) -> None:
    mesh = MESH_OF[body](made(edges, *options))
    every = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert every.is_watertight
    assert every.is_winding_consistent
    assert every.volume > 0
    assert every.area_faces.min() > 0
    assert mesh.mirrored().volume == pytest.approx(mesh.volume)


@EVERY_BODY
@pytest.mark.parametrize("options", [["n=2", "radius_rule=flat"], HOLES], ids=str)
def test_solid_is_valid_and_has_the_volume_of_its_mesh(
    body: str, edges: str, options: list[str]
) -> None:
    """The mesh is built without the kernel: two ways to one volume."""
    fine = ["structure_error_mm=0.002", "chord_error_mm=0.001"]
    mirrors = made(edges, *options, *fine)
    expected = pytest.approx(MESH_OF[body](mirrors).volume, rel=VOLUME_ERROR[body])
    for array in mirrors.arrays:
        solid = SOLID_OF[body](mirrors, array)
        assert BRepCheck_Analyzer(solid.shape).IsValid()
        assert volume(solid.shape) == expected


@EVERY_BODY
@pytest.mark.parametrize("options", [["n=3", "camera_mm=[120, 15, -90]"]], ids=str)
def test_properties_are_those_that_the_kernel_integrates(
    body: str, edges: str, options: list[str]
) -> None:
    """The slow way is the oracle."""
    mirrors = made(edges, *options)
    for array in mirrors.arrays:
        solid = SOLID_OF[body](mirrors, array)
        fast = shell_properties(solid, array, negative=body == "mandrel")
        slow = properties(solid.shape)
        assert fast.volume == pytest.approx(slow.volume, rel=1e-6)
        assert fast.area == pytest.approx(slow.area, rel=1e-8)
        assert fast.centroid == pytest.approx(slow.centroid, abs=1e-4)
