"""A small light field and what renders it."""

import pytest

from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.viewer.render import Renderer
from tests.light.simulate.conftest import cameras, knot, light_field  # noqa: F401


@pytest.fixture(scope="session")
def renderer(light_field: LightField) -> Renderer:  # noqa: F811
    return Renderer(light_field)
