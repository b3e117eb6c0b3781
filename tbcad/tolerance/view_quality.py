"""How good views of a design are: SSIM of a few against ray-traced truth."""

from tbcad.mirrors.array import design
from tbcad.simulate.scene.object import built_in_object
from tbcad.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.simulate.scene.reflector import reflectors
from tbcad.simulate.views.viewpoints import ground_truths, viewpoints_around
from tbcad.spec.design import Spec
from tbcad.tolerance.montecarlo.sharpness import ReferenceViews, designed_ssim
from tbcad.types import Progress

# Elevations, azimuths and distance of the viewpoints.
VIEWPOINTS = ((20.0, 60.0), 2, 640.0)


def reference_views(
    scene: Scene, capture_mm: float, progress: Progress = lambda _: None
) -> ReferenceViews:
    """The views that are compared, with their truths."""
    views = viewpoints_around(*VIEWPOINTS).cameras(capture_mm)
    return ReferenceViews(capture_mm, views, ground_truths(scene, views, progress))


def view_ssims(specs: dict[str, Spec]) -> dict[str, float]:
    """Mean SSIM of views of the built-in object by designs of one capture diameter.

    Raises:
        SpecError: one of the designs cannot be made.
    """
    capture_mm = next(iter(specs.values())).optics.capture_diameter_mm
    scene = prepared_scene(built_in_object(capture_mm))
    reference = reference_views(scene, capture_mm)
    return {
        words: float(designed_ssim(reflectors(design(one)), scene, reference).mean())
        for words, one in specs.items()
    }
