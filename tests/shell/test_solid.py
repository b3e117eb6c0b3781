import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line, GeomAbs_Plane, GeomAbs_Sphere
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from scipy.spatial import cKDTree

from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.shell.envelope import Envelope, closing_envelope
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


def test_ends_meet(small_envelope: Envelope) -> None:
    ends = np.array([0.0, 1.0])
    assert small_envelope.seam_back.at(ends) == pytest.approx(small_envelope.foot_back.at(ends))
    seam, foot = small_envelope.seam_rim.at(ends), small_envelope.foot_rim.at(ends)
    assert np.abs(seam[:, 0]).max() < 1e-9
    assert foot[:, 2] == pytest.approx(small_envelope.foot)
    # the seam flange stands on the foot flange
    assert foot[1, 1] >= seam[1, 1] + 1 - 1e-9
    assert foot[0, 1] <= seam[0, 1] - 1 + 1e-9


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
