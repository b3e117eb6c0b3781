"""Caps in prototype.json: their key, limits, material and finish."""

from typing import Any

from tbcad.prototype.base.cap_limits import FINISH, MATERIAL, MIN_REFLECTANCE, POLARITY, cap_limits
from tbcad.prototype.model import PrototypeModel


def cap_records(built: PrototypeModel) -> list[dict[str, Any]]:
    """One record for each cap."""
    return [
        {
            "ball": one.ball + 1,
            "spigot_mm": one.spigot,
            "socket_mm": one.socket,
            "spigot_end_mm": one.end,
            "tilt_deg": one.tilt_deg,
            "centre_shift_mm": one.centre_shift,
            "aperture_mm": one.aperture,
            "radius_tolerance_mm": one.radius_tolerance,
            "body_tolerance_mm": 2 * one.body_tolerance,
            "irregularity_fringes": one.irregularity,
            "roughness_ra_um": one.roughness_um,
            "incidence_deg": one.incidence_deg,
            "reflectance_min": MIN_REFLECTANCE,
            "material": MATERIAL,
            "finish": FINISH,
            "polarity": POLARITY,
            "pdf": f"{one.drawing}.pdf",
            "dxf": f"{one.drawing}.dxf",
        }
        for one in cap_limits(built.spec, built.base, built.layout)
    ]
