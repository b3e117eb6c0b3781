"""Machines drawn from a prior, and their noisy highlights, for tests."""

import numpy as np

from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.camera import Camera, without_distortion
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.priors import prototype_prior
from tbcad.rig.machine.designed import sag_motion
from tbcad.rig.machine.machine import Highlights, Machine
from tbcad.tolerancing.process.process import load_process, process_errors

PINHOLE = np.array([100.0, 0.0, -100.0])
AXIS = unit(np.array([1.0, 0.0, -1.0]))
FORWARD = unit(np.array([0.05, 0.0, 1.0]))
LEDS = np.array([[18.8, 14.0, -8.0], [14.6, -18.3, -8.0], [-10.4, -20.9, -4.7], [-5.8, 22.7, -0.5]])
NOISE_PX = 0.05
DISTANCE, FOCAL_SUM = 245.0, 141.4  # mm: major axis of the ellipsoid, distance of its foci


def small_machine(balls: int = 5, stops: int = 12, leds: int = 4) -> Machine:
    """Balls at different angles on a base, photographed at a few stops in two runs."""
    polar = np.radians(np.linspace(60, 115, balls))
    azimuth = np.radians(np.linspace(-40, 40, balls) * (-1) ** np.arange(balls))
    zero = unit(np.array([1.0, 0.0, 1.0]))
    third = np.cross(AXIS, zero)
    along, around = np.cos(polar)[:, None], np.sin(polar)[:, None]
    u = along * AXIS + around * (np.cos(azimuth)[:, None] * zero + np.sin(azimuth)[:, None] * third)
    half, focus = DISTANCE / 2, FOCAL_SUM / 2
    apex = u * ((half**2 - focus**2) / (half - focus * along))
    radius = np.linspace(10, 25, balls)
    normal = unit(unit(-u) + unit(PINHOLE - apex))
    camera = Camera(PINHOLE, FORWARD, np.array([0.0, -1.0, 0.0]), 2080, 1552, 1.55)
    return Machine(
        camera=without_distortion(camera),
        axis=AXIS,
        axis_point=np.zeros(3),
        angle=np.tile(np.radians(np.linspace(-50, 50, stops)), 2),
        centre=apex - radius[:, None] * normal,
        radius=radius,
        leds=LEDS[:leds],
    )


def small_prior(machine: Machine, process: str = "fdm") -> Prior:
    """Its prior; the last ball is a cap on a smaller body, and weight bends the base."""
    arm = np.where(np.arange(len(machine.radius)) == len(machine.radius) - 1, 8.0, 0.0)
    series = np.repeat([0, 1], len(machine.angle) // 2)
    down = np.stack([np.cos(machine.angle), np.sin(machine.angle)], axis=1)
    bends = np.random.default_rng(0).normal(0, 0.4, (2, len(arm), 3, 2))
    bent = np.einsum("pkxa,fa->pfkx", bends, down)
    bodies = seats(machine, arm)
    moved = [sag_motion(machine, bodies, one, 3e-3 * one[:, ::-1]) for one in bent]
    errors = process_errors(load_process(process))
    return prototype_prior(machine, moved, errors, bodies, series)


def outward(machine: Machine) -> np.ndarray:
    """Unit normals at the apices of its spheres, (k, 3)."""
    return unit(unit(-machine.centre) + unit(PINHOLE - machine.centre))


def seats(machine: Machine, arm: np.ndarray) -> np.ndarray:
    """Centres of bodies in front of their spheres' by arms (k,), mm, (k, 3)."""
    return machine.centre + arm[:, None] * outward(machine)


def drawn(prior: Prior, seed: int) -> tuple[np.ndarray, Machine]:
    """Parameters drawn from a prior, and their machine."""
    values = np.random.default_rng(seed).standard_normal(len(prior.free))
    return values, prior.machine(values)


def every_highlight(machine: Machine, seed: int, noise: float = NOISE_PX) -> Highlights:
    """All that are in the picture and on the side of the balls that the camera sees."""
    shape = (len(machine.angle), len(machine.radius), len(machine.leds))
    frame, sphere, led = (one.ravel() for one in np.indices(shape))
    exact = machine.highlights(frame, sphere, led)
    size = np.array([machine.camera.width_px, machine.camera.height_px])
    seen = ((exact > 0) & (exact < size - 1)).all(axis=1)
    noisy = exact[seen] + noise * np.random.default_rng(seed).standard_normal((seen.sum(), 2))
    return Highlights(frame[seen], sphere[seen], led[seen], noisy, np.full(seen.sum(), noise))
