"""Recovered errors of a simulated build: figures, table, picture, and rays against the truth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import unit
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.estimate.parameters import Covariance, covariance
from tbcad.rig.calibration.estimate.solve import estimate
from tbcad.rig.calibration.report.record import angles_table, spheres_table
from tbcad.rig.calibration.report.recovered import (
    BESIDES,
    Kind,
    place_mm,
    ray_errors,
    recovered_errors,
    turn_mrad,
)
from tbcad.rig.machine.designed import BuiltPrototype
from tbcad.rig.machine.machine import Machine
from tests.rig.calibration.machines import drawn, every_highlight

AXES = ("x", "y", "z")
MACHINES = 24


@pytest.fixture(scope="module")
def known(calibrated: MachineCalibration) -> Covariance:
    return covariance(calibrated.found.prior, calibrated.found.information)


@pytest.fixture(scope="module")
def kinds(
    calibrated: MachineCalibration, known: Covariance, built: BuiltPrototype
) -> tuple[Kind, ...]:
    return recovered_errors(calibrated, known, built.machine)


def _named(kinds: tuple[Kind, ...], name: str) -> Kind:
    return next(kind for kind in kinds if kind.name == name)


def test_centres_and_angles_are_those_of_the_tables(
    kinds: tuple[Kind, ...],
    calibrated: MachineCalibration,
    known: Covariance,
    built: BuiltPrototype,
) -> None:
    assert len(kinds) == 11
    rows, centres = spheres_table(calibrated, known).records(), _named(kinds, "centres")
    for figure, name in (("recovered", "difference"), ("sigma", "sigma")):
        expected = [1000 * float(row[f"{name}_{axis}_mm"] or 0) for row in rows for axis in AXES]
        assert getattr(centres, figure) == pytest.approx(expected, rel=1e-6)
    off = built.machine.centre - calibrated.setup.designed.centre
    assert centres.injected == pytest.approx(1000 * off.ravel())
    angles, table = _named(kinds, "base angles"), angles_table(calibrated, known)
    assert angles.recovered == pytest.approx(table.column("difference_deg"))
    assert angles.sigma == pytest.approx(table.column("sigma_deg"))


def test_a_motion_and_growth_of_all_centres_is_taken_off(
    calibrated: MachineCalibration, known: Covariance, built: BuiltPrototype
) -> None:
    """A build that is moved, turned and larger has other errors, but not besides that."""
    true = built.machine
    turn = unit(np.array([1.0, 2.0, 3.0]))
    centre = 1.001 * rotated(true.centre, turn, np.full(len(true.centre), 1e-4)) + [0.1, 0.2, 0.0]
    one, other = (
        recovered_errors(calibrated, known, machine)
        for machine in (true, replace(true, centre=centre))
    )
    assert np.abs(_named(one, "centres").injected - _named(other, "centres").injected).max() > 100
    rest = _named(one, BESIDES).injected
    assert _named(other, BESIDES).injected == pytest.approx(rest, abs=0.5)
    assert np.abs(rest).max() > 10


def test_errors_of_rays_are_those_predicted(
    calibrated: MachineCalibration, built: BuiltPrototype
) -> None:
    rays = calibrated.rays.known
    errors = ray_errors(calibrated.found, built.machine, rays.frame, rays.sphere)
    for found, place, turn in (
        (errors.relative, rays.relative.place_mm, rays.relative.turn_mrad),
        (errors.in_run, rays.in_run.place_mm, rays.in_run.turn_mrad),
    ):
        for off, sigma in ((place_mm(found), place), (turn_mrad(found), turn)):
            assert np.sqrt((off**2).mean()) < 3 * np.sqrt((sigma**2).mean())


def test_a_rotation_of_the_whole_machine_is_not_an_error_within_a_run(
    calibrated: MachineCalibration,
) -> None:
    """But it is between both, where it is about a level axis: the object turns about z."""
    found, rays = calibrated.found, calibrated.rays.known
    errors = ray_errors(found, _turned(found.machine, 1e-3), rays.frame, rays.sphere)
    assert np.median(turn_mrad(errors.relative)) > 0.3
    assert turn_mrad(errors.in_run).max() < 0.01


def _turned(machine: Machine, angle: float) -> Machine:
    """About the direction x through the object's centre."""
    x = np.array([1.0, 0.0, 0.0])

    def turned(vectors: np.ndarray) -> np.ndarray:
        many = np.atleast_2d(vectors)
        return rotated(many, x, np.full(len(many), angle)).reshape(np.shape(vectors))

    camera = machine.camera
    places = ("axis", "axis_point", "centre", "leds")
    return replace(
        machine,
        camera=replace(camera, pinhole=turned(camera.pinhole), axes=turned(camera.axes)),
        shift=None if machine.shift is None else turned(machine.shift),
        **{name: turned(getattr(machine, name)) for name in places},
    )


@pytest.mark.slow
def test_errors_of_many_machines_are_normal(calibrated: MachineCalibration) -> None:
    """Machines drawn from the prior: every kind's errors, in their deviations, are as wide as 1.

    Figures of one machine share errors, so a kind's mean square varies as that of a few figures.
    """
    squares: dict[str, list[float]] = {}
    within: list[float] = []
    for seed in range(MACHINES):
        prior = calibrated.found.prior
        true = drawn(prior, 300 + seed)[1]
        found = estimate(prior, every_highlight(true, seed))
        known = covariance(prior, found.information)
        for kind in recovered_errors(replace(calibrated, found=found), known, true):
            squares.setdefault(kind.name, []).append(float((kind.sigmas_off**2).mean()))
            within.append(kind.within)
    low, high = chi2.ppf([1e-4, 1 - 1e-4], MACHINES) / MACHINES
    for name, values in squares.items():
        assert low < np.mean(values) < high, name
    assert np.mean(within) == pytest.approx(0.954, abs=0.05)
