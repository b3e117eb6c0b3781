"""What prototype.json has of lamps and shroud."""

from typing import Any

from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.light.shroud import ShroudLayout

BLACK = "matt black"
# Fasteners that are bought black, so that the camera does not see them shine.
BLACK_KINDS = frozenset({"screws", "setscrews", "washers", "nuts", "tnuts"})
# Purchased bodies that the camera sees between the balls: painted, blackened or taped.
BLACKENED = frozenset(
    {
        *("plate", "upright_left", "upright_right", "home_switch", "motor"),
        *("rotary_stage", "rotary_stage_top", "wheel", "pinion", "coupling", "shaft", "collar"),
    }
)


def record_of_light(lamps: LampLayout | None, shroud: ShroudLayout | None) -> dict[str, Any]:
    """The keys lamps and shroud; null without."""
    return {"lamps": _lamps(lamps), "shroud": _shroud(shroud)}


def _lamps(lamps: LampLayout | None) -> dict[str, Any] | None:
    if lamps is None:
        return None
    return {
        "strip": lamps.strip.name,
        "strips": lamps.strips,
        "length_mm": lamps.length,
        "width_mm": lamps.width,
        "level": lamps.level,
        "places": [
            {"name": body.name, "position_mm": place, "direction": direction}
            for body, place, direction in zip(
                lamps.bodies,
                (lamps.places + 0.0).tolist(),
                (lamps.inward + 0.0).tolist(),
                strict=True,
            )
        ],
        "lumen_each": lamps.lumen,
        "watt": lamps.watt,
        "current_ma": lamps.current_ma,
    }


def _shroud(shroud: ShroudLayout | None) -> dict[str, Any] | None:
    if shroud is None:
        return None
    return {
        "sheet": shroud.sheet.name,
        "sheets": shroud.sheets,
        "finish": BLACK,
        "panels": [
            {
                "name": panel.name,
                "what": panel.component.what,
                "dxf": f"{panel.name}.dxf",
                "size_mm": list(panel.size),
            }
            for panel in shroud.panels
        ],
    }
