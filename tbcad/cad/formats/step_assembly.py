"""prototype.step: all parts in one tree of named, coloured solids; the same bytes each time."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from OCP.BRep import BRep_Builder
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPConstruct import STEPConstruct, STEPConstruct_Styles
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
from OCP.StepRepr import StepRepr_NextAssemblyUsageOccurrence
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shape
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool
from OCP.XSControl import XSControl_WorkSession

from tbcad.cad.formats.step import END as STEP_END
from tbcad.cad.formats.step import (
    StepError,
    check_complete,
    incomplete,
    kernel_settings,
    write_header,
)
from tbcad.cad.kernel.assembly import Colour, ColouredSolid, SolidGroup

END = "ENDSEC;\nEND-ISO-10303-21;"


@kernel_settings()
def write_assembly(path: Path, name: str, groups: Sequence[SolidGroup]) -> None:
    """Write groups of bodies as one AP214 assembly in millimetres, all solids in their places.

    The kernel writes colours in the order of addresses in memory, so they are written here.
    StepError if the kernel fails, OSError if the file cannot be written in full.
    """
    document = _document(name, groups)
    writer = STEPCAFControl_Writer(XSControl_WorkSession(), False)
    writer.SetColorMode(False)
    writer.SetNameMode(True)
    if not writer.Transfer(document, STEPControl_AsIs):
        raise StepError(f"{path.name}: the kernel cannot translate the assembly")
    step_writer = writer.ChangeWriter()
    _number_occurrences(step_writer)
    write_header(step_writer, name)
    colours = _colours(step_writer, [body for group in groups for body in group.bodies])
    if writer.Write(str(path)) != IFSelect_RetDone:
        raise incomplete(path)
    check_complete(path, STEP_END)
    text, end, rest = path.read_text(encoding="ascii").rpartition(END)
    path.write_text(text + colours + end + rest, encoding="ascii")


def _document(name: str, groups: Sequence[SolidGroup]) -> TDocStd_Document:
    """The tree of named solids as the kernel's document.

    As cadquery's `Assembly` has it; cadquery takes longer to load than the tree to be made.
    """
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    tool.SetAutoNaming_s(False)
    top = _named(tool.NewShape(), name)
    for group in groups:
        branch = _named(tool.NewShape(), group.name)
        for body in group.bodies:
            part = _named(tool.NewShape(), body.name)
            tool.SetShape(part, _compound(body.shape))
            _named(tool.AddComponent(branch, part, TopLoc_Location()), body.name)
        tool.AddComponent(top, branch, TopLoc_Location())
    tool.UpdateAssemblies()
    return document


def _named(label: TDF_Label, name: str) -> TDF_Label:
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    return label


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
    """Text of the styled items of all bodies.

    Source: CAx-IF, Recommended Practices for Model Styling and Organization, section 4.
    """
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
