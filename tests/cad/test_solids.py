"""Bodies and their booleans: closed forms, and what is refused."""

import math
import re
import sys
from pathlib import Path

import cadquery
import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.Geom import Geom_Circle
from OCP.GeomAbs import GeomAbs_Circle
from OCP.ShapeFix import ShapeFix_ShapeTolerance
from OCP.TopoDS import TopoDS_Shape, TopoDS_Shell, TopoDS_Solid

import tbcad
from tbcad.cad.kernel.brep import InvalidSolidError, Solid
from tbcad.cad.kernel.checks import (
    face_integrals,
    plane_faces,
    properties,
    properties_within,
    volume,
    without_slack,
)
from tbcad.cad.kernel.meshing import (
    as_manifold,
    mesh_difference,
    meshed,
    primitive_mesh,
)
from tbcad.cad.kernel.solids import (
    common,
    cut,
    cylinder,
    edges,
    faces,
    from_bytes,
    fused,
    moved,
    one_solid,
    polygon,
    polyhedron,
    prism,
    pyramid,
    revolved_polygon,
    sphere,
    to_bytes,
    without_cavities,
)
from tbcad.core.geometry.primitives import (
    Cylinder,
    Primitive,
    Prism,
    Revolved,
    rectangle,
    revolved_along,
)
from tbcad.core.geometry.primitives import (
    volume as closed_volume,
)
from tbcad.core.geometry.vectors import norm, unit
from tests.step_read_back import check_read_back

BASE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
ORIGIN, UP, AWAY = np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([20.0, 0.0, 0.0])
HOW_TO = Path(__file__).parents[2] / "docs" / "how-to.md"
START, TILTED = np.array([1.0, -2.0, 3.0]), unit(np.array([0.3, -0.5, 0.8]))
TRIANGLE = np.array([[0.0, 0, 0], [4, 0, 0], [0, 3, 0]])
PRIMITIVES = {
    "rod": Cylinder(START, TILTED, 2.0, 7.0),
    "ring": Revolved(rectangle((1.0, 3.0), (5.0, 4.0))),
    "cone, tilted": revolved_along(np.array([[0.0, 0], [6, 0], [0, 2]]), START, TILTED),
    "prism": Prism(TRIANGLE, np.array([0.0, 0, 5])),
    "prism, downward": Prism(TRIANGLE, np.array([0.0, 0, -5])),
    "prism, oblique": Prism(TRIANGLE + START, np.array([1.0, 2.0, 5.0])),
}
SLACK_MM = 1e-3
PLACE = np.array([1.0, 2.0, 3.0])


def box(width: float, height: float) -> TopoDS_Shape:
    """On the plane z = 0, about the z axis."""
    low = np.full(2, -width / 2)
    base = np.column_stack([rectangle(low, -low), np.zeros(4)])
    return prism(polygon(base), height * UP)


def test_volumes_of_bodies_and_their_sets() -> None:
    assert volume(box(2.0, 3.0)) == pytest.approx(12)
    assert volume(pyramid(6 * UP, BASE)) == pytest.approx(8)
    ring = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])
    assert volume(revolved_polygon(ring, 0.3, np.pi)) == pytest.approx(1.5 * np.pi)
    one, other = cylinder(ORIGIN, UP, 2.0, 5.0), cylinder(ORIGIN, UP, 1.0, 9.0)
    assert volume(fused([one, other])) == pytest.approx(24 * np.pi)
    assert volume(cut(one, [other])) == pytest.approx(15 * np.pi)
    assert volume(common(one, other)) == pytest.approx(5 * np.pi)


def test_facets_in_any_order_and_sense_close_a_solid() -> None:
    corners = np.array([[x, y, z] for x in (0.0, 2.0) for y in (0.0, 3.0) for z in (0.0, 4.0)])
    facets = [corners[k] for k in ([0, 1, 3, 2], [4, 5, 7, 6], [0, 4, 5, 1])]
    facets += [corners[k] for k in ([2, 6, 7, 3], [4, 6, 2, 0], [1, 5, 7, 3])]
    for sides in (facets, [facet[::-1] for facet in facets[::-1]]):
        assert volume(polyhedron(sides)) == pytest.approx(24)


