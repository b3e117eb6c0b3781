"""A screw of a record, on a plate at the origin unless told otherwise."""

from typing import Any

from tbcad_verify.record.prototype import PlacedFastener

SCREW = {
    "name": "M5x16_1",
    "part": "M5x16",
    "position_mm": [0.0, 0.0, 0.0],
    "along": [0.0, 0.0, -1.0],
    "through": ["plate"],
    "turns": False,
    "finish": None,
}


def screw(**changed: Any) -> PlacedFastener:
    return PlacedFastener.model_validate(SCREW | changed)
