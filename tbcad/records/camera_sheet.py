"""camera.json, as it is read: what a design asks of its lens, and the lenses that do it."""

from typing import ClassVar

from pydantic import ConfigDict, Field

from tbcad.cad.formats.checked_files import Finite
from tbcad.records.document import Document, RecordSection

NAME = "camera.json"
SCHEMA = "tbcad-camera/1"


class NeededLens(RecordSection):
    """Where the lens is in focus, and its entrance pupil, mm."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    focus_mm: Finite = Field(gt=0, le=1e5)
    pupil_mm: Finite = Field(gt=0, le=100)


class ListedLens(RecordSection):
    """A camera with a lens of the built-in lists, as it is to be set."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    camera: str
    lens: str
    focal_mm: Finite = Field(gt=0, le=1e5)
    f_number: Finite = Field(gt=0, le=1e3)

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
