"""How the camera is put in its place, for prototype.json."""

from typing import Any

from tbcad.geometry.vectors import norm
from tbcad.prototype.frame.camera_gauge import marks_seen
from tbcad.prototype.model import PrototypeModel


def camera_place_record(built: PrototypeModel) -> dict[str, Any] | None:
    """The mount's travel, the gauge's marks, its pictures and errors; None without a camera.

    Lengths of the gauge are from the hub's face and over both sides, as calipers measure them.
    """
    gauge, mount = built.gauge, built.frame.mount
    if gauge is None or mount is None:
        return None
    sizes, camera = gauge.sizes, built.layout.array.camera
    return {
        "gauge": gauge.component.name,
        "marks_mm": (gauge.marks + 0.0).tolist(),
        "lengths_mm": {
            "hub_to_near": sizes.near - sizes.hub,
            "hub_to_far": sizes.far - sizes.hub,
            "near_width": 2 * sizes.near_half,
            "far_width": 2 * sizes.far_half,
            "hub_to_pinhole": float(norm(camera.pinhole)) - sizes.hub,
        },
        "pictures": marks_seen(gauge, built.base, camera),
        "error": gauge.errors,
        "travel": mount.travel,
    }
