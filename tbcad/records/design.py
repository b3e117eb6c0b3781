"""design.json: the resolved design of a build, its cameras, and the files of its parts."""

from typing import Any, ClassVar, Literal

from pydantic import Field

from tbcad.cad.formats.checked_files import Finite, Vector
from tbcad.core.spec.design import Spec
from tbcad.records.document import Document, RecordSection

NAME = "design.json"
MISSING = "name a folder that tbcad build wrote"


class CameraRecord(RecordSection):
    """A camera: its pinhole, the unit vectors of its axes, its pixels and horizontal view."""

    id: Literal["a", "b"]
    pinhole_mm: Vector
    forward: Vector
    right: Vector
    width_px: int = Field(ge=16, le=32_768)
    height_px: int = Field(ge=16, le=32_768)
    hfov_deg: float = Field(ge=1, le=170)


class ShellFiles(RecordSection):
    """A shell and its files."""

    name: str
    camera: Literal["a", "b"]
    step: str
    stl: str
    threemf: str = Field(alias="3mf")


class MandrelRecord(ShellFiles):
    """The negative of a shell: the direction in which the shell comes off, and its least draft."""

    pull: Vector
    draft_deg: Finite


class DesignRecord(Document):
    """design.json.

    Attributes:
        spec: the design with a value for every key.
        target_mm: diameter of the capture sphere.
        coating_mm: thickness of the mirrors' coat.
        foot_z_mm: height of the shells' lowest plane.
        parts: the shells, where they were built.
        mandrels: left out where there are none.
        mirrors: file of their table.
    """

    MISSING: ClassVar[str] = MISSING
    schema_name: Literal["tbcad-design/2"] = Field("tbcad-design/2", alias="schema")
    spec: Spec
    target_mm: float = Field(gt=0, le=1000)
    coating_mm: Finite
    foot_z_mm: Finite
    cameras: tuple[CameraRecord, CameraRecord]
    parts: tuple[ShellFiles, ...]
    mandrels: tuple[MandrelRecord, ...] = ()
    mirrors: Literal["mirrors.csv"]

    def document(self) -> dict[str, Any]:
        """The JSON object."""
        left_out = set() if self.mandrels else {"mandrels"}
        return self.model_dump(mode="json", by_alias=True, exclude=left_out)
