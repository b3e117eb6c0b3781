"""Solids of components: added primitives fused, removed ones cut out."""

from collections.abc import Sequence

import numpy as np
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.checks import check_volume, closed_mesh
from tbcad.cad.measures import properties, volume
from tbcad.cad.meshing import volume_by_meshes
from tbcad.cad.primitive_meshes import primitive_mesh
from tbcad.cad.solids import (
    cut,
    cylinder,
    fused,
    moved,
    one_solid,
    polygon,
    prism,
    revolved_polygon,
    slot_face,
)
from tbcad.geometry.primitives import Component, Cylinder, Primitive, Prism, Revolved, Slot
from tbcad.prototype.printing.placing import PlacedSolid, placed_on_bed
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Floats

VOLUME_ERROR = 1e-4


def primitive_solid(body: Primitive) -> TopoDS_Shape:
    """The solid of a primitive."""
    if isinstance(body, Cylinder):
        return cylinder(body.start, body.axis, body.radius, body.length)
    if isinstance(body, Revolved):
        return moved(revolved_polygon(body.profile, 0.0, 2 * np.pi), body.axes, body.start)
    if isinstance(body, Slot):
        return prism(slot_face(body.middle, body.step, body.radius, body.along), body.along)
    return prism(polygon(_outward(body)), body.along)


def component_solid(component: Component) -> TopoDS_Solid:
    """The one solid of a component, in the frame of the shell.

    Raises:
        InvalidSolidError: when the kernel fails, or its volume is not what meshes give.
    """
    if len(component.added) == 1 and not component.removed:  # no boolean that could go wrong
        return one_solid(component.name, primitive_solid(component.added[0]))
    added = [primitive_solid(body) for body in component.added]
    removed = [primitive_solid(body) for body in component.removed]
    solid = one_solid(component.name, cut(fused(added), removed))
    meshes = (
        [primitive_mesh(body) for body in bodies] for bodies in (component.added, component.removed)
    )
    expected = volume_by_meshes(*meshes)
    check_volume(component.name, volume(solid), expected, VOLUME_ERROR)
    return solid


def placed_component(component: Component, printer: PrinterSpec, mesh_mm: float) -> PlacedSolid:
    """A component placed on the printer's bed, its mesh within a distance of the surface.

    Raises:
        SpecError: when it does not fit.
        InvalidSolidError: when the kernel fails.
    """
    solid, name = component_solid(component), component.name
    mesh, downs = closed_mesh(name, solid, mesh_mm), component.downs
    return placed_on_bed(name, solid, mesh, properties(solid), downs, np.eye(3), printer)


def placed_components(
    components: Sequence[Component], printer: PrinterSpec, mesh_mm: float
) -> list[PlacedSolid]:
    """Several components, each as `placed_component` places it."""
    return [placed_component(component, printer, mesh_mm) for component in components]


def _outward(body: Prism) -> Floats:
    """The corners in the order that turns the prism's faces outward."""
    a, b = body.corners[1] - body.corners[0], body.corners[2] - body.corners[0]
    return body.corners if np.cross(a, b) @ body.along > 0 else body.corners[::-1]
