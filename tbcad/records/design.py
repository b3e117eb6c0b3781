"""design.json: the resolved design of a build, its cameras, and the files of its parts."""

from typing import Any, ClassVar, Literal

from pydantic import Field

from tbcad.cad.formats.checked_files import Finite, Vector
from tbcad.core.spec.design import Spec
from tbcad.records.document import Document, RecordSection
from tbcad.records.prototype import PrintedPartRecord

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


class LampRecord(RecordSection):
    """A small Lambertian lamp: middle of its face, direction that it shines in, and its camera."""

    camera: Literal["a", "b"]
    position_mm: Vector
    direction: Vector


class ShellLamps(RecordSection):
    """LEDs on the lenses of a shell's cameras, and the ring that carries those of each.

    Attributes:
        ring: in a frame of its own, whose axes are a camera's `right`, up in its picture, and
            backward; the middle of the face is the origin.
        led: as in the list of parts.
        emitter_mm: width of what shines.
        candela: of one, along its direction.
        front_mm: from each pinhole to the ring's face, along the optical axis.
        watt: of all, resistors included.
        lux: least, mean and greatest on surfaces of the object that face all ways.
    """

    ring: PrintedPartRecord
    led: str
    emitter_mm: float = Field(gt=0, le=100)
    candela: float = Field(gt=0, le=1e6)
    front_mm: Finite
    bore_mm: float = Field(gt=0, le=1000)
    watt: float = Field(gt=0, le=1e4)
    lux: Vector
    places: tuple[LampRecord, ...]


class DesignRecord(Document):
    """design.json.

    Attributes:
        spec: the design with a value for every key.
        target_mm: diameter of the capture sphere.
        coating_mm: thickness of the mirrors' coat.
        foot_z_mm: height of the shells' lowest plane.
        parts: the shells, where they were built.
        mandrels: left out where there are none.
        lamps: of the shell, left out where it has none.
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
    lamps: ShellLamps | None = None
    mirrors: Literal["mirrors.csv"]

    def document(self) -> dict[str, Any]:
        """The JSON object."""
        left_out = {name for name in ("mandrels", "lamps") if not getattr(self, name)}
        return self.model_dump(mode="json", by_alias=True, exclude=left_out)
