"""STEP: the exact solid, its faces named, the same bytes for the same design."""

import errno
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import RLock

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.gp import gp_Pnt
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity
from OCP.StepBasic import StepBasic_Product
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPConstruct import STEPConstruct, STEPConstruct_ValidationProps
from OCP.STEPControl import (
    STEPControl_AsIs,
    STEPControl_Controller,
    STEPControl_Reader,
    STEPControl_Writer,
)
from OCP.StepShape import StepShape_AdvancedFace, StepShape_ManifoldSolidBrep
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Solid
from OCP.Transfer import Transfer_FinderProcess
from OCP.XCAFApp import XCAFApp_Application
from OCP.XSControl import XSControl_WorkSession

from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.checks import SolidProperties, properties
from tbcad.cad.kernel.solids import faces
from tbcad.errors import InputError

TAIL_BYTES = 64  # of a file, in which its last mark must be
SURFACE_CURVES = "write.surfacecurve.mode"
_SETTINGS = RLock()
END = b"END-ISO-10303-21;"  # of every STEP file
TIME_STAMP = "2022-11-01T00:00:00"  # fixed: the file's bytes depend on the design alone
ANY_RESULT = 1  # of a translation, not the last one alone


def incomplete(path: Path) -> OSError:
    """The error of a file that could not be written in full."""
    return OSError(errno.EIO, "a file could not be written in full; is the disk full?", str(path))


def check_complete(path: Path, mark: bytes) -> None:
    """Raise OSError unless a file is there with a mark, such as END, among its last bytes."""
    if not path.is_file():
        raise incomplete(path)
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - TAIL_BYTES, 0))
        if mark not in file.read():
            raise incomplete(path)


class StepError(RuntimeError):
    """The kernel cannot translate a solid: a fault of tbcad."""


def write_step(
    path: Path, solid: Solid, pcurves: bool = False, known: SolidProperties | None = None
) -> None:
    """Write one solid as AP214 in millimetres.

    The names of its faces become those of the advanced faces; volume, area and centroid, worked out
    where they are not known, go along as validation properties. With pcurves curves in the
    surfaces' parameters are written too; readers make their own. StepError if the kernel fails,
    OSError if the file cannot be written in full.
    """
    with kernel_settings(pcurves):
        _write(path, solid, known or properties(solid.shape))


def _write(path: Path, solid: Solid, known: SolidProperties) -> None:
    writer = STEPControl_Writer()
    if writer.Transfer(solid.shape, STEPControl_AsIs) != IFSelect_RetDone:
        raise StepError(f"{path.name}: the kernel cannot translate the solid")
    finder = writer.WS().TransferWriter().FinderProcess()
    for name, face in solid.faces:
        _name(finder, face, name)
    _validation_properties(writer, solid.shape, known)
    _name_product(writer, solid.name)
    write_header(writer, solid.name)
    if writer.Write(str(path)) != IFSelect_RetDone:
        raise incomplete(path)
    check_complete(path, END)


@contextmanager
def kernel_settings(pcurves: bool = False, schema: str = "AP214IS") -> Iterator[None]:
    """Settings of the kernel for the block: millimetres, a schema, statistics off the screen.

    They are of the whole process: threads take turns, and the user finds them as they were.
    Failures are raised, not printed.
    """
    texts = {"write.step.unit": "MM", "write.step.schema": schema}
    with _SETTINGS:
        STEPControl_Controller.Init_s()  # which declares the settings
        printers = [(one, one.GetTraceLevel()) for one in Message.DefaultMessenger_s().Printers()]
        before = {name: Interface_Static.CVal_s(name) for name in texts}
        curves = Interface_Static.IVal_s(SURFACE_CURVES)
        try:
            for printer, _ in printers:
                printer.SetTraceLevel(Message_Gravity.Message_Fail)
            _set(texts, int(pcurves))
            yield
        finally:
            _set(before, curves)
            for printer, level in printers:
                printer.SetTraceLevel(level)


def _set(texts: Mapping[str, str], curves: int) -> None:
    for name, value in texts.items():
        Interface_Static.SetCVal_s(name, value)
    Interface_Static.SetIVal_s(SURFACE_CURVES, curves)


def _name(finder: Transfer_FinderProcess, face: TopoDS_Face, name: str) -> None:
    item = STEPConstruct.FindEntity_s(finder, face)
    if item is None:
        raise StepError(f"the kernel lost face {name}")
    item.SetName(TCollection_HAsciiString(name))


