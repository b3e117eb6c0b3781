"""Priors of a machine: the errors of the process that made it.

Figures of a process come from tbcad/tolerancing/process/*.toml, each with its source there. What no
process says is a judgement, below.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.sphere_forms import FORM_TERMS, power_slope
from tbcad.errors import InputError
from tbcad.rig.calibration.estimate.parameters import Block, Prior, prior_of
from tbcad.rig.machine.designed import LED_MM, Motion
from tbcad.rig.machine.machine import Machine
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.types import Bools, Floats, Ints

PRINCIPAL_SHARE = 0.01
"""Of the width, by which the principal point is off: a sensor placed to 0.25 mm is 72 px of 3.45 um
off at 2,080 px (Allied Vision Prosilica GT), lenses are centred better; judgement between both."""
OBLONG = 1e-3  # by which pixels are not square: mask-made sensors are square to better; judgement
DISTORTIONS = (0.05, 0.02, 1e-3, 1e-3, 0.0)
"""k1, k2, p1, p2, k3: a wide lens may bend by 5 % (data sheets of lenses for machine vision: 0.5 to
15); judgement, wider than tbcad.rig.machine.designed, because highlights tell it well. k3 is fixed:
those of a few balls do not tell it from k2."""
MEASURED_MM = 0.01
"""Standard deviation of a radius that is measured without saying how well: by a micrometer screw
over the body, or a spherometer."""
# A measured radius that differs from the design by this factor is a diameter (2), another ball's,
# or has its decimal point elsewhere: no process is so far off, flat polished caps included.
MISREAD = 1.75
PATTERN = re.compile(r"(\d{1,4})=([0-9.]{1,12})(?::([0-9.]{1,12}))?")
Measured = tuple[tuple[int, float, float], ...]


def prototype_prior(
    machine: Machine,
    moved: Sequence[Motion],
    errors: Errors,
    seat: Floats,
    series: Ints,
    zero_error: float = 0.0,
    lens_known: bool = False,
    measured: Measured = (),
) -> Prior:
    """Prior of a prototype as designed, whose balls are on a base that rotates.

    Gravity moves the base in its frames, by the carrier and by what holds it. Seats have the
    centres of the bodies, mm, (k, 3): of caps, which are made instead of purchased, these are not
    their spheres'. Each frame belongs to a series, (f,). The base's angle zero has a half width in
    radians.
    A known lens is fixed; measured radii have numbers of spheres, values and standard deviations,
    mm. InputError: a measured radius is no radius of that sphere.
    """
    cap, designed = norm(machine.centre - seat) > 0, machine.radius
    machine, powers = _powers(machine, errors, measured)
    _check_measured(measured, designed)
    with_form = 0.0 * powers if machine.forms is None else np.sign(machine.forms.half_aperture)
    balls = [one for one in measured if not with_form[one[0]]]
    radius, radii = _radii(machine, errors, cap, balls)
    offset = math.hypot(zero_error / math.sqrt(3), errors.rotation_angle.sigma)
    known = _camera(machine, errors, lens_known) | {
        Block.TILT: errors.axis_tilt.sigma,
        Block.AXIS_POINT: errors.shell_shift.sigma,
        Block.OFFSET: offset,
        Block.CARRIER: [_growth(errors), *[errors.shell_shift.sigma] * 3],
        Block.LEDS: math.hypot(errors.shell_shift.sigma, LED_MM),
        Block.CENTRES: errors.seat.sigma,
        Block.CAP_TILT: cap[:, None] * errors.cap_tilt.sigma,
        Block.RADII: radii,
        Block.ANGLES: _with_sag(errors.rotation_angle, errors, [one.angle for one in moved]),
        Block.TURN: _with_sag(errors.axis_wobble, errors, [one.turn for one in moved]),
        Block.SHIFT: _with_sag(errors.axis_runout, errors, [one.shift for one in moved]),
        Block.SAG: errors.sag.sigma,
        Block.POWER: powers,
        Block.FORM: with_form[:, None] * form_sigmas(errors),
    }
    share = errors.sag.mean
    mean = replace(
        machine,
        radius=radius,
        angle=machine.angle + share * np.sum([one.angle for one in moved], axis=0),
        turn=share * np.sum([one.turn for one in moved], axis=0),
        shift=share * np.sum([one.shift for one in moved], axis=0),
        sag=share * np.sum([one.sag for one in moved], axis=0),
        seat_turn=share * np.sum([one.seat_turn for one in moved], axis=0),
    )
    return prior_of(mean, series, known, seat)


def _with_sag(error: Error, errors: Errors, moved: list[Floats]) -> float:
    """Standard deviation of a frame's motion along each way, by an error and by what weight does.

    What is predicted of each frame, (f,) or (f, 3), may be too large or small by a share.
    """
    ways = [np.sqrt((one**2).sum() / max(one.size, 1)) for one in moved]
    return math.hypot(error.sigma, errors.sag.sigma * math.hypot(*ways))


def shell_prior(machine: Machine, errors: Errors, lens_known: bool = False) -> Prior:
    """Prior of one designed shell with its camera; LEDs are held at the object's place together.

    In the frame of the shell: how its whole place is off is the camera's and the LEDs' error here.
    """
    shift, camera = errors.shell_shift.sigma, _camera(machine, errors, lens_known)
    warp = errors.warp  # moves and turns each sphere
    turned = machine.radius / warp.length if warp.length else 0.0 * machine.radius
    centres = np.hypot(errors.sphere_centre.sigma, warp.spread * np.hypot(1, turned))
    known = camera | {
        Block.CAMERA_TURN: np.hypot(camera[Block.CAMERA_TURN], errors.shell_tilt.sigma),
        Block.PINHOLE: np.hypot(camera[Block.PINHOLE], shift),
        Block.CARRIER: [_growth(errors), 0.0, 0.0, 0.0],
        Block.LEDS: math.hypot(math.hypot(shift, LED_MM), shift),
        Block.CENTRES: centres[:, None],
        Block.RADII: errors.whole_radius.sigma,
    }
    return prior_of(machine, np.zeros(1, dtype=np.int64), known)


def _growth(errors: Errors) -> float:
    return math.hypot(errors.scale_isotropic.mean, errors.scale_isotropic.sigma)


def _camera(machine: Machine, errors: Errors, lens_known: bool) -> dict[Block, Any]:
    """Standard deviations of pose and lens."""
    known = 0.0 if lens_known else 1.0
    return {
        Block.CAMERA_TURN: np.full(3, errors.camera_tilt.sigma),
        Block.PINHOLE: errors.camera_shift.sigma,
        Block.FOCAL: known * np.array([errors.camera_focal.sigma, OBLONG]),
        Block.PRINCIPAL: known * PRINCIPAL_SHARE * machine.camera.width_px,
        Block.DISTORTION: known * np.array(DISTORTIONS),
    }


def form_sigmas(errors: Errors) -> Floats:
    """Standard deviations of the terms of a cap's form, mm, (t,)."""
    return np.concatenate(
        [
            np.full(len(terms), getattr(errors, f"cap_{name}").sigma)
            for name, terms in FORM_TERMS.items()
        ]
    )


