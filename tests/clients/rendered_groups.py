"""A calibrated machine against the rig that was rendered: errors by group, with chi-squares."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.sphere_forms import Forms
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.report.recovered import ray_errors, recovered_errors
from tbcad.rig.machine.machine import Machine
from tests.clients.rendered_rig import Rig


@dataclass(frozen=True)
class Group:
    """Figures of one kind: root mean squares of what was injected, of the error, of sigma."""

    name: str
    unit: str
    count: int
    injected: float
    error: float
    stated: float
    chi_square: float  # mean square of the errors in standard deviations


def true_machine(rig: Rig) -> Machine:
    """The rig as tbcad describes a machine: what weight turns and shifts is of each frame."""
    frames = range(len(rig.angle))
    give = Rotation.from_rotvec(rig.give[:, 3:])
    base = Rotation.from_rotvec(rig.angle[:, None] * rig.axis)
    about = (base * give * base.inv()).as_rotvec() @ rig.axis
    turned = Rotation.from_rotvec((rig.angle + about)[:, None] * rig.axis)
    turn = Rotation.from_rotvec(rig.turn) * base * give * turned.inv()
    bare = Machine(
        camera=LensCamera(
            rig.pinhole, rig.axes, rig.focal, rig.principal, np.append(rig.lens, 0), *rig.size
        ),
        axis=rig.axis,
        axis_point=rig.point,
        angle=rig.angle + about,
        centre=rig.centre,
        radius=rig.radius,
        leds=rig.leds,
        turn=turn.as_rotvec(),
        shift=np.zeros((len(rig.angle), 3)),
        sag=np.stack(
            [
                give[f].inv().apply(rig.sag[f])
                + Rotation.from_rotvec(rig.seat_turn[f]).apply(rig.centre - rig.body)
                - (rig.centre - rig.body)
                for f in frames
            ]
        ),
        seat_turn=rig.seat_turn,
        forms=Forms(rig.terms, rig.across, rig.half),
    )
    first = 0 * np.arange(len(rig.angle))
    placed = np.stack([rig.placed(f, rig.centre)[0] for f in frames])
    return replace(bare, shift=placed - bare.centres(np.arange(len(first)), first))


def groups(result: MachineCalibration, rig: Rig) -> tuple[Group, ...]:
    """All groups of a calibration."""
    truth = true_machine(rig)
    found = [
        _group(one.name, one.unit, one.injected, one.recovered - one.injected, one.sigma)
        for one in recovered_errors(result, truth)
    ]
    known = result.rays.known
    every = ray_errors(result.found, truth, known.frame, known.sphere)
    for name, errors, of in zip(
        ("rays", "rays of one run"), every, (known.relative, known.in_run), strict=True
    ):
        sigma = np.sqrt(np.diagonal(of.covariance, axis1=1, axis2=2))
        for what, unit, some, factor in (
            ("place", "um", np.s_[:, :2], 1e3),
            ("direction", "mrad", np.s_[:, 2:], 1e3),
        ):
            figures = factor * errors[some].ravel(), factor * sigma[some].ravel()
            found.append(_group(f"{name}, {what}", unit, np.full(1, np.nan), *figures))
    return tuple(found)


def _group(
    name: str, unit: str, injected: np.ndarray, error: np.ndarray, sigma: np.ndarray
) -> Group:
    size = (float(np.sqrt(np.mean(one**2))) for one in (injected, error, sigma))
    return Group(name, unit, len(error), *size, float(np.mean((error / sigma) ** 2)))


def table(found: tuple[Group, ...]) -> str:
    """Rows of a table in Markdown."""
    return "\n".join(
        f"| {one.name}, {one.unit} | {one.count} | {one.injected:.3g} | {one.error:.3g} | "
        f"{one.stated:.3g} | {one.chi_square:.2f} |"
        for one in found
    )


POOLS = {
    "spheres": ("centres", "radii"),
    "forms of caps": ("forms",),
    "base in its frames": ("base angles", "axis", "balls' middle"),
    "camera and lens": ("camera's", "lens"),
    "LEDs": ("LEDs",),
    "rays": ("rays",),
}
"""Kinds of figures by what they are of, as names begin."""


def pooled(found: tuple[Group, ...]) -> dict[str, float]:
    """Chi-square of a figure in each of POOLS: figures of one kind share errors."""
    pools = {name: [one for one in found if one.name.startswith(of)] for name, of in POOLS.items()}
    return {
        name: sum(one.count * one.chi_square for one in some) / sum(one.count for one in some)
        for name, some in pools.items()
    }
