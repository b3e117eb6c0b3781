"""What is varied, and what a candidate is judged by.

The aim `ssim`, how like the truth views are, needs no file and no CAD kernel. Viewpoints, object
and method are those of `tbcad study ssim` without options, or with `--method field`, so that both
give the same figure. Real optics are rated by photographs of a quarter of the pixels, and half of
the viewpoints, which rank candidates alike (docs/decisions/0057-judged-by-real-optics.md).
"""

import json
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Literal, TypeAlias

import numpy as np
from pydantic import TypeAdapter, ValidationError

from tbcad.cad.formats.checked_files import parse_json
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.core.spec.design import FIT, Spec, spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.errors import InputError
from tbcad.light.reconstruction.picture import BY_FIELD
from tbcad.light.simulate.camera_photographs import design_light_field
from tbcad.light.simulate.capture.photograph import virtual_camera_pixels
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.real_scene import scene_by
from tbcad.light.simulate.views.viewpoints import (
    BY_NEAREST,
    ELEVATIONS_DEG,
    Viewpoints,
    ViewTargets,
    image_quality,
    pinhole_targets,
    viewpoints_around,
)
from tbcad.options.captures import Optics
from tbcad.types import Floats

AZIMUTHS, DISTANCE_MM = 4, 640.0
COARSER = 2  # of real photographs: pixels of the design along the sides of one
HALF_TURN_DEG = 180.0  # azimuths of their views below it: the others see the same mirrors mirrored

ViewsBy: TypeAlias = Literal["nearest", "field"]

_one_at_a_time = Lock()  # candidates that begin together share the truth
STEP_MM = 0.5  # of lengths: finer changes no figure that counts
STRETCH_STEP, STRETCH_DIGITS = 0.05, 2
STRETCH = (0.8, 2.0)  # least and largest that are tried
LEAST = 0.4  # of what the first design has, of all lengths
# At most, of the largest machine's longest side; a pinhole is on either side.
CAMERA_X, CAMERA_Z, SEMI_MINOR = 0.5, 0.8, 0.5
Place = tuple[float, float, float, float, float]
"""Camera's x and z, and the semi-minor axis, mm; stretch of the directions along x and y."""
SCHEMA = "tbcad-candidates/3"


def mean_ssim(design: MirrorDesign, method: ViewsBy = "nearest", optics: Optics = "real") -> float:
    """Mean SSIM of views over the frame, from the stated viewpoints."""
    with _one_at_a_time:
        truth = _truth(design.spec.optics.capture_diameter_mm, optics)
    by = BY_FIELD if method == "field" else BY_NEAREST
    picture_of = by.views(design_light_field(design, truth.scene, optics, COARSER))
    views = zip(truth.cameras, truth.truths, strict=True)
    return float(np.mean([image_quality(real, picture_of(at)).ssim for at, real in views]))


@cache
def _truth(capture_mm: float, optics: Optics) -> ViewTargets:
    """What pinhole cameras would see of the built-in object."""
    around = viewpoints_around(ELEVATIONS_DEG, AZIMUTHS, DISTANCE_MM)
    kept = around.azimuth_deg < (HALF_TURN_DEG if optics == "real" else 360)
    places = Viewpoints(around.elevation_deg[kept], around.azimuth_deg[kept], DISTANCE_MM)
    scene = scene_by(optics, built_in_object(capture_mm))
    return pinhole_targets(scene, places.cameras(capture_mm))


@dataclass(frozen=True)
class Figures:
    """What a design gives."""

    minimum_px: float  # pixels that show the capture sphere, of the virtual camera with fewest
    median_px: float  # of all virtual cameras
    mean_log_px: float  # mean of the natural logarithm of the pixels of all virtual cameras
    variation: float  # standard deviation of the pixels over their mean
    size_mm: float  # longest side of the box round all mirrors' apices and both pinholes
    view_angle_deg: float  # that the lenses need, across the columns
    ssim: float | None = None  # mean over the stated views; None where it was not measured


@dataclass(frozen=True)
class MachineLimits:
    """What a candidate may need at most."""

    size_mm: float  # longest side of the machine
    view_angle_deg: float

    def excess(self, figures: Figures) -> float:
        """By how much figures exceed the limits, relatively; 0 where they hold."""
        size = figures.size_mm / self.size_mm - 1
        angle = figures.view_angle_deg / self.view_angle_deg - 1
        return max(size, 0.0) + max(angle, 0.0)


