"""Shells whose mirrors stand on pedestals: mesh, solid and closed form against each other."""

import numpy as np
import pytest
import trimesh
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line, GeomAbs_Plane, GeomAbs_Sphere
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from tbcad.cad.measures import properties
from tbcad.shell.files import camera_a_mesh, camera_solid, shell_properties
from tests.helpers import area, volume
from tests.pedestal_designs import OPTIONS, pedestal_design


@pytest.mark.parametrize("options", [*OPTIONS, ["n=13"]], ids=str)
def test_mesh_is_closed_and_oriented(options: list[str]) -> None:
    mesh = camera_a_mesh(pedestal_design(*options))
    every = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert every.is_watertight
    assert every.is_winding_consistent
    assert mesh.areas.min() > 0


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_solid_is_valid_and_has_the_volume_of_its_mesh(options: list[str]) -> None:
    fine = [*options, "structure_error_mm=0.002", "chord_error_mm=0.001"]
    mirrors = pedestal_design(*fine)
    expected = pytest.approx(camera_a_mesh(mirrors).volume, rel=3e-4)
    for array in mirrors.arrays:
        solid = camera_solid(mirrors, array)
        assert BRepCheck_Analyzer(solid.shape).IsValid()
        assert volume(solid.shape) == expected


def test_faces_are_spheres_and_planes_between_lines_and_circles_with_their_own_names() -> None:
    mirrors = pedestal_design("n=5")
    array = mirrors.arrays[1]
    solid = camera_solid(mirrors, array)
    names, faces = zip(*solid.faces, strict=True)
    assert len(set(names)) == len(names)
    count = len(array) + len(array.cells.walls)
    walls = [f"{array.ids[i]}_{array.ids[j]}" for i, j in mirrors.arrays[0].cells.walls.tolist()]
    assert list(names[len(array) : count]) == walls
    for k, face in enumerate(faces[:count]):
        kind = GeomAbs_Sphere if k < len(array) else GeomAbs_Plane
        assert BRepAdaptor_Surface(face).GetType() == kind
        explorer = TopExp_Explorer(face, TopAbs_EDGE)
        while explorer.More():
            curve = BRepAdaptor_Curve(TopoDS.Edge_s(explorer.Current())).GetType()
            assert curve in (GeomAbs_Line, GeomAbs_Circle)
            explorer.Next()
    assert [area(face) for face in faces[: len(array)]] == pytest.approx(array.area, rel=1e-6)


@pytest.mark.parametrize("camera", [0, 1])
def test_properties_agree_with_the_kernel_s(camera: int) -> None:
    mirrors = pedestal_design("n=5")
    array = mirrors.arrays[camera]
    solid = camera_solid(mirrors, array)
    own, kernel = shell_properties(solid, array), properties(solid.shape)
    assert own.volume == pytest.approx(kernel.volume, rel=1e-8)
    assert own.area == pytest.approx(kernel.area, rel=1e-8)
    np.testing.assert_allclose(own.centroid, kernel.centroid, atol=1e-5)
