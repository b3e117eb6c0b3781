"""The camera that the mount is made for: a body and a lens of the lists, and where they are.

Lengths are behind the pinhole along the optical axis, across, and out from the axis. The lens's
entrance pupil is at the pinhole.
"""

import difflib
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from tbcad.core.camera.lists import CameraBody, RectilinearLens, load_cameras, load_lenses
from tbcad.core.camera.requirements import camera_requirements
from tbcad.core.camera.sheet import Candidate, behind_pupil, candidates
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.spec.design import Spec, spec_with
from tbcad.core.spec.errors import SpecError, short_text
from tbcad.core.spec.prototype import FrameSpec, PrototypeSpec
from tbcad.core.spec.section import AUTO

NONE, WITH = "none", " with "
SCREW_MM = 50.0  # from the pinhole to the tripod thread of a camera that is not known
LENS_GAP_MM = 3.0  # between the lens and the camera plate
LEAST_RISER_MM = 3.0
OWN_KEYS = {"axis_mm": "camera_axis_mm", "thread_mm": "camera_screw_mm"}


@dataclass(frozen=True)
class ChosenCamera:
    """A body with a lens whose sizes are known, but for those that the spec's own keys have."""

    best: Candidate  # body and lens as the design sets them
    frame: FrameSpec  # with keys that are not "auto" where the user measured

    @property
    def name(self) -> str:
        """Of body and lens, as the key has it."""
        return f"{self.best.camera.name}{WITH}{self.best.lens.name}"

    @cached_property
    def unknown(self) -> tuple[str, ...]:
        """Sizes that neither the lists nor the spec have: columns, and keys in their place."""
        body, lens = self.best.camera, self.best.lens
        measured = {size: getattr(self.frame, key) != AUTO for size, key in OWN_KEYS.items()}
        sizes = ("body_width_mm", "body_height_mm", "body_depth_mm", "axis_mm", "thread_mm")
        missing = [one for one in sizes if getattr(body, one) is None and not measured.get(one)]
        missing += [one for one in ("diameter_mm", "length_mm") if getattr(lens, one) is None]
        return tuple(OWN_KEYS.get(one, one) for one in missing)

    @property
    def flange(self) -> float:
        """Behind the pinhole to the body's mount."""
        return behind_pupil(self.best.camera, self.best.lens) or 0.0

    @property
    def front(self) -> float:
        """Behind the pinhole to the lens's front: below 0."""
        body, lens = self.best.camera, self.best.lens
        return self.flange - lens.ring_mm(body.mount) - (lens.length_mm or 0.0)

    @property
    def back(self) -> float:
        """Behind the pinhole to the body's back."""
        return self.flange + (self.best.camera.body_depth_mm or 0.0)

    @property
    def lens_radius(self) -> float:
        """Of the lens's barrel at its widest."""
        return (self.best.lens.diameter_mm or 0.0) / 2

    @property
    def half_width(self) -> float:
        """Of the body."""
        return (self.best.camera.body_width_mm or 0.0) / 2

    @property
    def sizes(self) -> dict[str, float]:
        """Values of the frame's keys that are "auto"."""
        body = self.best.camera
        return {
            "camera_axis_mm": body.axis_mm or 0.0,
            "camera_screw_mm": self.flange + (body.thread_mm or 0.0),
            "camera_back_mm": self.back,
        }

    def has_room(self, prototype: PrototypeSpec) -> bool:
        """Whether it and its mount are where the room for a camera is."""
        radius, body = float(prototype.camera_diameter_mm) / 2, self.best.camera
        axis = body.axis_mm or 0.0
        high = max(axis, (body.body_height_mm or 0.0) - axis)
        reach = max(math.hypot(self.half_width, high), plate_face(axis, self.lens_radius))
        return reach <= radius and self.back <= prototype.camera_length_mm


def plate_face(axis: float, lens_radius: float) -> float:
    """Out from the optical axis to the camera plate, mm; `axis`: to what the body stands on.

    Where the lens would reach the plate, a riser is between body and plate.
    """
    needed = lens_radius + LENS_GAP_MM
    return axis if axis >= needed else max(needed, axis + LEAST_RISER_MM)


def chosen_camera(spec: Spec, array: MirrorArray) -> ChosenCamera | None:
    """The camera that the spec names, or with "auto" the best whose sizes are known and have room.

    SpecError: there is none of that name, it does not do, or its sizes are not known; it names one
    that does.
    """
    prototype, frame = spec.prototype, spec.prototype.frame
    if not prototype.camera_diameter_mm or frame.camera == NONE:
        return None
    cameras, lenses = _lists(frame)
    needed = camera_requirements(array, spec.optics.capture_diameter_mm / 2)
    every = [ChosenCamera(one, frame) for one in candidates(needed, cameras, lenses)]
    doing = [one for one in every if not (one.best.faults or one.unknown)]
    automatic = next((one for one in doing if one.has_room(prototype)), None)
    if frame.camera == AUTO:
        return automatic
    body, _, lens = frame.camera.partition(WITH)
    _check_listed(body, [one.name for one in cameras])
    if lens:
        _check_listed(lens, [one.name for one in lenses])
    named = [one for one in every if one.best.camera.name == body]
    named = [one for one in named if lens in ("", one.best.lens.name)]
    # Among those that do, one whose sizes are known.
    named.sort(key=lambda one: (len(one.best.faults), len(one.unknown)))
    fault = f"no lens of the list fits its mount{' but others' * bool(lens)}" if not named else ""
    if named and named[0].best.faults:
        fault = named[0].best.faults[0]
    elif named and named[0].unknown:
        missing = ", ".join(named[0].unknown)
        fault = f"{missing} not known: measure, and set the key of that name or add it to a list"
    if fault:
        nearest = automatic or next(iter(doing), None)
        does = f"; {nearest.name} does" if nearest else ""
        raise SpecError(f"prototype.frame.camera {short_text(body)}: {fault}{does}")
    return named[0]


def with_camera(spec: Spec, array: MirrorArray) -> Spec:
    """The spec with a value for each key of the camera; raises as `chosen_camera`."""
    prototype, frame = spec.prototype, spec.prototype.frame
    chosen = chosen_camera(spec, array)
    sizes = {
        "camera_axis_mm": float(prototype.camera_diameter_mm) / 2,
        "camera_screw_mm": SCREW_MM,
        "camera_back_mm": prototype.camera_length_mm,
    }
    sizes |= chosen.sizes if chosen else {}
    values = {key: value for key, value in sizes.items() if getattr(frame, key) == AUTO}
    named = {"camera": chosen.name if chosen else NONE}
    return spec_with(spec, prototype={"frame": frame.model_copy(update=values | named)})


def _lists(frame: FrameSpec) -> tuple[list[CameraBody], list[RectilinearLens]]:
    own = [Path(one) if one else None for one in (frame.cameras, frame.lenses)]
    return load_cameras(own[0]), load_lenses(own[1])


def _check_listed(name: str, names: list[str]) -> None:
    if name not in names:
        near = difflib.get_close_matches(name, names, 1, 0.0)
        raise SpecError(
            f"prototype.frame.camera: {short_text(name)} is not in the lists: add it to a list of "
            f"your own, or name another, for instance {near[0]}"
        )
