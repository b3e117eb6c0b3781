"""Photographs of `real_machine` by Mitsuba and by Blender; by hand, for it takes minutes.

    python -m tests.clients.render_real mitsuba -
    python -m tests.clients.render_real blender PYTHON-WITH-BPY

Writes `rendered/real.npz`. Mirrors are exact spheres in both (Cycles renders points of a cloud as
spheres), the lens is their thin lens with the share of the pupil that rays go through, lamps are
area lights. Light meets one mirror, then the object, then a lamp. No code is shared with tbcad.
"""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter

from tbcad.core.optics.camera import Camera
from tbcad.light.simulate.scene.object import patterned_ball
from tests.clients.real_machine import (
    BALL_MM,
    CROP,
    FINE,
    INDEX,
    KEPT,
    LAMP_MM,
    LENS,
    LUMEN,
    RAY_SHARE,
    ROUGHNESS,
    SAMPLES,
    WHITE_LUX,
    at_pixels,
    compared,
    machine,
    mitsuba_mirrors,
    steps,
)

LAMP_RADIANCE = LUMEN / (np.pi * LAMP_MM[0] * LAMP_MM[1])  # lm / (sr mm^2)
# Material and lamps of each part of the light; the ball has one highlight in each mirror.
PARTS = {"matt": ("matt", range(6)), "gloss": ("gloss", range(6)), "ball": ("gloss", (4,))}
LAMP_SHOWS = 0.05  # of its luminance: brighter than the knot


def object_file(folder: Path, part: str) -> Path:
    """The knot, or the ball, with normals and colours."""
    one = patterned_ball(BALL_MM) if part == "ball" else machine().subject
    colours = np.zeros((len(one.points), 3))
    colours[one.faces] = one.albedo
    lines = ["ply", "format ascii 1.0", f"element vertex {len(one.points)}"]
    lines += [f"property float {name}" for name in ["x", "y", "z", "nx", "ny", "nz", "r", "g", "b"]]
    lines += [f"element face {len(one.faces)}", "property list uchar int vertex_indices"]
    body = [
        " ".join(f"{x:.9g}" for x in row) for row in np.hstack([one.points, one.normals, colours])
    ]
    body += [f"3 {a} {b} {c}" for a, b, c in one.faces.tolist()]
    path = folder / f"{part}.ply"
    path.write_text("\n".join([*lines, "end_header", *body]) + "\n")
    return path


@dataclass(frozen=True)
class Before:
    """A camera, the part of its picture that is rendered, and mirrors as Mitsuba's shapes."""

    camera: Camera
    crop: tuple[int, int, int, int]  # as `CROP`
    mirrors: dict[str, Any]


def by_mitsuba(
    mi: Any, mesh: Path, part: str, lamp: int, before: Before | None = None
) -> np.ndarray:
    """Luminance (2 h, 2 w, 3) of one part of the light of a lamp, lm / (sr mm^2)."""
    one = machine()
    of_shell = Before(one.reflector.camera, CROP, mitsuba_mirrors(one.reflector.mirrors))
    before = before or of_shell
    camera = before.camera
    turned = mi.ScalarTransform4f()
    ahead = (camera.pinhole + camera.forward).tolist()
    film: dict[str, Any] = {"type": "hdrfilm", "component_format": "float32"}
    film |= {"width": FINE * camera.width_px, "height": FINE * camera.height_px}
    names = "crop_offset_x", "crop_offset_y", "crop_width", "crop_height"
    film |= {name: FINE * value for name, value in zip(names, before.crop, strict=True)}
    shapes = dict(before.mirrors)
    place, way = one.lamps.places[lamp], one.lamps.inward[lamp]
    look = turned.look_at(place.tolist(), (place + way).tolist(), [0, 0, 1])
    shapes["lamp"] = {
        "type": "rectangle",
        "to_world": look.scale([LAMP_MM[0] / 2, LAMP_MM[1] / 2, 1]),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": LAMP_RADIANCE}},
    }
    matt = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}
    black = {"type": "rgb", "value": 0.0}
    gloss = {"type": "principled", "base_color": black, "roughness": ROUGHNESS, "eta": INDEX}
    shapes["object"] = {
        "type": "ply",
        "filename": str(mesh),
        "bsdf": matt if PARTS[part][0] == "matt" else gloss,
    }
    sensor = {
        "type": "thinlens",
        "aperture_radius": RAY_SHARE * LENS.pupil_mm / 2,
        "focus_distance": LENS.focus_mm,
        "fov": float(np.degrees(camera.hfov)),
        "near_clip": 1.0,
        "far_clip": 1e4,
        "to_world": turned.look_at(camera.pinhole.tolist(), ahead, (-camera.axes[1]).tolist()),
        "film": {**film, "rfilter": {"type": "box"}},
        "sampler": {"type": "stratified", "sample_count": SAMPLES},
    }
    path = {"type": "path", "max_depth": 3, "rr_depth": 100}
    scene = mi.load_dict({"type": "scene", "integrator": path, "sensor": sensor, **shapes})
    return np.array(mi.render(scene, seed=lamp))[..., :3]


