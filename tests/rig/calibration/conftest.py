"""A small prototype whose run is calibrated from simulated highlights."""

import pytest

from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.rig.calibration.calibrate import MachineCalibration, Setup, calibrate
from tbcad.rig.calibration.detection.detection import Detection
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.study import designed_setup
from tbcad.rig.machine.designed import BuiltPrototype, random_build
from tbcad.tolerancing.process.process import load_process, process_errors
from tbcad.tolerancing.prototype.gravity import weightless
from tests.rig.calibration.machines import every_highlight, small_machine, small_prior

ERRORS = process_errors(load_process("fdm"))
FAULT = "LED 3 never lights: its highlights are not used"


@pytest.fixture(scope="session")
def setup(export: ExportedDesign) -> Setup:
    return designed_setup(export)


@pytest.fixture(scope="session")
def prior() -> Prior:
    """Of five balls at six stops in two runs."""
    return small_prior(small_machine(stops=6))


@pytest.fixture(scope="session")
def built(setup: Setup) -> BuiltPrototype:
    none = weightless(setup.plan)
    return random_build(setup.designed, setup.plan, ERRORS, seed=3, gravity=none)


@pytest.fixture(scope="session")
def detection(built: BuiltPrototype) -> Detection:
    return Detection(every_highlight(built.machine, 5), {}, (FAULT,))


@pytest.fixture(scope="session")
def calibrated(setup: Setup, detection: Detection) -> MachineCalibration:
    return calibrate(setup, detection, setup.prior(ERRORS))
