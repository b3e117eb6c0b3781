"""A table of the design: what all of its sections have in common."""

from dataclasses import dataclass
from typing import Any, Final

from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    ValidatorFunctionWrapHandler,
)
from pydantic_core import CoreSchema, core_schema


class Section(BaseModel):
    """A frozen table of the design; unknown keys and wrong types are errors."""

    # Deferred: sections are validated with the design, never alone; each would be prepared twice.
    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True
    )


@dataclass(frozen=True)
class OrWord:
    """Annotation of a key that may hold a word instead of a value of its type.

    The key keeps the type of its values: before they are used, tbcad puts one in the word's place.
    """

    word: str  # for instance "auto"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Let the word through; check everything else as the type does."""
        # What is written is as it is: as a number the word would be one of the wrong type.
        written = core_schema.simple_ser_schema("any")
        return core_schema.no_info_wrap_validator_function(
            self._checked, handler(source), serialization=written
        )

    def _checked(self, value: object, check: ValidatorFunctionWrapHandler) -> object:
        return value if value == self.word else check(value)


@dataclass(frozen=True)
class Reason:
    """Annotation of a key: why its values end where they do, for the error message."""

    text: str


@dataclass(frozen=True)
class Entries:
    """Annotation of a key that is a list: what its entries are called, for the error message."""

    names: tuple[str, ...]


AUTO: Final[Any] = "auto"  # value of a key whose value tbcad chooses
OR_AUTO = OrWord(AUTO)


def whole(value: object) -> object:
    """A whole number as it is: a literal 1 would take 1.0 and true, which equal it."""
    if type(value) is not int:
        raise ValueError("allowed is a whole number: change it")
    return value


def as_tuple(value: object) -> object:
    """A list as a tuple, which can be frozen; anything else as it is."""
    return tuple(value) if isinstance(value, list) else value
