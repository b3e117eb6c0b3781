"""STEP with product and manufacturing information: one solid as AP242, with what it may be off.

Source: ISO 10303-242; CAx-IF, Recommended Practices for the Representation and Presentation of
Product Manufacturing Information (semantic representation only, no drawn annotations); ISO 5459
(datums), ISO 1660 (profiles), ISO 1101.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPConstruct import STEPConstruct
from OCP.TCollection import TCollection_HAsciiString
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
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
    ANY_RESULT,
    StepError,
    document_writer,
    finish,
    kernel_settings,
    new_document,
    set_name,
    write_header,
)
from tbcad.cad.kernel.brep import Solid

_KINDS = XCAFDimTolObjects_GeomToleranceType
ZONES = {
    "flatness": _KINDS.XCAFDimTolObjects_GeomToleranceType_Flatness,
    "profile": _KINDS.XCAFDimTolObjects_GeomToleranceType_ProfileOfSurface,
}
RADIUS = XCAFDimTolObjects_DimensionType.XCAFDimTolObjects_DimensionType_Size_SphericalRadius
SAME = 1e-9  # mm: numbers in a file have 15 digits


@dataclass(frozen=True)
class FaceTolerance:
    """What a face may be off, or each of some faces."""

    kind: str  # "flatness", "profile" (of a surface, in the frame of all datums) or "radius"
    faces: tuple[str, ...]  # by name
    value: float  # width of the zone, or what the radius of a sphere may be off, mm
    radius: float = 0.0  # of the sphere, mm; 0 for zones


@dataclass(frozen=True)
class FaceTolerances:
    """What some faces of a solid may be off."""

    datums: Mapping[str, str]  # name ("A" ...) and face, in the order of their precedence
    each: tuple[FaceTolerance, ...]  # zones, then radii
    notes: Mapping[str, str]  # what each is about, and its text


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
    for one in given.each:
        faces = [label[face] for face in one.faces]
        if one.kind == "radius":
            _radius(tool, one, *faces)
        else:
            _zone(tool, one, faces, datums if one.kind == "profile" else ())
    return document


def _datum(tool: XCAFDoc_DimTolTool, name: str, face: TDF_Label, place: int) -> TDF_Label:
    label = tool.AddDatum()
    tool.SetDatum(_sequence(face), label)
    datum = XCAFDimTolObjects_DatumObject()
    datum.SetName(TCollection_HAsciiString(name))
    datum.SetPosition(place)
    XCAFDoc_Datum.Set_s(label).SetObject(datum)
    return label


def _zone(
    tool: XCAFDoc_DimTolTool,
    given: FaceTolerance,
    faces: Sequence[TDF_Label],
    datums: Sequence[TDF_Label],
) -> None:
    label = tool.AddGeomTolerance()
    tool.SetGeomTolerance(_sequence(*faces), label)
    tolerance = XCAFDimTolObjects_GeomToleranceObject()
    tolerance.SetType(ZONES[given.kind])
    tolerance.SetValue(given.value)
    XCAFDoc_GeomTolerance.Set_s(label).SetObject(tolerance)
    for datum in datums:
        tool.SetDatumToGeomTol(datum, label)


def _radius(tool: XCAFDoc_DimTolTool, given: FaceTolerance, face: TDF_Label) -> None:
    label = tool.AddDimension()
    tool.SetDimension(face, label)
    dimension = XCAFDimTolObjects_DimensionObject()
    dimension.SetType(RADIUS)
    dimension.SetValue(given.radius)
    dimension.SetUpperTolValue(given.value)
    dimension.SetLowerTolValue(given.value)
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


Framed: TypeAlias = tuple[FaceTolerance, tuple[str, ...]]
"""A tolerance, and the names of the datums of its frame in their order."""
FacesOf: TypeAlias = Callable[[TDF_Label], tuple[str, ...]]


def check_read_back(path: Path, given: FaceTolerances) -> None:
    """Compare all zones and radii in a file, and the frames of zones, with what they should be.

    StepError if one is missing, doubled, or not as given: a fault of tbcad.
    """
    frame, read = tuple(given.datums), read_tolerances(path)
    meant = {_key(one): one for one in given.each}
    if sorted(map(_key, meant.values())) != sorted(_key(one) for one, _ in read):
        raise StepError(f"{path.name}: {len(read)} tolerances are not those {len(meant)} given")
    for one, datums in read:
        wanted = meant[_key(one)]
        off = max(abs(one.value - wanted.value), abs(one.radius - wanted.radius))
        if off > SAME or datums != (frame if one.kind == "profile" else ()):
            raise StepError(f"{path.name}: {one.kind} of {one.faces[0]} is read otherwise")


def _key(one: FaceTolerance) -> tuple[str, tuple[str, ...]]:
    return one.kind, tuple(sorted(one.faces))


def read_tolerances(path: Path) -> list[Framed]:
    """All tolerances and radii of a file, as the kernel reads them; StepError if it cannot."""
    document = new_document()
    reader = STEPCAFControl_Reader()
    reader.SetGDTMode(True)
    if reader.ReadFile(str(path)) != IFSelect_RetDone or not reader.Transfer(document):
        raise StepError(f"{path.name}: the kernel cannot read its own file")
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    entity_of = reader.Reader().WS().TransferReader().EntityFromShapeResult

    def faces(label: TDF_Label) -> tuple[str, ...]:
        first, second = TDF_LabelSequence(), TDF_LabelSequence()
        tool.GetRefShapeLabel_s(label, first, second)
        shapes = map(XCAFDoc_ShapeTool.GetShape_s, _each(first))
        return tuple(entity_of(one, ANY_RESULT).Name().ToCString() for one in shapes)

    return [*_read_zones(tool, faces), *_read_radii(tool, faces)]


def _read_zones(tool: XCAFDoc_DimTolTool, faces: FacesOf) -> Iterator[Framed]:
    names = {kind: name for name, kind in ZONES.items()}
    labels = TDF_LabelSequence()
    tool.GetGeomToleranceLabels(labels)
    for label in _each(labels):
        zone = XCAFDoc_GeomTolerance.Set_s(label).GetObject()
        referred = TDF_LabelSequence()
        tool.GetDatumWithObjectOfTolerLabels_s(label, referred)
        datums = [XCAFDoc_Datum.Set_s(one).GetObject() for one in _each(referred)]
        ordered = sorted(datums, key=lambda one: one.GetPosition())
        frame = tuple(one.GetName().ToCString() for one in ordered)
        yield FaceTolerance(names[zone.GetType()], faces(label), zone.GetValue()), frame


def _read_radii(tool: XCAFDoc_DimTolTool, faces: FacesOf) -> Iterator[Framed]:
    labels = TDF_LabelSequence()
    tool.GetDimensionLabels(labels)
    for label in _each(labels):
        size = XCAFDoc_Dimension.Set_s(label).GetObject()
        limit = size.GetUpperTolValue()
        yield FaceTolerance("radius", faces(label), limit, size.GetValue()), ()


def _each(labels: TDF_LabelSequence) -> Iterator[TDF_Label]:
    return (labels.Value(k) for k in range(1, labels.Length() + 1))
