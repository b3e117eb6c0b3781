"""A whole prototype.json with hardly anything in it, for tests of what reads some of it."""

import json
from pathlib import Path
from typing import Any

from tbcad.records.prototype import NAME, Prototype
from tbcad.records.prototype_drive import DriveRecord, PowerOff

Record = dict[str, Any]
UPPER_LAMPS = {
    "part": "STAR-3535-8",
    "leds": [
        {
            "names": [f"upper_board_{k}", f"upper_rod_{k}"],
            "position_mm": [0.0, 40.0 * side, 30.0],
            "direction": [0.0, -0.8 * side, -0.6],
            "head_mm": [[0.0, 40.0 * side, 30.0], [0.0, 43.2 * side, 32.4]],
            "rod_mm": [
                [0.0, 43.0 * side, 32.0],
                [0.0, 46.0 * side, 28.0],
                [0.0, 70.0 * side, -60.0],
            ],
        }
        for k, side in ((1, 1.0), (2, -1.0))
    ],
    "candela_each": 2.0,
    "current_ma": 15.7,
    "head_diameter_mm": 8.0,
    "rod_diameter_mm": 1.5,
    "tolerance_mm": 0.75,
}
LAMP_SECTION = {
    **{"strip": "STRIP-COB-24V", "strips": 2, "length_mm": 50.0, "width_mm": 16.0, "level": False},
    "places": [
        {"name": "lamp_1", "position_mm": [0.0, 52.0, -80.0], "direction": [-1.0, 0.0, 0.0]}
    ],
    **{"lumen_each": 90.0, "watt": 4.0, "current_ma": 166.0},
}
FRAME = {"axis": [0.0, 0.0, 1.0], "zero": [1.0, 0.0, 0.0], "third": [0.0, 1.0, 0.0]}


def drive_section(**figures: float) -> Record:
    """The section `drive`; figures that are not given are 1."""
    known: Record = {name: 1.0 for name in DriveRecord.model_fields}
    known |= {"drive": "nema17-belt", "motor": "NEMA17-40", "centre_mm": [0.0, 0.0, 0.0]}
    return known | figures


def printed_part(name: str, role: str = "frame", **more: Any) -> Record:
    files = {kind: f"{name}.{kind}" for kind in ("step", "stl", "3mf")}
    place = {"axes": [FRAME["zero"], FRAME["third"], FRAME["axis"]], "origin_mm": [0.0] * 3}
    told = {"name": name, "what": name, "role": role, "finish": None, "ball": None, "quantity": 1}
    return {**told, **files, **place, **more}


def prototype_document(**changes: Any) -> Record:
    """The object, which its model accepts; sections may be changed."""
    document: Record = {
        "schema": "tbcad-prototype/2",
        "camera": "a",
        "target_mm": 60.0,
        "picture": "moved",
        "target_pad_um": 10.0,
        "frame": FRAME,
        "swing_deg": [-100.0, 90.0],
        "balls": "balls.csv",
        "holding": dict.fromkeys(
            ("min_ratio", "remanence_t", "derating", "glue_mpa", "wider_gap_mm"), 1.0
        ),
        **dict.fromkeys(("alternatives", "seats", "parts", "leds", "caps", "bought"), ()),
        **dict.fromkeys(("fasteners", "drawings", "assembly_steps"), ()),
        **dict.fromkeys(("calibration", "camera_place", "lamps", "shroud"), None),
        "controller": {
            "firmware": "grblhal",
            "board": "OCTOPUS-PRO-1.1",
            "axis": "X",
            "phases": [{"name": "dark", "output": None}],
        },
        "home": {
            **{"switch_deg": -100.0, "homed_deg": -98.0, "travel_deg": 190.0},
            **{"pin": "ROD-4x40", "zero_error_deg": 0.7},
        },
        "frame_stock": {
            **{"plate": "PLATE-400x150x8", "upright": "2020-350", "uprights_cut_to_mm": 310.0}
        },
        "totals": {
            **{
                "mass_g": 1.0,
                "bought_price": {},
                "without_price": 0,
                "tools_price": {},
                "parts_printed": 0,
            },
            **{"filament_g": 1.0, "filament_price": {}, "print_hours": 1.0},
        },
        "assembly": {"step": "prototype.step", "glb": "prototype.glb"},
        "drive": drive_section(),
        "power_off": dict.fromkeys(PowerOff.model_fields, 0.0) | {"brake": None},
    }
    document["holding"]["balls"] = []
    ordered = [field.alias or name for name, field in Prototype.model_fields.items()]
    document = {name: (document | changes)[name] for name in ordered}
    Prototype.model_validate(document)
    return document


def write_prototype(folder: Path, **changes: Any) -> Path:
    """Write prototype.json into a folder."""
    (folder / NAME).write_text(json.dumps(prototype_document(**changes)), encoding="utf-8")
    return folder
