"""What errors of rays and of brightness cost the views of a field: a table in markdown.

Of a simulated capture: `python benchmarks/refinement.py captures/knot/ [--object FILE]`, some 20
seconds a row on two quiet cores (docs/decisions/0031-no-refinement-by-the-scene.md).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import radians
from pathlib import Path

import numpy as np

from tbcad.core.geometry.vectors import perpendicular_axes, unit
from tbcad.light.reconstruction.fit import fit
from tbcad.light.reconstruction.picture import field_picture
from tbcad.light.reconstruction.rays import CapturedRays, captured_rays, entries
from tbcad.light.reconstruction.start import Level, Settings
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.scene.object_from_file import load_object
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.views.refocus import pinhole_picture
from tbcad.light.simulate.views.viewpoints import image_quality
from tbcad.types import Floats

SETTINGS = Settings(levels=(Level(60, 2), Level(100, 3)))
VIEWS = ((10, 5), (70, 62), (130, 31), (190, 45), (250, 18), (310, 70))  # azimuth, elevation
DISTANCE_MM, SEED = 640.0, 1
MM, MRAD = 0.1, 1.0  # root mean square of each mirror's error, both ways across its rays together
TIMES = (1, 2, 4, 8)
GAINS = (0.01, 0.02, 0.05)

Change = Callable[[CapturedRays], CapturedRays]


def rows(source: LightField, scene: Scene) -> Iterator[str]:
    """Lines of the table: what is wrong, and what of the views is left."""
    rays = captured_rays(source)
    changes: list[tuple[str, Change]] = [("nothing", lambda right: right)]
    changes += [
        (f"each mirror's rays: {k * MM:g} mm, {k * MRAD:g} mrad", partial(mirrors_off, times=k))
        for k in TIMES
    ]
    for gain in GAINS:
        changes += [
            (f"brightness of each mirror: {gain:.0%}", partial(mirrors_brighter, gain=gain)),
            (f"brightness of camera a, b: ±{gain:.0%}", partial(cameras_brighter, gain=gain)),
        ]
    yield "| what is wrong | SSIM | lost | PSNR, dB |"
    yield "|---|---|---|---|"
    right = None
    for what, change in changes:
        ssim, psnr = quality(change(rays), scene)
        right = ssim if right is None else right
        yield f"| {what} | {ssim:.4f} | {right - ssim:.4f} | {psnr:.2f} |"


def mirrors_off(rays: CapturedRays, times: float) -> CapturedRays:
    """Rays of each mirror shifted and turned across one of them, at random."""
    count, random = int(rays.mirror.max()) + 1, np.random.default_rng(SEED)
    first = np.unique(rays.mirror, return_index=True)
    across = np.zeros((count, 2, 3))
    across[first[0]] = perpendicular_axes(rays.direction[first[1]].astype(np.float64))
    shift, turn = (
        np.einsum("mk,mkx->mx", size * random.standard_normal((count, 2)) / np.sqrt(2), across)
        for size in (times * MM, times * MRAD / 1000)
    )
    middle = rays.entry + rays.direction * (rays.length / 2)[:, None]
    direction = unit((rays.direction + turn[rays.mirror]).astype(np.float64))
    entry, length = entries(middle + shift[rays.mirror], direction, rays.capture_mm / 2)
    return replace(rays, entry=entry, direction=direction.astype(np.float32), length=length)


def mirrors_brighter(rays: CapturedRays, gain: float) -> CapturedRays:
    """Brightness of each mirror's rays changed at random."""
    drawn = np.random.default_rng(SEED).standard_normal(int(rays.mirror.max()) + 1)
    return _times(rays, 1 + gain * drawn[rays.mirror])


def cameras_brighter(rays: CapturedRays, gain: float) -> CapturedRays:
    """Camera a, the first half of the mirrors, darker, and camera b brighter."""
    return _times(rays, np.where(2 * rays.mirror <= rays.mirror.max(), 1 - gain, 1 + gain))


def _times(rays: CapturedRays, factor: Floats) -> CapturedRays:
    return replace(rays, colour=(rays.colour * factor[:, None]).astype(np.float32))


def quality(rays: CapturedRays, scene: Scene) -> Floats:
    """Mean SSIM and PSNR of views of a field against ray-traced ones, (2,)."""
    *_, last = fit(rays, SETTINGS)
    figures = []
    for azimuth, elevation in VIEWS:
        view = camera_around_object(
            radians(azimuth), radians(elevation), DISTANCE_MM, rays.capture_mm
        )
        truth = to_bytes(pinhole_picture(scene, view))
        found = image_quality(truth, field_picture(last.field(), view).image)
        figures.append((found.ssim, found.psnr_db))
    return np.asarray(np.mean(figures, axis=0))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="What errors of rays and brightness cost views.")
    parser.add_argument("capture", type=Path, help="folder of tbcad capture")
    parser.add_argument("--object", type=Path, help="what it shows (default: the built-in knot)")
    options = parser.parse_args()
    light_field = LightField.read(options.capture)
    shown = prepared_scene(load_object(options.object, light_field.capture_mm))
    for line in rows(light_field, shown):
        print(line, flush=True)