def _validation_properties(
    writer: STEPControl_Writer, solid: TopoDS_Solid, known: SolidProperties
) -> None:
    """Volume, area and centroid, for readers to compare with what they have read.

    Source: CAx-IF, Recommended Practices for Geometric and Assembly Validation Properties.
    """
    validation = STEPConstruct_ValidationProps(writer.WS())
    written = (
        validation.AddVolume(solid, known.volume)
        and validation.AddArea(solid, known.area)
        and validation.AddCentroid(solid, gp_Pnt(*known.centroid))
    )
    if not written:
        raise StepError("the kernel cannot write the validation properties")


def _name_product(writer: STEPControl_Writer, name: str) -> None:
    """Name the one product and its one solid; the kernel's own name counts up with every file."""
    model, unnamed = writer.Model(), [StepBasic_Product, StepShape_ManifoldSolidBrep]
    for k in range(1, model.NbEntities() + 1):
        entity = model.Value(k)
        kind = next((kind for kind in unnamed if isinstance(entity, kind)), None)
        if kind is None:
            continue
        if kind is StepBasic_Product:
            entity.SetId(TCollection_HAsciiString(name))
        entity.SetName(TCollection_HAsciiString(name))
        unnamed.remove(kind)
        if not unnamed:  # both are among the first of ten thousands
            return
    raise StepError(f"the kernel wrote no product or no solid of {name}")


def new_document() -> TDocStd_Document:
    """An empty document of the kernel."""
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    return document


def document_writer(path: Path, document: TDocStd_Document) -> STEPCAFControl_Writer:
    """A writer that has translated a document with its names and tolerances, without colours."""
    writer = STEPCAFControl_Writer(XSControl_WorkSession(), False)
    writer.SetDimTolMode(True)
    writer.SetColorMode(False)
    writer.SetNameMode(True)
    if not writer.Transfer(document, STEPControl_AsIs):
        raise StepError(f"{path.name}: the kernel cannot translate the solids")
    return writer


def set_name(label: TDF_Label, name: str) -> TDF_Label:
    """The label of a document, named."""
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    return label


def finish(path: Path, writer: STEPCAFControl_Writer, entities: Callable[[str], str]) -> None:
    """Write a file, and at its end what entities are for its text; OSError if not in full."""
    if writer.Write(str(path)) != IFSelect_RetDone:
        raise incomplete(path)
    check_complete(path, END)
    text, end, rest = path.read_text(encoding="ascii").rpartition("ENDSEC;\nEND-ISO-10303-21;")
    path.write_text(text + entities(text) + end + rest, encoding="ascii")


def write_header(writer: STEPControl_Writer, name: str) -> None:
    """Name the file; its time stamp is fixed."""
    header = APIHeaderSection_MakeHeader(writer.Model())
    header.SetName(TCollection_HAsciiString(name))
    header.SetTimeStamp(TCollection_HAsciiString(TIME_STAMP))
    header.SetOriginatingSystem(TCollection_HAsciiString("tbcad"))
    header.SetAuthorValue(1, TCollection_HAsciiString(""))
    header.SetOrganizationValue(1, TCollection_HAsciiString(""))


@kernel_settings()
def read_named_solid(path: Path) -> Solid:
    """Read a file of one solid; InputError if it cannot be read, or is not one.

    Faces are in the order of the file, which the kernel changes where neighbours do not touch.
    """
    reader = STEPControl_Reader()
    read = reader.ReadFile(str(path)) == IFSelect_RetDone and reader.TransferRoots() == 1
    shape = reader.OneShape() if read else None
    if shape is None or shape.ShapeType() != TopAbs_ShapeEnum.TopAbs_SOLID:
        raise InputError(f"{path} is no STEP file of one solid: run tbcad build again")
    model, entity_of = reader.WS().Model(), reader.WS().TransferReader().EntityFromShapeResult
    entities = [model.Value(k) for k in range(1, model.NbEntities() + 1)]
    # The same entity is the same object here, while it is kept.
    found = {id(entity_of(face, ANY_RESULT)): face for face in faces(shape)}
    named = [one for one in entities if isinstance(one, StepShape_AdvancedFace)]
    if found.keys() != {id(one) for one in named}:
        raise InputError(f"{path} is no STEP file of one solid: run tbcad build again")
    pairs = tuple((one.Name().ToCString(), found[id(one)]) for one in named)
    return Solid(path.stem, TopoDS.Solid_s(shape), pairs)
