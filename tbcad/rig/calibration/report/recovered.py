"""Recovered errors of a simulated build next to those that were injected."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array, eye_array
from scipy.sparse import kron as kron_array
from scipy.spatial.transform import Rotation

from tbcad.common.results import Table
from tbcad.core.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.core.optics.reflection import reflected_rays
from tbcad.core.optics.sphere_forms import TERM_COUNT, ray_reach, surface_normals
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.estimate.parameters import Block
from tbcad.rig.calibration.estimate.slopes import (
    Slopes,
    base_slopes,
    camera_turns,
    covariances,
    sphere_slopes,
)
from tbcad.rig.calibration.estimate.solve import Estimate
from tbcad.rig.calibration.report.record import angle_sigmas
from tbcad.rig.calibration.uncertainty import FIGURES, motion_fit, shared_motions
from tbcad.rig.machine.designed import is_cap
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats, Ints

MICROMETRES, MILLI = 1000.0, 1000.0
SIGMAS = 2.0
LENS = (Block.FOCAL, Block.PRINCIPAL, Block.DISTORTION)
BESIDES = "centres after similarity alignment"


@dataclass(frozen=True)
class Kind:
    """Errors of one kind, over n figures."""

    name: str  # what they are of
    unit: str  # of all three
    injected: Floats  # by which the build differs from the design, (n,)
    recovered: Floats  # by which the calibrated machine does, (n,)
    sigma: Floats  # standard deviation that the calibration gives, (n,)

    @property
    def sigmas_off(self) -> Floats:
        """Errors of the calibration in its standard deviations, (n,)."""
        return (self.recovered - self.injected) / self.sigma

    @property
    def within(self) -> float:
        """Share within two standard deviations."""
        return float((np.abs(self.sigmas_off) <= SIGMAS).mean())


def recovered_errors(result: MachineCalibration, truth: Machine) -> tuple[Kind, ...]:
    """Errors by kind, against the true machine with the same frames; none that are fixed."""
    designed, prior = result.setup.designed, result.found.prior
    caps, rest = is_cap(result.setup.plan), _besides_motion(designed.centre)
    spheres, besides = _sphere_sigmas(result, rest)
    width = np.concatenate([prior.sigma[block] for block in LENS])
    width = np.where(width > 0, width, 1.0)
    of, axes = result.found.sigmas(), designed.camera.axes
    lens = np.concatenate([of[block] for block in LENS])
    rows: tuple[tuple[str, str, float, Callable[[Machine], Floats], Floats], ...] = (
        ("centres", "um", MICROMETRES, lambda one: one.centre, spheres[:, :3]),
        (BESIDES, "um", MICROMETRES, lambda one: rest @ one.centre.ravel(), besides),
        ("radii of balls", "um", MICROMETRES, lambda one: one.radius[~caps], spheres[~caps, 3]),
        ("radii of caps", "um", MICROMETRES, lambda one: one.radius[caps], spheres[caps, 3]),
        ("forms of caps", "um", MICROMETRES, _terms, of[Block.FORM]),
        (
            *("base angles", "deg", 1.0),
            lambda one: np.degrees(one.angle),
            np.degrees(angle_sigmas(result.found)),
        ),
        ("axis", "mrad", MILLI, lambda one: one.axis @ prior.across.T, of[Block.TILT]),
        (
            *("balls' middle in each frame", "um", MICROMETRES),
            _middles,
            _middle_sigmas(result.found),
        ),
        ("camera's place", "um", MICROMETRES, lambda one: one.camera.pinhole, of[Block.PINHOLE]),
        (
            *("camera's direction", "mrad", MILLI),
            lambda one: Rotation.from_matrix(one.camera.axes @ axes.T).as_rotvec(),
            _direction_sigmas(result.found),
        ),
        ("lens", "deviations of the prior", 1.0, lambda one: _lens(one) / width, lens / width),
        ("LEDs", "um", MICROMETRES, lambda one: one.leds, of[Block.LEDS]),
    )
    machines = designed, truth, result.found.machine
    kinds = []
    for name, measure, factor, figure, sigma in rows:
        every = [factor * np.ravel(one) for one in (*map(figure, machines), sigma)]
        before, true, found, known_to = (one[every[-1] > 0] for one in every)
        if len(known_to):
            kinds.append(Kind(name, measure, true - before, found - before, known_to))
    return tuple(kinds)


def recovered_table(kinds: tuple[Kind, ...]) -> Table:
    """All errors, one a row."""
    columns: dict[str, ArrayLike] = {
        "kind": [kind.name for kind in kinds for _ in kind.sigma],
        "unit": [kind.unit for kind in kinds for _ in kind.sigma],
    }
    for name in ("injected", "recovered", "sigma", "sigmas_off"):
        columns[name] = np.concatenate([getattr(kind, name) for kind in kinds])
    return Table.of_columns("recovered", columns)


def _sphere_sigmas(result: MachineCalibration, rest: Floats) -> tuple[Floats, Floats]:
    """Of centres and radii, mm, (k, 4), and of centres after similarity alignment."""
    slopes = base_slopes(result.found.prior, result.found.values).matrix(result.found.prior)
    covariance = np.asarray(slopes @ (result.found.covariance @ slopes.T))
    sigma = np.sqrt(np.diag(covariance)).reshape(-1, 4)
    of_centres = np.arange(sigma.size).reshape(-1, 4)[:, :3].ravel()
    besides = rest @ covariance[np.ix_(of_centres, of_centres)] @ rest.T
    return sigma, np.sqrt(np.maximum(np.diag(besides), 0))


def _besides_motion(centre: Floats) -> Floats:
    """Takes a shift, rotation and growth of all centres (k, 3) off their errors, (3 k, 3 k)."""
    place = centre - centre.mean(axis=0)
    turns = [np.cross(one, place).ravel() for one in np.eye(3)]
    shifts = [np.broadcast_to(one, place.shape).ravel() for one in np.eye(3)]
    basis, _ = np.linalg.qr(np.stack([*shifts, *turns, place.ravel()], axis=1))
    return np.asarray(np.eye(place.size) - basis @ basis.T)


def _pairs(machine: Machine) -> tuple[Ints, Ints]:
    """Numbers of frame and sphere of all spheres in all frames, frame by frame, (f k,)."""
    frames, spheres = len(machine.angle), len(machine.radius)
    return np.repeat(np.arange(frames), spheres), np.tile(np.arange(spheres), frames)


def _middles(machine: Machine) -> Floats:
    """Mean of the spheres' centres in each frame, mm, (f, 3)."""
    centres = machine.centres(*_pairs(machine))
    return np.asarray(centres.reshape(-1, len(machine.radius), 3).mean(axis=1))


