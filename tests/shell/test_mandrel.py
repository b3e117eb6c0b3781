"""Negatives of shells: mesh, solid and closed forms agree; how a shell comes off."""

import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane, GeomAbs_Sphere

from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.errors import SpecError
from tbcad.shell.files import mandrel_solid
from tbcad.shell.halves import design_mandrel
from tbcad.shell.mandrel import best_pull, distances, draft_of
from tests.helpers import bounds
from tests.shell.test_bodies import made

EDGES = ["valley", "pedestal"]


@pytest.mark.parametrize("edges", EDGES)
def test_faces_are_named_and_lie_in_the_joining_planes(edges: str) -> None:
    mirrors = made(edges, "n=3")
    for array, side in zip(mirrors.arrays, (1, -1), strict=True):
        solid = mandrel_solid(mirrors, array)
        names = [name for name, _ in solid.faces]
        assert solid.name == f"mandrel_{array.camera_id}"
        assert names[: len(array)] == array.ids
        assert len(set(names)) == len(names)
        kinds = {name: BRepAdaptor_Surface(face).GetType() for name, face in solid.faces}
        assert all(kinds[name] == GeomAbs_Sphere for name in array.ids)
        holes = [name for name in names if "_hole_" in name]
        assert len(holes) == 8 + 7
        assert all(kinds[name] == GeomAbs_Cylinder for name in holes)
        assert all(kinds[name.replace("hole", "bottom")] == GeomAbs_Plane for name in holes)
        low, high = bounds(solid.shape)
        assert (low, -high)[side < 0][0] == pytest.approx(0, abs=1e-6)
        assert low[2] == pytest.approx(array.foot, abs=1e-6)


@pytest.mark.parametrize("n", [4, 6])
def test_holes_leave_a_wall_and_lie_near_it(n: int) -> None:
    """Points in the bottoms' rims, by their distances from any mirror, one by one."""
    mirrors = made("valley", f"n={n}", "shell.wall_mm=4.5")
    mandrel, surfaces = design_mandrel(mirrors), mirrors.arrays[0].modelled_cells.mirror_surfaces
    angle = np.linspace(0, 2 * np.pi, 50)
    least = np.inf
    for holes, axes in ((mandrel.seam_holes, [1, 2]), (mandrel.foot_holes, [0, 1])):
        for centre, radius in zip(holes.centre, holes.radius, strict=True):
            for depth in (0, 1):
                rim = np.tile(centre + depth * holes.direction, (len(angle), 1))
                rim[:, axes] += radius * np.column_stack([np.cos(angle), np.sin(angle)])
                away = np.linalg.norm(rim[:, None] - surfaces.centre, axis=2) - surfaces.radius
                least = min(least, float(away.min()))
    assert 4.5 <= least < 4.5 + 2


def test_distances_are_those_of_spheres_and_planes() -> None:
    mirrors = made("valley", "n=2").arrays[0].mirrors
    points = np.array([[10.0, 5, 3], [40, -20, 8]])
    expected = np.linalg.norm(points[:, None] - mirrors.centre, axis=2) - mirrors.radius
    assert distances(mirrors, points) == pytest.approx(expected.min(axis=1), rel=1e-12)
    flat = made("valley", "n=2", "radius_rule=flat").arrays[0].mirrors
    heights = ((points[:, None] - flat.apex) * flat.normal).sum(axis=2)
    assert distances(flat, points) == pytest.approx(heights.min(axis=1), rel=1e-12)


class TestPull:
    def test_of_a_corner_is_its_diagonal_and_of_a_cone_its_axis(self) -> None:
        assert best_pull(np.eye(3)) == pytest.approx(np.full(3, 3**-0.5), abs=1e-12)
        angle = np.linspace(0, 2 * np.pi, 40)
        normals = np.column_stack([np.cos(angle), np.sin(angle), np.full(40, 0.2)])
        assert best_pull(unit(normals)) == pytest.approx([0, 0, 1], abs=1e-9)

    def test_nothing_draws_better(self) -> None:
        """By brute force over directions about it."""
        cells = made("valley", "n=6").arrays[0].modelled_cells
        draft = draft_of(cells)
        rng = np.random.default_rng(3)
        arc = np.repeat(np.arange(len(cells.arcs)), 20)
        points = cells.arcs.at(arc, np.tile(np.linspace(0, 1, 20), len(cells.arcs)))
        normals = []
        for side in cells.arcs.faces.T:
            face = side[arc]
            mine = face < cells.mirrors
            centre = cells.surfaces.centre[face[mine]]
            outward = centre - points[mine]  # of the negative: concave
            normals.append(unit(outward))
        every = np.concatenate(normals)
        best = np.degrees(np.arcsin((every @ draft.pull).min()))
        assert best == pytest.approx(np.degrees(draft.angle), abs=0.02)
        assert best > 16
        assert draft.pull[1] == 0
        for step in (0.01, 0.1, 0.5):
            tried = unit(draft.pull + step * rng.standard_normal((200, 3)))
            assert np.degrees(np.arcsin((every @ tried.T).min(axis=0))).max() < best + 1e-3


def test_the_papers_shell_can_be_drawn(paper_design: MirrorDesign) -> None:
    draft = draft_of(paper_design.arrays[0].modelled_cells)
    assert np.degrees(draft.angle) == pytest.approx(11.97, abs=0.05)


@pytest.mark.parametrize("n", [4, 6])
def test_walls_of_pedestals_catch(n: int) -> None:
    mirrors = made("pedestal", f"n={n}")
    cells = mirrors.arrays[0].modelled_cells
    draft = draft_of(cells)
    walls = -cells.surfaces.normal[cells.mirrors + 2 :]
    assert np.arcsin((walls @ draft.pull).min()) == pytest.approx(draft.angle)
    assert draft.angle < np.radians(-20)


@pytest.mark.parametrize(
    "options",
    [
        ("shell.wall_mm=50",),
        ("shell.foot_flange.width_mm=60", "shell.foot_flange.bolt_hole_mm=30"),
    ],
)
def test_holes_without_room_are_refused(options: tuple[str, ...]) -> None:
    with pytest.raises(SpecError, match=r"no room for blind holes .* make bolt_hole_mm") as error:
        design_mandrel(made("valley", "n=4", *options))
    assert "\n" not in str(error.value)


def test_holes_do_not_meet() -> None:
    mandrel = design_mandrel(made("valley", "n=4"))
    seam, foot = mandrel.seam_holes, mandrel.foot_holes
    assert foot.centre[:, 0].min() - foot.radius.max() >= seam.direction[0] + 3 - 1e-9
    assert seam.centre[:, 2].min() - seam.radius.max() >= mandrel.foot + 3 - 1e-9
    assert np.array_equal(seam.direction, [8.6, 0, 0])
