import numpy as np
import pytest
from OCP.BRepCheck import BRepCheck_Analyzer

from tbcad.mirrors.array import MirrorDesign, design
from tbcad.shell.files import camera_a_mesh, camera_solid, shell_envelope
from tbcad.spec.load import load_spec
from tests.helpers import area, volume


@pytest.mark.parametrize(
    "options",
    [
        ["n=2"],
        ["n=5"],
        ["n=6"],
        ["n=4", "radius_rule=flat"],
        ["n=9", "radius_rule=paper"],
        ["n=5", "coating_um=100"],
        ["n=5", "camera_mm=[120, 15, -90]"],
        ["n=5", "shell.seam_flange.dowels=0", "shell.foot_flange.bolts=12"],
    ],
    ids=str,
)
def test_solid_is_valid_and_has_the_volume_of_its_mesh(options: list[str]) -> None:
    """The mesh is built without the kernel: two ways to one volume."""
    fine = [*options, "structure_error_mm=0.002", "chord_error_mm=0.001"]
    mirrors = design(load_spec(None, fine))
    expected = pytest.approx(camera_a_mesh(mirrors).volume, rel=3e-4)
    for array in mirrors.arrays:
        solid = camera_solid(mirrors, array)
        assert BRepCheck_Analyzer(solid.shape).IsValid()
        assert volume(solid.shape) == expected


@pytest.mark.parametrize("rule", ["traced", "paper", "flat"])
def test_each_face_has_its_cells_area(rule: str) -> None:
    """A face that is the complement of its cell is valid too: only the area tells."""
    mirrors = design(load_spec(None, ["n=7", f"radius_rule={rule}"]))
    for array in mirrors.arrays:
        faces = camera_solid(mirrors, array).faces[: len(array)]
        assert [area(face) for _, face in faces] == pytest.approx(array.area, rel=1e-6)


def test_paper_design_areas(paper_design: MirrorDesign) -> None:
    array = paper_design.arrays[0]
    faces = camera_solid(paper_design, array).faces[: len(array)]
    assert sum(area(face) for _, face in faces) == pytest.approx(array.area.sum(), rel=1e-6)


def test_faces_are_named_after_mirrors_and_parts(small_design: MirrorDesign) -> None:
    names = [name for name, _ in camera_solid(small_design, small_design.arrays[1]).faces]
    count = len(small_design.arrays[1])
    assert names[:count] == small_design.arrays[1].ids
    assert names[0] == "b0001"
    assert {"back", "seam", "foot", "seam_flange", "foot_flange"} <= set(names[count:])
    assert sum(name.startswith("seam_hole") for name in names) == 8
    assert sum(name.startswith("foot_hole") for name in names) == 7
    assert len(set(names)) == len(names)


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