def _powers(machine: Machine, errors: Errors, measured: Measured) -> tuple[Machine, Floats]:
    """The machine with caps as measured about their apices, and sigmas of their sagittas, mm, (k,).

    InputError: a measured radius is smaller than the part in use.
    """
    if (forms := machine.forms) is None:
        return machine, np.zeros(len(machine.radius))
    radius, half = machine.radius.copy(), forms.half_aperture
    sigma = np.where(half > 0, errors.cap_sagitta.sigma, 0.0)
    for number, value, uncertainty in measured:
        if half[number] == 0:
            continue
        if value <= half[number]:
            raise InputError(
                f"--measured {number + 1}={value:g}: the part of this cap in use is "
                f"{2 * half[number]:.1f} mm wide: give its radius, not its sagitta"
            )
        radius[number] = value
        sigma[number] = uncertainty / abs(power_slope(radius, half)[number])
    centre = machine.centre - (radius - machine.radius)[:, None] * forms.outward
    return replace(machine, radius=radius, centre=centre), sigma


def _check_measured(measured: Measured, designed: Floats) -> None:
    for number, value, _ in measured:
        if not 1 / MISREAD < value / designed[number] < MISREAD:
            raise InputError(
                f"--measured {number + 1}={value:g}: the design has a radius of "
                f"{designed[number]:.2f} mm there: give the radius in mm, not the diameter, of "
                "that ball"
            )


def _radii(
    machine: Machine, errors: Errors, is_cap: Bools, measured: Sequence[tuple[int, float, float]]
) -> tuple[Floats, Floats]:
    made, bought = errors.whole_radius, errors.ball_radius
    radius = machine.radius + np.where(is_cap, made.mean, bought.mean)
    sigma = np.where(is_cap, made.sigma, bought.sigma)
    for number, value, uncertainty in measured:
        radius[number], sigma[number] = value, uncertainty
    return radius, sigma


def parse_measured(texts: tuple[str, ...], balls: int) -> Measured:
    """Radii "BALL=MM" or "BALL=MM:SIGMA" as number from 0, radius and standard deviation, mm."""
    measured: list[tuple[int, float, float]] = []
    for text in texts:
        found = PATTERN.fullmatch(text.replace(" ", ""))
        try:
            ball, radius, sigma = found.groups() if found else ("", "", "")
            values = int(ball) - 1, float(radius), float(sigma or MEASURED_MM)
        except ValueError:
            raise InputError(
                f"--measured {text!r:.60} is not BALL=RADIUS_MM or BALL=RADIUS_MM:SIGMA_MM: write "
                "for instance 1=43.21:0.01"
            ) from None
        if not (0 <= values[0] < balls and values[1] > 0 and values[2] > 0):
            raise InputError(
                f"--measured {text}: allowed is ball 1 to {balls}, with a radius and its sigma "
                "above 0 mm: change it"
            )
        if any(values[0] == number for number, _, _ in measured):
            raise InputError(
                f"--measured {text}: ball {ball} has a radius already: give one for each ball, of "
                "several measurements their mean"
            )
        measured.append(values)
    return tuple(measured)