def by_blender(python: str, meshes: dict[str, Path], folder: Path) -> dict[str, np.ndarray]:
    """The same of all parts, by a process of its own."""
    one = machine()
    camera, mirrors = one.reflector.camera, one.reflector.mirrors
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([camera.axes[0], -camera.axes[1], -camera.axes[2]], axis=1)
    matrix[:3, 3] = camera.pinhole
    told = {
        "centre": mirrors.centre.tolist(),
        "radius": mirrors.radius.tolist(),
        "matrix": matrix.tolist(),
        "angle": float(camera.hfov),
        "size": [FINE * camera.width_px, FINE * camera.height_px],
        "crop": [FINE * value for value in CROP],
        "samples": SAMPLES,
        "aperture_mm": RAY_SHARE * LENS.pupil_mm,
        "focus_mm": LENS.focus_mm,
        "lamps": [one.lamps.places.tolist(), one.lamps.inward.tolist()],
        "lamp_mm": LAMP_MM,
        "radiance": LAMP_RADIANCE,
        "roughness": ROUGHNESS,
        "index": INDEX,
        "parts": {p: (str(mesh), PARTS[p][0], list(PARTS[p][1])) for p, mesh in meshes.items()},
        "out": str(folder),
    }
    (folder / "scene.json").write_text(json.dumps(told))
    script = Path(__file__).with_name("blender_photograph.py")
    subprocess.run([python, script, folder / "scene.json"], check=True)
    return {part: np.load(folder / f"{part}.npy") for part in meshes}


def without_lamps(seen: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Pictures whose pixels that show the lamp itself are black, (l, 2 h, 2 w, 3) each, summed."""
    result = {}
    for part, one in seen.items():
        dull = seen["matt"] if part == "gloss" else one
        shows = dull.max(axis=-1) > LAMP_SHOWS * LAMP_RADIANCE
        near = np.array([maximum_filter(lamp, 3) for lamp in shows])
        result[part] = np.where(near[..., None], 0, one).sum(axis=0)
    return result


def main(renderer: str, python: str, *parts: str) -> None:
    """Render parts, lamp by lamp, and keep them beside those of the other renderer."""
    with TemporaryDirectory() as temp:
        meshes = {part: object_file(Path(temp), part) for part in parts or PARTS}
        if renderer == "mitsuba":
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
            found = {
                part: np.array([by_mitsuba(mi, mesh, part, lamp) for lamp in PARTS[part][1]])
                for part, mesh in meshes.items()
            }
        else:
            found = by_blender(python, meshes, Path(temp))
    old = dict(np.load(KEPT)) if KEPT.exists() else {}
    # A matt white surface in 1 lm / mm^2 has a luminance of 1 / pi: kept are levels for WHITE_LUX.
    full = np.pi * 255 / (1e-6 * WHITE_LUX)
    for part, light in without_lamps(found).items():
        levels = np.where(compared()[..., None] > 0, at_pixels(full * light), 0)
        old[f"{renderer}_{part}"] = steps(levels if part == "matt" else levels[..., 0])
    np.savez_compressed(KEPT, **old)


if __name__ == "__main__":
    main(*sys.argv[1:])
