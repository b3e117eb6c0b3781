"""STEP with product and manufacturing information: one solid as AP242, with what it may be off.

Source: ISO 10303-242; CAx-IF, Recommended Practices for the Representation and Presentation of
Product Manufacturing Information (semantic representation only, no drawn annotations); ISO 5459
(datums), ISO 1660 (profiles), ISO 1101.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Plane, GeomAbs_Sphere
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPConstruct import STEPConstruct
from OCP.TCollection import TCollection_HAsciiString
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.TopoDS import TopoDS
from OCP.XCAFDimTolObjects import (
    XCAFDimTolObjects_DatumObject,
    XCAFDimTolObjects_DimensionObject,
    XCAFDimTolObjects_DimensionType,
    XCAFDimTolObjects_GeomToleranceObject,
    XCAFDimTolObjects_GeomToleranceType,
)
from OCP.XCAFDoc import (
    XCAFDoc_Datum,
    XCAFDoc_Dimension,
    XCAFDoc_DimTolTool,
    XCAFDoc_DocumentTool,
    XCAFDoc_GeomTolerance,
    XCAFDoc_ShapeTool,
)

from tbcad.cad.formats.step import (
    StepError,
    document_writer,
    finish,
    kernel_settings,
    new_document,
    set_name,
    write_header,
)
from tbcad.cad.kernel.brep import Solid

Triple: TypeAlias = tuple[float, float, float]
_KINDS = XCAFDimTolObjects_GeomToleranceType
PROFILE = _KINDS.XCAFDimTolObjects_GeomToleranceType_ProfileOfSurface
FLATNESS = _KINDS.XCAFDimTolObjects_GeomToleranceType_Flatness
RADIUS = XCAFDimTolObjects_DimensionType.XCAFDimTolObjects_DimensionType_Size_SphericalRadius


@dataclass(frozen=True)
class FaceTolerances:
    """What some faces of a solid may be off."""

    datums: Mapping[str, str]  # name ("A" ...) and face, in the order of their precedence
    flatness: Mapping[str, float]  # of faces, mm
    profile: Mapping[str, float]  # width of the zone about faces, in the frame of datums, mm
    radius: Mapping[str, tuple[float, float]]  # of spheres, and what it may be off, mm
    notes: Mapping[str, str]  # what each is about, and its text
    # the same for each of some faces that have one zone's width in common, mm
    common_profile: Mapping[tuple[str, ...], float] = field(default_factory=dict)


@kernel_settings(schema="AP242DIS")
def write_tolerances(path: Path, solid: Solid, given: FaceTolerances) -> None:
    """Write a solid with named faces and its tolerances as AP242 in millimetres.

    StepError if the kernel fails, OSError if the file cannot be written in full.
    """
    writer = document_writer(path, _document(solid, given))
    finder = writer.ChangeWriter().WS().TransferWriter().FinderProcess()
    for name, face in solid.faces:
        STEPConstruct.FindEntity_s(finder, face).SetName(TCollection_HAsciiString(name))
    write_header(writer.ChangeWriter(), solid.name)
    finish(path, writer, lambda text: _notes(text, given.notes))


def _document(solid: Solid, given: FaceTolerances) -> TDocStd_Document:
    document = new_document()
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    part = set_name(shapes.AddShape(solid.shape, False), solid.name)
    label = {name: shapes.AddSubShape(part, face) for name, face in solid.faces}
    ordered = enumerate(given.datums.items(), 1)
    datums = [_datum(tool, name, label[face], k) for k, (name, face) in ordered]
    for face, width in given.flatness.items():
        _tolerance(tool, FLATNESS, width, [label[face]], ())
    for face, width in given.profile.items():
        _tolerance(tool, PROFILE, width, [label[face]], datums)
    for faces, width in given.common_profile.items():
        _tolerance(tool, PROFILE, width, [label[face] for face in faces], datums)
    for face, (radius, limit) in given.radius.items():
        _radius(tool, radius, limit, label[face])
    return document


def _datum(tool: XCAFDoc_DimTolTool, name: str, face: TDF_Label, place: int) -> TDF_Label:
    label = tool.AddDatum()
    tool.SetDatum(_sequence(face), label)
    datum = XCAFDimTolObjects_DatumObject()
    datum.SetName(TCollection_HAsciiString(name))
    datum.SetPosition(place)
    XCAFDoc_Datum.Set_s(label).SetObject(datum)
    return label


def _tolerance(
    tool: XCAFDoc_DimTolTool,
    kind: XCAFDimTolObjects_GeomToleranceType,
    width: float,
    faces: Sequence[TDF_Label],
    datums: Sequence[TDF_Label],
) -> None:
    label = tool.AddGeomTolerance()
    tool.SetGeomTolerance(_sequence(*faces), label)
    tolerance = XCAFDimTolObjects_GeomToleranceObject()
    tolerance.SetType(kind)
    tolerance.SetValue(width)
    XCAFDoc_GeomTolerance.Set_s(label).SetObject(tolerance)
    for datum in datums:
        tool.SetDatumToGeomTol(datum, label)


def _radius(tool: XCAFDoc_DimTolTool, radius: float, limit: float, face: TDF_Label) -> None:
    label = tool.AddDimension()
    tool.SetDimension(face, label)
    dimension = XCAFDimTolObjects_DimensionObject()
    dimension.SetType(RADIUS)
    dimension.SetValue(radius)
    dimension.SetUpperTolValue(limit)
    dimension.SetLowerTolValue(limit)
    XCAFDoc_Dimension.Set_s(label).SetObject(dimension)


def _sequence(*labels: TDF_Label) -> TDF_LabelSequence:
    sequence = TDF_LabelSequence()
    for label in labels:
        sequence.Append(label)
    return sequence


def _notes(text: str, notes: Mapping[str, str]) -> str:
    """Entities of notes on the product (CAx-IF, Recommended Practices, User Defined Attributes)."""
    number = max(map(int, re.findall(r"^#(\d+) ?=", text, re.MULTILINE))) + 1
    product = _entity(r"^(#\d+) = PRODUCT_DEFINITION\(", text)
    context = _entity(r"ADVANCED_BREP_SHAPE_REPRESENTATION\('[^']*',\([^)]*\),(#\d+)\)", text)
    lines = []
    for k, (name, note) in enumerate(notes.items()):
        item, shown, property_, general = (f"#{number + 6 * k + step}" for step in range(4))
        lines += [
            f"{item}=DESCRIPTIVE_REPRESENTATION_ITEM('{name}','{note}');",
            f"{shown}=REPRESENTATION('{name}',({item}),{context});",
            f"{property_}=PROPERTY_DEFINITION('{name}','user defined attribute',{product});",
            f"{general}=GENERAL_PROPERTY('','{name}','user defined attribute');",
            f"#{number + 6 * k + 4}=PROPERTY_DEFINITION_REPRESENTATION({property_},{shown});",
            f"#{number + 6 * k + 5}=GENERAL_PROPERTY_ASSOCIATION('','',{general},{property_});",
        ]
    return "".join(f"{line}\n" for line in lines)


def _entity(pattern: str, text: str) -> str:
    found = re.search(pattern, text, re.MULTILINE)
    if found is None:
        raise StepError("the kernel wrote no product for notes")
    return found[1]


@dataclass(frozen=True)
class ReadTolerance:
    """A tolerance or dimension as a reader of the file gets it."""

    kind: str  # "flatness", "profile" or "radius"
    value: float  # width of the zone, or what the radius may be off, mm
    centre: Triple | None  # of the sphere that its face is on, mm; None on other faces
    planes: tuple[tuple[Triple, Triple], ...] = ()  # of its faces, a point (mm) and a unit normal
    datums: tuple[str, ...] = ()  # names of the datums of its frame, in their order
    nominal: float = 0.0  # radius, mm; 0 for tolerances


def read_tolerances(path: Path) -> list[ReadTolerance]:
    """All tolerances and dimensions of a file, as the kernel reads them; StepError if it cannot."""
    document = new_document()
    reader = STEPCAFControl_Reader()
    reader.SetGDTMode(True)
    if reader.ReadFile(str(path)) != IFSelect_RetDone or not reader.Transfer(document):
        raise StepError(f"{path.name}: the kernel cannot read its own file")
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    return [*_read_zones(tool, shapes), *_read_radii(tool, shapes)]


def _read_zones(tool: XCAFDoc_DimTolTool, shapes: XCAFDoc_ShapeTool) -> Iterator[ReadTolerance]:
    names = {FLATNESS: "flatness", PROFILE: "profile"}
    labels = TDF_LabelSequence()
    tool.GetGeomToleranceLabels(labels)
    for label in _each(labels):
        zone = XCAFDoc_GeomTolerance.Set_s(label).GetObject()
        referred = TDF_LabelSequence()
        tool.GetDatumWithObjectOfTolerLabels_s(label, referred)
        datums = [XCAFDoc_Datum.Set_s(one).GetObject() for one in _each(referred)]
        ordered = sorted(datums, key=lambda one: one.GetPosition())
        frame = tuple(one.GetName().ToCString() for one in ordered)
        centre, planes = _centre_and_planes(tool, shapes, label)
        yield ReadTolerance(names[zone.GetType()], zone.GetValue(), centre, planes, frame)


def _read_radii(tool: XCAFDoc_DimTolTool, shapes: XCAFDoc_ShapeTool) -> Iterator[ReadTolerance]:
    labels = TDF_LabelSequence()
    tool.GetDimensionLabels(labels)
    for label in _each(labels):
        size = XCAFDoc_Dimension.Set_s(label).GetObject()
        centre, _ = _centre_and_planes(tool, shapes, label)
        yield ReadTolerance("radius", size.GetUpperTolValue(), centre, nominal=size.GetValue())


def _centre_and_planes(
    tool: XCAFDoc_DimTolTool, shapes: XCAFDoc_ShapeTool, label: TDF_Label
) -> tuple[Triple | None, tuple[tuple[Triple, Triple], ...]]:
    first, second = TDF_LabelSequence(), TDF_LabelSequence()
    tool.GetRefShapeLabel_s(label, first, second)
    faces = [TopoDS.Face_s(shapes.GetShape_s(one)) for one in _each(first)]
    surfaces = [BRepAdaptor_Surface(face) for face in faces]
    if len(surfaces) == 1 and surfaces[0].GetType() == GeomAbs_Sphere:
        return surfaces[0].Sphere().Location().Coord(), ()
    flat = [one.Plane() for one in surfaces if one.GetType() == GeomAbs_Plane]
    return None, tuple((one.Location().Coord(), one.Axis().Direction().Coord()) for one in flat)


def _each(labels: TDF_LabelSequence) -> Iterator[TDF_Label]:
    return (labels.Value(k) for k in range(1, labels.Length() + 1))
