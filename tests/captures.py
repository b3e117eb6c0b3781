"""Fixtures of one capture, whatever its lamps are: a room imports those that it needs."""

from pathlib import Path

import pytest

from tbcad.light.simulate.capture.files import read_object
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene


@pytest.fixture(scope="session")
def scene(captured: Path) -> Scene:
    """What was captured."""
    return prepared_scene(read_object(captured))


@pytest.fixture(scope="session")
def field(captured: Path) -> LightField:
    """The light of it."""
    return LightField.read(captured)
