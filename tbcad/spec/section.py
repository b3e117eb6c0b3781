"""A table of the design: what all of its sections have in common."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A frozen table of the design; unknown keys and wrong types are errors."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


def as_tuple(value: object) -> object:
    """A list as a tuple, which can be frozen; anything else as it is."""
    return tuple(value) if isinstance(value, list) else value
