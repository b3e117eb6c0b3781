"""manifest.json: the files of a folder that a command wrote, and the versions that wrote them."""

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from tbcad.records.document import Document

NAME = "manifest.json"
SCHEMA = "tbcad-manifest/1"
MAX_FILES = 30_000  # three for each of 6578 mirrors at n = 36, and more

Kind = Literal[
    "build", "capture", "merged run", "run", "calibration", "dataset", "inspection", "as-built"
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