def _middle_sigmas(found: Estimate) -> Floats:
    """Of what `_middles` gives, mm, (f, 3)."""
    machine, spheres = found.machine, len(found.machine.radius)
    slopes = sphere_slopes(found.prior, found.values, machine, *_pairs(machine))
    mean = kron_array(eye_array(len(machine.angle)), np.full((1, spheres), 1 / spheres))
    by = kron_array(mean, eye_array(3)) @ slopes.matrix(found.prior)
    known = covariances(found.covariance, csr_array(by), 3)
    return np.asarray(np.sqrt(np.diagonal(known, axis1=1, axis2=2)))


def _direction_sigmas(found: Estimate) -> Floats:
    """Of the camera's rotation about its own axes, radians, (3,)."""
    turn, aim = camera_turns(found.prior, found.values)
    slopes = Slopes({}, {Block.CAMERA_TURN: turn[None], Block.PRINCIPAL: aim[None]})
    return np.asarray(np.sqrt(np.diag(found.covariances(slopes)[0])))


def _terms(machine: Machine) -> Floats:
    """Terms of the spheres' forms, mm, (k, t)."""
    none = np.zeros((len(machine.radius), TERM_COUNT))
    return none if machine.forms is None else machine.forms.terms


def _lens(machine: Machine) -> Floats:
    """As the parameters of a lens are: see Prior."""
    camera = machine.camera
    logarithm = np.log(camera.focal)
    focal = [logarithm.mean(), logarithm[0] - logarithm[1]]
    return np.concatenate([focal, camera.principal, camera.distortion])


def place_mm(errors: Floats) -> Floats:
    """Distances at the object's centre of errors (m, 4), mm, (m,)."""
    return norm(errors[:, :2])


def turn_mrad(errors: Floats) -> Floats:
    """Angles of errors (m, 4), mrad, (m,)."""
    return 1000 * norm(errors[:, 2:])


def ray_errors(found: Estimate, truth: Machine, frame: Ints, sphere: Ints) -> tuple[Floats, Floats]:
    """Errors of rays of spheres (m,) in frames (m,), through the pixels that show the centre.

    Place in mm, direction in radians, (m, 4): besides the motion of all rays that fits them best,
    and besides such a motion in each run.
    """
    machine = found.machine
    pixel = centre_pixels(machine, frame, sphere)
    _, direction = traced(machine, pixel, frame, sphere)
    start, true_direction = traced(truth, pixel, frame, sphere)
    across = perpendicular_axes(direction)
    away = at_plane(start, true_direction, direction), true_direction - direction
    errors = np.concatenate([(across @ one[..., None])[..., 0] for one in away], axis=1).ravel()
    relative, in_run = (
        (errors - motions @ (motion_fit(motions) @ errors)).reshape(-1, FIGURES)
        for motions in shared_motions(found.prior, frame, direction)
    )
    return relative, in_run


def traced(machine: Machine, pixel: Floats, frame: Ints, sphere: Ints) -> tuple[Floats, Floats]:
    """Points (m, 3) on spheres, and unit directions (m, 3) after them, of rays through pixels."""
    camera = machine.camera
    ray = camera.directions(pixel)
    centre, radius = machine.centres(frame, sphere), machine.radius[sphere]
    offset = centre - camera.pinhole
    along = dot(ray, offset)
    inside = radius**2 - dot(offset, offset) + along**2
    reach = along - np.sqrt(inside)
    if machine.forms is not None:
        form = machine.forms_in(frame, sphere)
        reach = ray_reach(camera.pinhole, ray, (centre, radius, form), reach)
    point = camera.pinhole + reach[:, None] * ray
    normal = unit(point - centre)
    if machine.forms is not None:
        normal = surface_normals(centre, point, form)
    return point, reflected_rays(camera.pinhole, point, normal)


def centre_pixels(machine: Machine, frame: Ints, sphere: Ints) -> Floats:
    """Pixels (m, 2) that show the object's centre."""
    lit = replace(machine, leds=np.zeros((1, 3)))
    return lit.highlights(frame, sphere, np.zeros_like(frame))


def at_plane(point: Floats, direction: Floats, normal: Floats) -> Floats:
    """Where lines meet planes through the origin, (m, 3)."""
    return np.asarray(point - (dot(point, normal) / dot(direction, normal))[:, None] * direction)
