"""Whether LEDs on the stage can be used: inside the sphere, apart, not in one plane, not hidden."""

import numpy as np

from tbcad.geometry.vectors import norm
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.keepout import Room
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import StageSpec
from tbcad.types import Floats

POCKET_PLAY_MM = 0.1  # to either side
FLAT_MM = 1.0  # least that the LEDs stand out of any plane, square root of the sum of squares


def check_leds(
    keys: StageSpec,
    made: PrototypeLayout,
    space: Room,
    led: PurchasedPart,
    pockets: Floats,
    plate: float,
) -> None:
    """Refuse LEDs that are outside the sphere, collide, are in one plane or hidden.

    Raises:
        SpecError: as said.
    """
    places = np.array(keys.leds_mm).reshape(-1, 3)
    pillar, away = pillar_radius(keys, led), norm(places[:, :2])
    tip = led["diameter_mm"] / 2
    heights = np.stack([np.full(len(places), plate), places[:, 2] + tip], axis=1)
    outside = np.hypot(away + pillar, heights[:, 0]).clip(norm(places) + tip)
    for i in range(len(places)):
        name = f"prototype.stage.leds_mm: LED {i + 1}"
        if outside[i] > space.capture:
            raise SpecError(
                f"{name} with its pillar reaches {outside[i]:.1f} mm from the origin, beyond the "
                f"capture sphere of {space.capture:g} mm: move it inward, or set leds_mm to []"
            )
        if pockets[i] < plate:
            raise SpecError(
                f"{name} stands too low for its pocket: make its z at least "
                f"{places[i, 2] + plate - pockets[i]:.1f}, or prototype.stage.top_mm smaller"
            )
        if away[i] < pillar + keys.disc_mm / 2 + POCKET_PLAY_MM:
            raise SpecError(
                f"{name} stands in the disc: move it outward to "
                f"{pillar + keys.disc_mm / 2 + POCKET_PLAY_MM:.1f} mm from the axis, or make "
                "prototype.stage.disc_mm smaller"
            )
        for j in range(i):
            if norm(places[i, :2] - places[j, :2]) < 2 * pillar:
                raise SpecError(f"{name} collides with LED {j + 1}: move one of them")
    if len(places) and float(np.linalg.svd(places - places.mean(axis=0))[1][-1]) < FLAT_MM:
        raise SpecError(
            "prototype.stage.leds_mm: the LEDs lie nearly in one plane, which does not calibrate: "
            "move one of them up or down"
        )
    _check_seen(places, made, pillar, tip)


def _check_seen(places: Floats, made: PrototypeLayout, pillar: float, tip: float) -> None:
    """Refuse an LED that another pillar hides from a virtual camera.

    A pillar is taken to reach as high as its LED.
    """
    if not len(places):
        return
    cameras = made.half.ellipsoid.camera_distance * made.half.u
    way = cameras[:, None] - places
    flat = norm(way[..., :2])
    out = way[..., :2] / np.maximum(flat, 1e-12)[..., None]
    to = places[None, :, :2] - places[:, None, :2]
    along = np.einsum("mix,ijx->mij", out, to)
    beside = (to**2).sum(axis=-1) - along**2
    enters = along - np.sqrt(np.maximum(pillar**2 - beside, 0))
    height = places[:, 2, None] - tip + enters * (way[..., 2] / np.maximum(flat, 1e-12))[..., None]
    hidden = (beside < pillar**2) & (along > 0) & (height < places[:, 2] + tip)
    hidden[:, np.arange(len(places)), np.arange(len(places))] = False
    if hidden.any():
        mirror, i, j = (int(axis[0]) for axis in np.nonzero(hidden))
        raise SpecError(
            f"prototype.stage.leds_mm: LED {i + 1} is hidden from mirror {made.half.ids[mirror]} "
            f"by LED {j + 1}: move them, the higher ones to smaller x"
        )


def pillar_radius(keys: StageSpec, led: PurchasedPart) -> float:
    """Radius of the pillar round a pocket, mm."""
    return led["flange_mm"] / 2 + POCKET_PLAY_MM + keys.led_wall_mm