def test_bytes_of_a_solid_give_it_again() -> None:
    ball = one_solid("ball", cut(sphere(ORIGIN, 3.0), [sphere(3 * UP, 1.0)]))
    again = from_bytes(to_bytes(ball))
    assert to_bytes(again) == to_bytes(ball)
    assert volume(again) == volume(ball)


def test_several_solids_are_refused() -> None:
    two = fused([sphere(ORIGIN, 1.0), sphere(AWAY, 1.0)])
    with pytest.raises(InvalidSolidError, match=r"^part: 2 solids where one should be$"):
        one_solid("part", two)


def open_solid() -> TopoDS_Solid:
    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    for face in faces(box(2.0, 3.0))[:-1]:
        builder.Add(shell, face)
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    return solid


def test_a_solid_with_an_open_shell_is_refused() -> None:
    with pytest.raises(InvalidSolidError, match="the kernel's check finds the solid invalid"):
        one_solid("part", open_solid())


def test_cavities_are_filled() -> None:
    hollow = one_solid("hollow", cut(sphere(ORIGIN, 3.0), [sphere(ORIGIN, 1.0)]))
    assert volume(hollow) == pytest.approx(4 / 3 * np.pi * 26)
    assert volume(without_cavities(hollow)) == pytest.approx(4 / 3 * np.pi * 27)


@pytest.fixture(scope="module")
def design() -> tbcad.Design:
    return tbcad.design(n=3)


