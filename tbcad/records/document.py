"""JSON files whose fields are all declared: the same model reads and writes them."""

import json
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field

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

        Raises:
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
