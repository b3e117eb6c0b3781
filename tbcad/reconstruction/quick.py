"""A coarse field in seconds, by which designs and studies judge their views."""

from collections.abc import Callable
from threading import Lock

from tbcad.optics.camera import Camera
from tbcad.reconstruction.field import Field
from tbcad.reconstruction.fit import Level, Settings, fit
from tbcad.reconstruction.picture import field_picture
from tbcad.reconstruction.rays import captured_rays
from tbcad.simulate.capture.light_field import LightField
from tbcad.simulate.views.viewpoints import OwnMethod
from tbcad.types import Bytes

QUICK = Settings(levels=(Level(36, 1), Level(64, 1)), batch=10_000)

_one_at_a_time = Lock()  # a fit takes all cores, and much memory


def quick_field(source: LightField) -> Field:
    """Fit a coarse field to all rays of a light field.

    Raises:
        InputError: none of them meets the capture sphere.
    """
    with _one_at_a_time:
        *_, last = fit(captured_rays(source), QUICK)
    return last.field()


def quick_views(source: LightField) -> Callable[[Camera], Bytes]:
    """What makes the picture (h, w, 3) of a camera from a coarse field."""
    made = quick_field(source)
    return lambda camera: field_picture(made, camera).image


BY_FIELD = OwnMethod("field", quick_views)
