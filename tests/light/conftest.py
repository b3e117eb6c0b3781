"""A small camera with all kinds of mirrors, an object, and the light field of it; any capture's."""

from pathlib import Path

import pytest

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.capture.files import read_object
from tbcad.light.simulate.capture.light_field import LightField, light_field_in_memory
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, read_export, reflectors
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.viewer.render import Renderer, light_field_renderer
from tests.ball_captures import ball, four  # noqa: F401 - fixtures

CAPTURE_MM = 60.0


@pytest.fixture(scope="session")
def exported(record: Path) -> ExportedDesign:
    return read_export(record)


@pytest.fixture(scope="session")
def cameras(low_resolution_design: MirrorDesign) -> tuple[Reflector, Reflector]:
    return reflectors(low_resolution_design)


@pytest.fixture(scope="session")
def knot() -> Scene:
    return prepared_scene(built_in_object(CAPTURE_MM))


@pytest.fixture(scope="session")
def light_field(cameras: tuple[Reflector, Reflector], knot: Scene) -> LightField:
    photographs = [(at, photograph(at.camera, exact_tracer(at), knot)) for at in cameras]
    return light_field_in_memory(photographs, CAPTURE_MM)


@pytest.fixture(scope="session")
def tiles(light_field: LightField) -> MirrorTiles:
    return MirrorTiles(light_field)


@pytest.fixture(scope="session")
def renderer(tiles: MirrorTiles) -> Renderer:
    return light_field_renderer(tiles)


@pytest.fixture(scope="session")
def scene(captured: Path) -> Scene:
    """What was captured, whatever its lamps are."""
    return prepared_scene(read_object(captured))


@pytest.fixture(scope="session")
def field(captured: Path) -> LightField:
    """The light of it."""
    return LightField.read(captured)
