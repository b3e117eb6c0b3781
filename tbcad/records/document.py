"""JSON files whose fields are all declared, by one model that reads and writes; manifest.json."""

import json
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from tbcad.cad.formats.checked_files import read_json


class RecordSection(BaseModel):
    """A JSON object whose keys are the fields of the model, in their order, and no others."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


class Document(RecordSection):
    """A whole file. Its key `schema` names it; `MISSING` says what to do where it is not there."""

    MISSING: ClassVar[str]
    schema_name: str = Field(alias="schema")

    @classmethod
    def schema_of(cls) -> str:
        """What the key `schema` must be."""
        return str(cls.model_fields["schema_name"].default)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file.

        InputError: it is missing, too large, not JSON, of another schema, or does not fit.
        """
        return read_json(path, cls, cls.schema_of(), cls.MISSING)

    def document(self) -> dict[str, Any]:
        """The JSON object."""
        return self.model_dump(mode="json", by_alias=True)

    def text(self) -> str:
        """The file's text; numbers in full double precision."""
        return json.dumps(self.document(), indent=1, allow_nan=False) + "\n"

    def write(self, path: Path) -> None:
        """Write the file."""
        path.write_text(self.text(), encoding="utf-8")


NAME = "manifest.json"
SCHEMA = "tbcad-manifest/1"
MAX_FILES = 30_000  # three for each of 6578 mirrors at n = 36, and more

Kind = Literal[
    "build", "capture", "merged run", "run", "calibration", "dataset", "order", "as-built"
]
"""What a folder holds that a command writes; a run has no manifest, since it grows."""


def _plain_name(name: str) -> str:
    parts = name.split("/")
    if {"", ".", ".."} & {*parts} or {"\\", "\0"} & {*name}:
        raise ValueError("not the name of a file in the folder")
    return name


class Entry(BaseModel):
    """A file as it was written."""

    model_config = ConfigDict(strict=True, extra="forbid")

    sha256: str = Field(pattern="^[0-9a-f]{64}$")
    size: int = Field(ge=0)


class Manifest(Document):
    """manifest.json, also of other versions, whose folders are known by it: more keys may follow.

    Attributes:
        kind: of content; "" if it is not told.
        files: by their name with its path in the folder.
        versions: of tbcad, Python and libraries.
    """

    model_config = ConfigDict(frozen=True, extra="ignore", populate_by_name=True)

    schema_name: str = Field(pattern="^tbcad-manifest/", alias="schema")
    kind: str = ""
    files: dict[Annotated[str, AfterValidator(_plain_name)], Entry] = Field(max_length=MAX_FILES)
    versions: dict[str, str] = Field(default_factory=dict)