def test_a_shell_that_the_kernel_refuses_is_no_part(
    design: tbcad.Design, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what a build writes its verification asks; of this nobody else does."""
    for name, get in (("camera", design.shell), ("mandrel", design.mandrel)):
        refused = Solid("part", open_solid(), ())
        monkeypatch.setattr(f"tbcad.shell.files.{name}_solid", lambda *_, solid=refused: solid)
        with pytest.raises(InvalidSolidError, match="part: the kernel's check"):
            get("a")


def test_a_shell_in_cadquery_is_the_same_solid(design: tbcad.Design) -> None:
    part = design.shell("a")
    workplane = tbcad.to_cadquery(part)
    assert workplane.solids().size() == 1
    assert workplane.val().Volume() == part.volume
    assert workplane.val().isValid()
    assert workplane._getTagged("shell_a") is workplane


def test_the_example_puts_the_shell_on_feet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = HOW_TO.read_text(encoding="utf-8")
    example = re.search(r"<!-- test: cadquery -->\n```python\n(.*?)```", text, re.DOTALL)
    assert example is not None
    monkeypatch.chdir(tmp_path)
    names: dict[str, cadquery.Workplane] = {}
    exec(example[1], names)
    read = cadquery.importers.importStep(str(tmp_path / "shell_on_feet.step"))
    assert read.solids().size() == 1
    feet = 4 * math.pi * 8**2 * 20
    volume = names["shell"].val().Volume()  # type: ignore[union-attr]
    assert read.val().Volume() == pytest.approx(volume + feet, rel=1e-6)  # type: ignore[union-attr]


def test_without_cadquery_says_how_to_install_it(
    design: tbcad.Design, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cadquery", None)
    with pytest.raises(tbcad.InputError, match=r"pip install 'tbcad\[cadquery\]'"):
        tbcad.to_cadquery(design.shell("a"))


@pytest.mark.parametrize("body", PRIMITIVES.values(), ids=PRIMITIVES)
def test_volumes_are_those_of_closed_forms(body: Primitive) -> None:
    assert primitive_mesh(body).volume() == pytest.approx(
        closed_volume(body), rel=1e-8
    )  # sections are rounded to 1e-8 mm


@pytest.fixture(scope="module")
def pin() -> TopoDS_Shape:
    return cylinder(ORIGIN, UP, 3.0, 10.0)


@pytest.mark.parametrize("tolerance", [0.1, 0.01])
def test_facets_are_as_near_to_a_sphere_as_asked(tolerance: float) -> None:
    mesh = meshed(sphere(ORIGIN, 5.0), tolerance)
    assert norm(mesh.vertices) == pytest.approx(5.0, abs=1e-6)
    middle = mesh.vertices[mesh.triangles].mean(axis=1)
    assert 5.0 - norm(middle).min() <= tolerance


def test_volume_of_a_union_less_tools_agrees_with_the_kernel(pin: TopoDS_Shape) -> None:
    bodies, tools = [pin, sphere(10 * UP, 5.0)], [cylinder(-UP, UP, 1.0, 20.0)]
    by_meshes = mesh_difference(
        *([as_manifold(one, 0.002) for one in some] for some in (bodies, tools))
    )
    assert by_meshes.volume() == pytest.approx(volume(cut(fused(bodies), tools)), rel=2e-3)


def rod_with_gap(gap: float) -> TopoDS_Solid:
    """A rod whose round edges are off its faces, mm, and whose tolerances are SLACK_MM."""
    rod = one_solid("rod", cylinder(ORIGIN, UP, 5.0, 20.0))
    for edge in edges(rod):
        curve = BRepAdaptor_Curve(edge)
        if curve.GetType() == GeomAbs_Circle:
            circle = curve.Circle()
            circle.SetRadius(circle.Radius() + gap)
            BRep_Builder().UpdateEdge(edge, Geom_Circle(circle), SLACK_MM)
    ShapeFix_ShapeTolerance().SetTolerance(rod, SLACK_MM)
    assert BRepCheck_Analyzer(rod).IsValid()
    return rod


@pytest.mark.parametrize("gap", [0.0, 5e-6])
def test_what_meets_stays_valid(gap: float) -> None:
    rod = one_solid("rod", without_slack(rod_with_gap(gap)))
    check_read_back("rod", rod, properties(rod))


@pytest.mark.parametrize("gap", [2e-5, 5e-4])
def test_gaps_are_found_as_a_reader_of_the_file_finds_them(gap: float) -> None:
    rod = rod_with_gap(gap)
    with pytest.raises(InvalidSolidError, match=r"rod: its edges are up to .* mm off its faces"):
        check_read_back("rod", rod, properties(rod))
    with pytest.raises(InvalidSolidError, match="rod: the kernel's check finds the solid invalid"):
        one_solid("rod", without_slack(rod))


def test_a_cylinder_also_turned_and_by_its_faces_about_any_origin() -> None:
    solid, axes = cylinder(PLACE, UP, 2.0, 5.0), np.roll(np.eye(3), 1, axis=1)
    found = {"as it is": properties(solid)}
    found["turned"] = properties(solid).rotated(axes)
    found["by the kernel"] = properties(moved(solid, axes, np.zeros(3)))
    for origin in (ORIGIN, np.array([10.0, -4.0, 2.0])):
        side, *ends = (face_integrals(face, origin) for face in faces(solid))
        found[f"about {origin}"] = properties_within(side + ends[0] + ends[1])
    for name, one in found.items():
        turned = name in {"turned", "by the kernel"}
        assert one.volume == pytest.approx(20 * np.pi, rel=1e-9), name
        assert one.area == pytest.approx(28 * np.pi, rel=1e-9), name
        place = (5.5, 1.0, 2.0) if turned else (1.0, 2.0, 5.5)
        assert one.centroid == pytest.approx(place, abs=1e-8), name


def test_plane_faces_through_points() -> None:
    base = np.column_stack([rectangle([0.0, 0.0], [4.0, 2.0]), np.zeros(4)])
    box = prism(polygon(base), 3.0 * UP)
    points = np.array([[9.0, 9.0, 3.01], [4.2, 1.0, 1.0]])
    centre, area = plane_faces(box, points, 0.1)
    assert centre == pytest.approx(np.array([[2.0, 1.0, 3.0]]))
    assert area == pytest.approx([8.0])
    assert len(plane_faces(box, points, 0.3)[1]) == 2
    assert not len(plane_faces(box, points[:0], 0.3)[1])