@dataclass(frozen=True)
class DesignCandidate:
    """A place and what it gives."""

    place: Place
    figures: Figures | None  # None where it cannot be made
    reason: str = ""  # why it cannot, in one line


CANDIDATE = TypeAdapter(DesignCandidate)


def place_of(spec: Spec) -> Place:
    """What is varied, as a design has it."""
    x, _, z = spec.optics.camera_mm
    return x, z, spec.optics.semi_minor_mm, *spec.optics.stretch


def bounds(spec: Spec, size_mm: float) -> list[tuple[float, float]]:
    """Least and largest of each variable; the first design is within, whatever the size."""
    x, z, semi_minor, *stretch = place_of(spec)
    depth = max(CAMERA_Z * size_mm, -z)
    return [
        (LEAST * x, max(CAMERA_X * size_mm, x)),
        (-depth, LEAST * z),
        (LEAST * semi_minor, max(SEMI_MINOR * size_mm, semi_minor)),
        *((min(STRETCH[0], one), max(STRETCH[1], one)) for one in stretch),
    ]


def rounded(place: Floats) -> Place:
    """The nearest place on the grid."""
    x, z, semi_minor = (np.round(place[:3] / STEP_MM) * STEP_MM).tolist()
    steps = np.round(place[3:] / STRETCH_STEP) * STRETCH_STEP
    along_x, along_y = np.round(steps, STRETCH_DIGITS).tolist()
    return x, z, semi_minor, along_x, along_y


def placed(spec: Spec, place: Place) -> Spec:
    """A design with its camera, ellipsoid and directions elsewhere, and a lens that fits."""
    x, z, semi_minor, *stretch = place
    camera = (x, spec.optics.camera_mm[1], z)
    moved = spec_with(
        spec,
        optics={"camera_mm": camera, "semi_minor_mm": semi_minor, "stretch": tuple(stretch)},
        camera={"hfov_deg": FIT},
    )
    return Spec.model_validate(moved.model_dump(by_alias=True))


def evaluate(
    spec: Spec,
    ssim_within: MachineLimits | None,
    place: Place,
    method: ViewsBy = "nearest",
    optics: Optics = "real",
) -> DesignCandidate:
    """Design the mirrors of a place, count pixels, and compare views within limits, if given."""
    try:
        designed = design(placed(spec, place))
        figures = figures_of(designed)
        if ssim_within and ssim_within.excess(figures) == 0:
            figures = replace(figures, ssim=mean_ssim(designed, method, optics))
        return DesignCandidate(place, figures)
    except ValidationError as error:
        return DesignCandidate(place, None, error.errors()[0]["msg"])
    except SpecError as error:
        return DesignCandidate(place, None, str(error))


def figures_of(designed: MirrorDesign) -> Figures:
    """Figures of a design, of both halves together."""
    array, camera = designed.arrays[0], designed.spec.camera
    pixels = virtual_camera_pixels(array, designed.spec.optics.capture_diameter_mm / 2)
    return Figures(
        minimum_px=float(pixels.min()),
        median_px=float(np.median(pixels)),
        mean_log_px=float(np.log(np.maximum(pixels, 1)).mean()),
        variation=float(pixels.std() / pixels.mean()),
        size_mm=size_of(array),
        view_angle_deg=float(camera.hfov_deg),
    )


def size_of(array: MirrorArray) -> float:
    """Longest side of the box round all mirrors' apices and both pinholes, mm."""
    apex = array.apex_distance[:, None] * array.u
    points = np.vstack([apex, array.camera.pinhole])
    return float(max(2 * np.abs(points[:, 0]).max(), *np.ptp(points[:, 1:], axis=0)))


def store_bytes(key: str, judged: dict[Place, DesignCandidate]) -> bytes:
    """The file of candidates of the design with a key."""
    head = {"schema": SCHEMA, "design": key}
    rows = [head, *map(asdict, judged.values())]
    return "".join(json.dumps(row) + "\n" for row in rows).encode()


def read_store(store: Path, key: str) -> dict[Place, DesignCandidate]:
    """Judgements of an earlier search of the same key; none where there is no file."""
    if not store.exists():
        return {}
    try:
        head, *rows = map(parse_json, store.read_text(encoding="utf-8").splitlines())
        known = head["design"] == key
        found = [CANDIDATE.validate_python(row) for row in rows]
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise InputError(f"{store}: no list of candidates ({error}): remove it") from None
    if not known:
        raise InputError(
            f"{store}: of another design, method or optics: name another --out, or remove the file"
        )
    return {one.place: one for one in found}
