"""machine.json: a machine's state, as calibrated or as simulated."""

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from tbcad.cad.formats.checked_files import Finite, Vector
from tbcad.records.document import Document, RecordSection
from tbcad.records.exposure import Frame

Pair = tuple[Finite, Finite]
Length = Annotated[Finite, Field(gt=0)]


class CalibratedCamera(RecordSection):
    """A camera with its lens.

    Attributes:
        axes: right, down and forward as unit vectors.
        focal_px: across and down, as is principal_px.
        distortion: k1, k2, p1, p2, k3 of OpenCV.
    """

    pinhole_mm: Vector
    axes: tuple[Vector, Vector, Vector]
    focal_px: tuple[Length, Length]
    principal_px: Pair
    distortion: tuple[Finite, Finite, Finite, Finite, Finite]
    width_px: int = Field(ge=16, le=65_536)
    height_px: int = Field(ge=16, le=65_536)


class SphereRecord(RecordSection):
    """A reflecting sphere with the base at angle zero."""

    centre_mm: Vector
    radius_mm: Length


class MachineRecord(Document):
    """machine.json.

    Attributes:
        axis: unit vector of the base's axis, through axis_point_mm.
        frames: in which it is photographed; of each:
        angle_deg: of the base, and
        shift_mm: of the base by run-out; None: it has none.
        leds_mm: places that the LEDs shine from.
    """

    MISSING: ClassVar[str] = "name a folder that tbcad calibrate wrote"
    schema_name: Literal["tbcad-machine/1"] = Field("tbcad-machine/1", alias="schema")
    camera: CalibratedCamera
    axis: Vector
    axis_point_mm: Vector
    frames: tuple[Frame, ...] = Field(min_length=1)
    angle_deg: tuple[Finite, ...] = Field(min_length=1)
    spheres: tuple[SphereRecord, ...] = Field(min_length=1)
    leds_mm: tuple[Vector, ...]
    shift_mm: tuple[Vector, ...] | None = None

    @model_validator(mode="after")
    def _of_each_frame(self) -> Self:
        for what, values in (("angles", self.angle_deg), ("shifts", self.shift_mm)):
            if values is not None and len(values) != len(self.frames):
                raise ValueError(f"another number of {what} than frames")
        return self
