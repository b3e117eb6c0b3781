"""Pictures of builds that are off: where their mirrors are, and what calibration gives back."""

from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.reflection import reflected_rays
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import camera_around_object, exact_tracer, reflect_pixels
from tbcad.light.simulate.scene.reflector import Reflector, reflectors
from tbcad.light.simulate.views.viewpoints import pinhole_targets
from tbcad.tolerancing.montecarlo.coverage import pointing
from tbcad.tolerancing.montecarlo.draws import draw
from tbcad.tolerancing.montecarlo.edge_model import edge_model
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.sharpness import (
    BuiltReflector,
    ReferenceViews,
    Sharpness,
    built_reflector,
    sharpness,
)

Cameras = tuple[Reflector, Reflector]

CAPTURE_MM = 60.0
SIZE = (160, 120)
# All that a sphere stays a sphere under, and large: cells move by a tenth of their width.
LARGE = Errors(
    sphere_centre=Error(0.3),
    sphere_radius=Error(0.1),
    scale_isotropic=Error(0.01),
    shell_shift=Error(0.4),
    shell_tilt=Error(5e-3),
    camera_shift=Error(0.4),
    camera_tilt=Error(5e-3),
    camera_focal=Error(5e-3),
)


@pytest.fixture(scope="module")
def little() -> MirrorDesign:
    # The corners of a wider lens see past the array: looked for everywhere, a mirror is found
    # there on the far side of its sphere.
    options = ["n=4", "camera.width_px=416", "camera.height_px=310", "hfov_deg=89"]
    return design(load_spec(None, options))


@pytest.fixture(scope="module")
def cameras(little: MirrorDesign) -> Cameras:
    return reflectors(little)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return prepared_scene(built_in_object(CAPTURE_MM))


@pytest.fixture(scope="module")
def reference(scene: Scene) -> ReferenceViews:
    places = [(0.3, np.radians(60)), (2.0, np.radians(35))]
    views: list[Camera] = [
        camera_around_object(a, e, 640.0, CAPTURE_MM, size=SIZE) for a, e in places
    ]
    return ReferenceViews(CAPTURE_MM, views, pinhole_targets(scene, views).truths)


def builds(cameras: Cameras, errors: Errors, count: int = 1):  # type: ignore[no-untyped-def]
    return draw(errors, 5, range(count), len(cameras[0]))


def numbers(at: Reflector) -> np.ndarray:
    return exact_tracer(at)(range(at.camera.height_px), (0.0, 0.0)).mirror


class WholeFrame(BuiltReflector):
    """Looks for every mirror in the whole picture."""

    def boxes(self) -> np.ndarray:
        return np.tile([0, self.camera.width_px, 0, self.camera.height_px], (len(self), 1))


class TestActual:
    @pytest.mark.parametrize("side", [0, 1])
    def test_without_errors_it_is_the_designed_one(self, cameras: Cameras, side: int) -> None:
        at, drawn = cameras[side], builds(cameras, Errors())[side]
        built = built_reflector(at, drawn, 0)
        for name in ("apex", "normal", "curvature"):
            close = pytest.approx(getattr(at.mirrors, name), abs=1e-12)
            assert getattr(built.mirrors, name) == close
        assert built.camera.hfov == pytest.approx(at.camera.hfov, abs=1e-14)
        assert np.array_equal(numbers(built), numbers(at))

    def test_boxes_hold_all_pixels(self, cameras: Cameras) -> None:
        """As if every mirror were looked for everywhere."""
        for at, drawn in zip(cameras, builds(cameras, LARGE, 3), strict=True):
            for k in range(3):
                built = built_reflector(at, drawn, k)
                named = {field.name: getattr(built, field.name) for field in fields(built)}
                assert np.array_equal(numbers(built), numbers(WholeFrame(**named)))

    def test_rays_are_off_as_the_fast_model_says(self, cameras: Cameras) -> None:
        """The pixels that should show the apices, seen by the built camera after its mirrors."""
        for at, drawn in zip(cameras, builds(cameras, LARGE), strict=True):
            built, m = built_reflector(at, drawn, 0), len(at)
            ray = at.mirrors.apex - at.camera.pinhole
            way = (ray @ at.camera.axes.T * [1, 1, drawn.focal[0]]) @ built.camera.axes
            mirror = np.arange(1, m + 1, dtype=np.int32)[None]
            rays = reflect_pixels(built.camera.pinhole, way[None], built.mirrors, mirror)
            designed = reflected_rays(at.camera.pinhole, at.mirrors.apex, at.mirrors.normal)
            along = np.einsum("mx,mx->m", at.mirrors.apex, designed)
            aim = at.mirrors.apex - along[:, None] * designed
            missed = np.linalg.norm(np.cross(rays.origin[0] - aim, rays.direction[0]), axis=1)
            offset = pointing(edge_model(at), drawn)[0]
            assert missed == pytest.approx(offset, rel=1e-6, abs=1e-9)
            assert missed.min() > 0.01


@pytest.fixture(scope="module")
def found(cameras: Cameras, scene: Scene, reference: ReferenceViews) -> Callable[..., Sharpness]:
    """Sharpness of two builds with errors, and with what calibration leaves of them, rad."""

    def of(errors: Errors, residual: float = 0.0) -> Sharpness:
        return sharpness(cameras, builds(cameras, errors, 2), scene, reference, residual)

    return of


class TestSharpness:
    def test_without_errors_all_are_the_designed_one(self, found: Callable[..., Sharpness]) -> None:
        """But for rounding in the last digit of a ray that decides between two pixels."""
        same = found(Errors())
        assert same.designed.shape == (2,)
        assert same.uncalibrated.shape == same.calibrated.shape == (2, 2)
        for table in (same.uncalibrated, same.calibrated):
            assert table == pytest.approx(np.tile(same.designed, (2, 1)), abs=1e-4)
        assert 0.5 < same.designed.min() < same.designed.max() < 1
        roughly = found(Errors(), 0.02)  # that calibration leaves
        assert (roughly.calibrated < same.calibrated - 0.01).all()
        assert np.array_equal(roughly.uncalibrated, same.uncalibrated)

    def test_calibration_gives_back_what_errors_cost(self, found: Callable[..., Sharpness]) -> None:
        large = found(LARGE, 0.5e-3)
        assert (large.uncalibrated < large.calibrated).all()
        assert not np.array_equal(large.calibrated[0], large.calibrated[1])
        assert (large.uncalibrated < large.designed).all()
        lost = large.designed - large.uncalibrated
        assert (np.abs(large.calibrated - large.designed) < lost / 2).all()
