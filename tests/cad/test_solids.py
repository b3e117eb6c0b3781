"""Bodies and their booleans: closed forms, and what is refused."""

import math
import re
import sys
from pathlib import Path

import cadquery
import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.TopoDS import TopoDS_Shape, TopoDS_Shell, TopoDS_Solid

import tbcad
from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.cad.kernel.checks import volume
from tbcad.cad.kernel.solids import (
    common,
    cut,
    cylinder,
    faces,
    from_bytes,
    fused,
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
from tbcad.core.geometry.primitives import rectangle

BASE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
ORIGIN, UP, AWAY = np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([20.0, 0.0, 0.0])
HOW_TO = Path(__file__).parents[2] / "docs" / "how-to.md"


def box(width: float, height: float) -> TopoDS_Shape:
    """On the plane z = 0, about the z axis."""
    low = np.full(2, -width / 2)
    base = np.column_stack([rectangle(low, -low), np.zeros(4)])
    return prism(polygon(base), height * UP)


def test_volumes_of_bodies() -> None:
    assert volume(box(2.0, 3.0)) == pytest.approx(12)
    assert volume(pyramid(6 * UP, BASE)) == pytest.approx(8)
    ring = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])
    assert volume(revolved_polygon(ring, 0.3, np.pi)) == pytest.approx(1.5 * np.pi)


def test_facets_in_any_order_and_sense_close_a_solid() -> None:
    corners = np.array([[x, y, z] for x in (0.0, 2.0) for y in (0.0, 3.0) for z in (0.0, 4.0)])
    facets = [corners[k] for k in ([0, 1, 3, 2], [4, 5, 7, 6], [0, 4, 5, 1])]
    facets += [corners[k] for k in ([2, 6, 7, 3], [4, 6, 2, 0], [1, 5, 7, 3])]
    for sides in (facets, [facet[::-1] for facet in facets[::-1]]):
        assert volume(polyhedron(sides)) == pytest.approx(24)


def test_sets_of_two_bodies() -> None:
    one, other = cylinder(ORIGIN, UP, 2.0, 5.0), cylinder(ORIGIN, UP, 1.0, 9.0)
    assert volume(fused([one, other])) == pytest.approx(24 * np.pi)
    assert volume(cut(one, [other])) == pytest.approx(15 * np.pi)
    assert volume(common(one, other)) == pytest.approx(5 * np.pi)


def test_bytes_of_a_solid_give_it_again() -> None:
    ball = one_solid("ball", cut(sphere(ORIGIN, 3.0), [sphere(3 * UP, 1.0)]))
    again = from_bytes(to_bytes(ball))
    assert to_bytes(again) == to_bytes(ball)
    assert volume(again) == volume(ball)


def test_several_solids_are_refused() -> None:
    two = fused([sphere(ORIGIN, 1.0), sphere(AWAY, 1.0)])
    with pytest.raises(InvalidSolidError, match=r"^part: 2 solids where one should be$"):
        one_solid("part", two)


def test_a_solid_with_an_open_shell_is_refused() -> None:
    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    for face in faces(box(2.0, 3.0))[:-1]:
        builder.Add(shell, face)
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    with pytest.raises(InvalidSolidError, match="the kernel's check finds the solid invalid"):
        one_solid("part", solid)


def test_cavities_are_filled() -> None:
    hollow = one_solid("hollow", cut(sphere(ORIGIN, 3.0), [sphere(ORIGIN, 1.0)]))
    assert volume(hollow) == pytest.approx(4 / 3 * np.pi * 26)
    assert volume(without_cavities(hollow)) == pytest.approx(4 / 3 * np.pi * 27)


@pytest.fixture(scope="module")
def design() -> tbcad.Design:
    return tbcad.design(n=3)


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
