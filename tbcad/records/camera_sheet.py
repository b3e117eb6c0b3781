"""camera.json, as it is read: what a design asks of its lens, and the lenses that do it."""

from typing import ClassVar

from pydantic import ConfigDict, Field, model_validator

from tbcad.cad.formats.checked_files import Finite
from tbcad.records.document import Document, RecordSection

NAME = "camera.json"
SCHEMA = "tbcad-camera/1"


class NeededLens(RecordSection):
    """Where the lens is in focus, and its entrance pupil, mm."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    focus_mm: Finite = Field(ge=1, le=1e5, strict=True)
    pupil_mm: Finite = Field(ge=0.01, le=100, strict=True)


class ListedLens(RecordSection):
    """A camera with a lens of the built-in lists, as it is to be set."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    camera: str
    lens: str
    focal_mm: Finite = Field(ge=0.1, le=1e5, strict=True)
    f_number: Finite = Field(ge=0.1, le=1e3, strict=True)

    @property
    def name(self) -> str:
        """Of the camera with its lens."""
        return f"{self.camera} with {self.lens}"


class CameraSheet(Document):
    """What of camera.json is read; `core.camera.sheet` writes it, with more for people."""

    MISSING: ClassVar[str] = "build it again with tbcad build, or leave out --optics real"
    model_config = ConfigDict(frozen=True, extra="ignore", populate_by_name=True)

    schema_name: str = Field(SCHEMA, alias="schema")
    requirements: NeededLens
    mounted: str | None = None
    candidates: tuple[ListedLens, ...] = ()

    @model_validator(mode="after")
    def _mounted_is_listed(self) -> "CameraSheet":
        if self.mounted is not None and self.in_use is None:
            raise ValueError(f"mounted: {self.mounted} is none of the candidates")
        return self

    @property
    def in_use(self) -> ListedLens | None:
        """The listed lens of the camera that a mount is made for; None without one."""
        return next((one for one in self.candidates if one.name == self.mounted), None)


class RealOpticsRecord(RecordSection):
    """What of a real camera is in a capture, in capture.json and in its light field's facts.

    Attributes:
        lens: camera and lens that the prototype's mount is made for; None: one as needed.
        reflectance: of the mirrors.
        scattered: share of it that mirrors scatter, in the median and at most.
        gloss: roughness of the object; None: as its materials say, else it is matt.
        white: of a full pixel, which has so many electrons.
    """

    lens: str | None
    pupil_mm: Finite
    focus_mm: Finite
    wavelength_nm: Finite
    rays_a_pixel: int
    reflectance: Finite
    scattered: tuple[Finite, Finite]
    gloss: Finite | None
    white: Finite
    full_electrons: Finite
    read_electrons: Finite
    bits: int
    left_out: tuple[str, ...]
