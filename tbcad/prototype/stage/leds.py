"""Whether LEDs on the stage can be used: inside the sphere, apart, not in one plane, not hidden."""

import numpy as np

from tbcad.geometry.vectors import norm
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import StageSpec
from tbcad.types import Floats

POCKET_PLAY_MM = 0.1  # to either side
MIN_FLATNESS_MM = 1.0  # of the LEDs about the nearest plane, square root of the sum of squares
TINY = 1e-12  # keeps a division by zero away


def check_leds(
    stage: StageSpec,
    prototype: PrototypeLayout,
    capture: float,
    led: PurchasedPart,
    pockets: Floats,
    plate: float,
) -> None:
    """Refuse LEDs that are outside the sphere, collide, are in one plane or hidden.

    Args:
        stage: section of the stage.
        prototype: whose virtual cameras see the LEDs.
        capture: radius of the capture sphere, mm.
        led: the purchased part.
        pockets: z of the pockets' floors, mm, (l,).
        plate: z of the crown's upper face, mm.

    Raises:
        SpecError: as said.
    """
    domes, pillar = np.array(stage.leds_mm).reshape(-1, 3), pillar_radius(stage, led)
    from_axis, tip = norm(domes[:, :2]), led["diameter_mm"] / 2
    reach = np.hypot(from_axis + pillar, plate).clip(norm(domes) + tip)
    min_from_axis = pillar + stage.disc_mm / 2 + POCKET_PLAY_MM
    for i, dome in enumerate(domes):
        name = f"prototype.stage.leds_mm: LED {i + 1}"
        if reach[i] > capture:
            raise SpecError(
                f"{name} with its pillar reaches {reach[i]:.1f} mm from the origin, beyond the "
                f"capture sphere of {capture:g} mm: move it inward, or set leds_mm to []"
            )
        if pockets[i] < plate:
            raise SpecError(
                f"{name} is too low for its pocket: make its z at least "
                f"{dome[2] + plate - pockets[i]:.1f}, or prototype.stage.top_mm smaller"
            )
        if from_axis[i] < min_from_axis:
            raise SpecError(
                f"{name} is inside the disc: move it outward to {min_from_axis:.1f} mm from the "
                "axis, or make prototype.stage.disc_mm smaller"
            )
        for j in range(i):
            if norm(dome[:2] - domes[j, :2]) < 2 * pillar:
                raise SpecError(f"{name} collides with LED {j + 1}: move one of them")
    if len(domes):
        _check_flatness(domes)
        _check_visible(domes, prototype, pillar, tip)


def _check_flatness(domes: Floats) -> None:
    """Refuse LEDs that lie nearly in one plane."""
    if float(np.linalg.svd(domes - domes.mean(axis=0))[1][-1]) < MIN_FLATNESS_MM:
        raise SpecError(
            "prototype.stage.leds_mm: the LEDs lie nearly in one plane, which does not calibrate: "
            "move one of them up or down"
        )


def _check_visible(domes: Floats, prototype: PrototypeLayout, pillar: float, tip: float) -> None:
    """Refuse an LED that another pillar hides from a virtual camera.

    A pillar is taken to reach as high as its LED.
    """
    cameras = prototype.array.ellipsoid.camera_distance * prototype.array.u
    sight = cameras[:, None] - domes
    level = np.maximum(norm(sight[..., :2]), TINY)[..., None]
    direction = sight[..., :2] / level
    between = domes[None, :, :2] - domes[:, None, :2]
    along = np.einsum("mix,ijx->mij", direction, between)
    beside = (between**2).sum(axis=-1) - along**2
    enters = along - np.sqrt(np.maximum(pillar**2 - beside, 0))
    height = domes[:, 2, None] - tip + enters * (sight[..., 2, None] / level)
    hidden = (beside < pillar**2) & (along > 0) & (height < domes[:, 2] + tip)
    hidden[:, np.arange(len(domes)), np.arange(len(domes))] = False
    if hidden.any():
        mirror, i, j = (int(axis[0]) for axis in np.nonzero(hidden))
        raise SpecError(
            f"prototype.stage.leds_mm: LED {i + 1} is hidden from mirror "
            f"{prototype.array.ids[mirror]} by LED {j + 1}: move them, the higher ones to smaller x"
        )


def pillar_radius(stage: StageSpec, led: PurchasedPart) -> float:
    """Radius of the pillar round a pocket, mm."""
    return led["flange_mm"] / 2 + POCKET_PLAY_MM + stage.led_wall_mm
