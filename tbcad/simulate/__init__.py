"""Simulated photographs, their light field, views, refocusing, and studies of the paper."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tbcad.simulate.capture.light_field import LightField

__all__ = ["LightField"]


def __getattr__(name: str) -> object:
    """Import the reader of light fields, whose libraries take a second to load, on first use."""
    if name == "LightField":
        from tbcad.simulate.capture.light_field import LightField

        return LightField
    raise AttributeError(f"module {__name__} has no {name}")
