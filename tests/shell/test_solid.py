import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line, GeomAbs_Plane, GeomAbs_Sphere
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.shell.files import camera_solid, shell_envelope
from tests.helpers import area
from tests.pedestal_designs import pedestal_design


@pytest.mark.parametrize("rule", ["traced", "paper", "flat"])
def test_each_face_has_its_cells_area(rule: str) -> None:
    """A face that is the complement of its cell is valid too: only the area tells."""
    mirrors = design(load_spec(None, ["n=7", f"radius_rule={rule}"]))
    for array in mirrors.arrays:
        faces = camera_solid(mirrors, array).faces[: len(array)]
        assert [area(face) for _, face in faces] == pytest.approx(array.area, rel=1e-6)


def test_holes_go_through(small_design: MirrorDesign) -> None:
    """Area of each hole's wall: circumference times thickness of its flange."""
    envelope = shell_envelope(small_design)
    faces = dict(camera_solid(small_design, small_design.arrays[0]).faces)
    for kind in ("seam", "foot"):
        holes = getattr(envelope, f"{kind}_holes")
        thickness = np.linalg.norm(holes.direction)
        for k, radius in enumerate(holes.radius):
            wall = area(faces[f"{kind}_hole_{k + 1:02d}"])
            assert wall == pytest.approx(2 * np.pi * radius * thickness, rel=1e-9)


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
