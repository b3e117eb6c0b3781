import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line, GeomAbs_Plane, GeomAbs_Sphere
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from scipy.spatial import cKDTree

from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorArray, design
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.shell.envelope import Envelope, closing_envelope
from tbcad.shell.files import camera_solid
from tests.helpers import area
from tests.pedestal_designs import pedestal_design


@pytest.mark.parametrize("rule", ["traced", "paper", "flat"])
def test_each_face_has_its_cells_area(rule: str) -> None:
    """A face that is the complement of its cell is valid too: only the area tells."""
    mirrors = design(load_spec(None, ["n=7", f"radius_rule={rule}"]))
    for array in mirrors.arrays:
        faces = camera_solid(mirrors, array).faces[: len(array)]
        assert [area(face) for _, face in faces] == pytest.approx(array.area, rel=1e-6)


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


def test_wall_behind_the_deepest_valley(small_half: MirrorArray, small_envelope: Envelope) -> None:
    """The smallest distance from any corner or arc to the back is the wall, within the samples."""
    arcs = small_half.modelled_cells.arcs
    arc, t = np.broadcast_arrays(np.arange(len(arcs))[:, None], np.linspace(0, 1, 9))
    valley = arcs.at(arc, t).reshape(-1, 3)
    rng = np.random.default_rng(3)
    unit = rng.normal(size=(400_000, 3))
    unit /= norm(unit)[:, None]
    back = small_envelope.back.centre + unit @ small_envelope.back.from_sphere
    assert 3.0 - 1e-6 < cKDTree(back).query(valley)[0].min() < 3.3


@pytest.mark.parametrize("which", ["seam", "foot"])
def test_holes_stay_inside_their_flange(small_envelope: Envelope, which: str) -> None:
    holes = getattr(small_envelope, f"{which}_holes")
    inner = getattr(small_envelope, f"{which}_back").at(np.linspace(0, 1, 4001))
    outer = getattr(small_envelope, f"{which}_rim").at(np.linspace(0, 1, 4001))
    plane = [1, 2] if which == "seam" else [0, 1]
    for centre, radius in zip(holes.centre, holes.radius, strict=True):
        for line in (inner, outer):
            assert norm(line[:, plane] - centre[plane]).min() > radius + 1.0


def test_too_many_holes_are_refused(small_half: MirrorArray) -> None:
    spec = load_spec(None, ["shell.seam_flange.bolts=60"])
    with pytest.raises(SpecError, match="holes") as caught:
        closing_envelope(spec.shell, small_half.modelled_cells, small_half.ellipsoid)
    assert "lower bolts" in str(caught.value)
