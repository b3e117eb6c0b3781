"""A camera's share of a light field of which only those pixels are traced that are read.

A view needs the pixels of some twenty mirrors: a whole picture would take ten times as long.
"""

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField, band_arrays
from tbcad.light.simulate.capture.photograph import CENTRE, RowBand, seen_by, to_bytes
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import Shift, TracedRays, part_tracer, unit_directions
from tbcad.light.simulate.scene.reflector import Reflector, reflectors

PartTracer = Callable[[range, range, Shift], TracedRays]


@dataclass(frozen=True)
class TracedFrame(CameraFrame):
    """A frame without arrays: its pixels are those of a photograph with one ray a pixel."""

    trace: PartTracer  # gives the rays of rows and columns after the mirrors
    scene: Scene  # the object

    def read(self, rows: slice, columns: slice = slice(None)) -> dict[str, NDArray[Any]]:
        """All arrays of a part of the picture, traced anew."""
        lines = range(*rows.indices(self.camera.height_px))
        across = range(*columns.indices(self.camera.width_px))
        direction = unit_directions(self.camera, lines)[:, across.start : across.stop]
        traced = self.trace(lines, across, CENTRE)
        rays, colour = seen_by(self.camera, traced, np.ascontiguousarray(direction), self.scene)
        return band_arrays(RowBand(lines, rays, to_bytes(colour)))


def traced_light_field(design: MirrorDesign, scene: Scene) -> LightField:
    """The light field of a design whose pixels are traced when they are read."""
    frames: dict[str, CameraFrame] = {
        one.camera_id: _frame(one, scene) for one in reflectors(design)
    }
    return LightField(frames, design.spec.optics.capture_diameter_mm, {})


def _frame(reflector: Reflector, scene: Scene) -> TracedFrame:
    return TracedFrame(
        reflector.camera,
        reflector.u,
        reflector.mirrors,
        reflector.boxes(),
        MappingProxyType({}),
        part_tracer(reflector),
        scene,
    )
