"""What the machine would photograph: capture, light field, views, refocusing, studies."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tbcad.simulate.capture.light_field import LightField

__all__ = ["LightField"]


def __getattr__(name: str) -> object:
    """Give the reader of light fields, whose libraries take a second to load, when it is wanted."""
    if name == "LightField":
        from tbcad.simulate.capture.light_field import LightField

        return LightField
    raise AttributeError(f"module {__name__} has no {name}")
