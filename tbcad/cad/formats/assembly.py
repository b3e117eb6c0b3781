"""Named, coloured solids in groups as one STEP assembly, the same bytes each time."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from OCP.BRep import BRep_Builder
from OCP.STEPConstruct import STEPConstruct, STEPConstruct_Styles
from OCP.STEPControl import STEPControl_Writer
from OCP.StepRepr import StepRepr_NextAssemblyUsageOccurrence
from OCP.TCollection import TCollection_HAsciiString
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shape, TopoDS_Solid
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from tbcad.cad.formats.glb import Colour, ColouredMesh
from tbcad.cad.formats.step import (
    StepError,
    document_writer,
    finish,
    kernel_settings,
    new_document,
    set_name,
    write_header,
)
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.meshing import meshed
from tbcad.cad.kernel.solids import from_bytes, moved, solids, to_bytes
from tbcad.types import Floats

DISPLAY_MM, DISPLAY_ANGLE = 0.1, 0.25  # of meshes that are only looked at


@dataclass(frozen=True)
class ColouredSolid:
    """One solid."""

    name: str  # unique in the assembly
    shape: TopoDS_Solid  # in its place, the base at angle zero
    colour: Colour  # red, green, blue (sRGB) and opacity, from 0 to 1
    mesh: Mesh | None = None  # of the shape; None where none is known

    def __getstate__(self) -> dict[str, Any]:
        """The kernel's shape as bytes: a key of what is kept is made of them."""
        return {**self.__dict__, "shape": to_bytes(self.shape)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Read the shape again."""
        self.__dict__.update(state, shape=from_bytes(state["shape"]))

    def copy(self, name: str, axes: Floats, origin: Floats) -> "ColouredSolid":
        """One like it under another name, moved: axes are what x, y and z become, as rows."""
        mesh = self.mesh and Mesh(self.mesh.vertices @ axes + origin, self.mesh.triangles)
        return ColouredSolid(name, solids(moved(self.shape, axes, origin))[0], self.colour, mesh)


@dataclass(frozen=True)
class SolidGroup:
    """Bodies that belong together."""

    name: str
    bodies: tuple[ColouredSolid, ...]


def coloured_meshes(groups: Iterable[SolidGroup]) -> list[ColouredMesh]:
    """What is seen of groups of solids, without shapes of the kernel."""
    return [
        ColouredMesh(one.name, group.name, one.mesh or display_mesh(one.shape), one.colour)
        for group in groups
        for one in group.bodies
    ]


def display_mesh(shape: TopoDS_Solid) -> Mesh:
    """A coarse mesh, to be looked at."""
    return meshed(shape, DISPLAY_MM, DISPLAY_ANGLE)


@kernel_settings()
def write_assembly(path: Path, name: str, groups: Sequence[SolidGroup]) -> None:
    """Write groups of bodies as one AP214 assembly in millimetres, all solids in their places.

    The kernel writes colours in the order of addresses in memory, so they are written here.
    StepError if the kernel fails, OSError if the file cannot be written in full.
    """
    writer = document_writer(path, _document(name, groups))
    step_writer = writer.ChangeWriter()
    _number_occurrences(step_writer)
    write_header(step_writer, name)
    colours = _colours(step_writer, [body for group in groups for body in group.bodies])
    finish(path, writer, lambda _: colours)


def _document(name: str, groups: Sequence[SolidGroup]) -> TDocStd_Document:
    """The tree of named solids as cadquery's `Assembly` has it, which takes longer to load."""
    document = new_document()
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    tool.SetAutoNaming_s(False)
    top = set_name(tool.NewShape(), name)
    for group in groups:
        branch = set_name(tool.NewShape(), group.name)
        for body in group.bodies:
            part = set_name(tool.NewShape(), body.name)
            tool.SetShape(part, _compound(body.shape))
            set_name(tool.AddComponent(branch, part, TopLoc_Location()), body.name)
        tool.AddComponent(top, branch, TopLoc_Location())
    tool.UpdateAssemblies()
    return document


def _compound(shape: TopoDS_Shape) -> TopoDS_Compound:
    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    builder.Add(compound, shape)
    return compound


def _number_occurrences(writer: STEPControl_Writer) -> None:
    """Number and name the occurrences; the kernel counts on from file to file."""
    model, count = writer.Model(), 0
    for k in range(1, model.NbEntities() + 1):
        entity = model.Value(k)
        if isinstance(entity, StepRepr_NextAssemblyUsageOccurrence):
            count += 1
            entity.SetId(TCollection_HAsciiString(str(count)))
            entity.SetName(entity.RelatedProductDefinition().Formation().OfProduct().Name())


def _colours(writer: STEPControl_Writer, bodies: Sequence[ColouredSolid]) -> str:
    """Styled items of all bodies (CAx-IF, Recommended Practices for Model Styling, section 4)."""
    styles, model = STEPConstruct_Styles(writer.WS()), writer.Model()
    # The binding's model.Number finds nothing; the same entity is the same object here, though.
    entities = [model.Value(k) for k in range(1, model.NbEntities() + 1)]
    place = {id(entity): k for k, entity in enumerate(entities, 1)}
    number = len(entities) + 1
    lines, items = [], []
    for body in bodies:
        entity = STEPConstruct.FindEntity_s(styles.FinderProcess(), body.shape)
        if id(entity) not in place:
            raise StepError(f"the kernel lost {body.name}")
        style = list(_style(number, place[id(entity)], body.colour))
        items.append(f"#{number}")
        number += len(style)
        lines += style
    context = place[id(styles.FindContext(bodies[0].shape))]
    drawn, listed = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION", ",\n".join(items)
    lines.append(f"#{number}={drawn}('',\n({listed}),#{context});")
    return "".join(f"{line}\n" for line in lines)


def _style(first: int, item: int, colour: Colour) -> Iterator[str]:
    """Entities from number first on that give an item its colour, the first the styled item."""
    *mixed, opaque = (f"{value:.6f}" for value in colour)
    yield f"#{first}=STYLED_ITEM('color',(#{first + 1}),#{item});"
    yield f"#{first + 1}=PRESENTATION_STYLE_ASSIGNMENT((#{first + 2}));"
    yield f"#{first + 2}=SURFACE_STYLE_USAGE(.BOTH.,#{first + 3});"
    clear = float(opaque) < 1
    rendered = f",#{first + 8}" if clear else ""
    yield f"#{first + 3}=SURFACE_SIDE_STYLE('',(#{first + 4}{rendered}));"
    yield f"#{first + 4}=SURFACE_STYLE_FILL_AREA(#{first + 5});"
    yield f"#{first + 5}=FILL_AREA_STYLE('',(#{first + 6}));"
    yield f"#{first + 6}=FILL_AREA_STYLE_COLOUR('',#{first + 7});"
    yield f"#{first + 7}=COLOUR_RGB('',{','.join(mixed)});"
    if clear:
        properties = f"(#{first + 9})"
        yield (
            f"#{first + 8}=SURFACE_STYLE_RENDERING_WITH_PROPERTIES(.NORMAL_SHADING.,"
            f"#{first + 7},{properties});"
        )
        yield f"#{first + 9}=SURFACE_STYLE_TRANSPARENT({1 - float(opaque):.6f});"
