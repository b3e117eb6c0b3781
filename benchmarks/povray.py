"""The same scene for POV-Ray: same pinhole, spheres, mesh and lamps, no shadows, no anti-aliasing.

POV-Ray stops at the first mirror and the object, as we do, and writes a PNG file. Pixels' centres
and axes are ours: it takes any three vectors for a camera.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from PIL import Image

from tbcad.core.optics.camera import Camera
from tbcad.light.simulate.parallel import THREADS
from tbcad.light.simulate.scene.object import GREY, SceneObject
from tbcad.light.simulate.scene.ray_casting import LAMP_LIGHT, LAMPS, SKY_LIGHT
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Floats

PROGRAM = "povray"
FAR_MM = 1e7
HEAD = """#version 3.7;
global_settings {{ assumed_gamma 1.0 max_trace_level 2 }}
#declare Mirror = texture {{
  pigment {{ color rgb 0 }} finish {{ ambient 0 diffuse 0 reflection {{ 1 }} }}
}};
#declare Wall = texture {{ pigment {{ color rgb 0 }} finish {{ ambient 0 diffuse 0 }} }};
#declare Matt = texture {{
  pigment {{ color rgb {grey} }} finish {{ ambient {sky} diffuse 1 }}
}};
#default {{ texture {{ Wall }} }}
"""


def installed() -> bool:
    """Whether there is a POV-Ray to compare with."""
    return shutil.which(PROGRAM) is not None


def write_scene(path: Path, at: Reflector, subject: SceneObject) -> None:
    """Write what one camera has before it; the object is of one grey."""
    parts = [
        HEAD.format(grey=GREY, sky=0.75 * SKY_LIGHT),
        _camera(at.camera),
        *(_lamp(*lamp) for lamp in zip(LAMPS, LAMP_LIGHT.tolist(), strict=True)),
        *_mirrors(at),
        _mesh(subject),
    ]
    path.write_text("".join(parts), encoding="utf-8")


def render(scene: Path, view: Camera) -> None:
    """Write the picture beside the scene, in as many threads as ours."""
    command = [PROGRAM, f"+I{scene.name}", f"+O{scene.stem}.png", "+FN", "-D", "-V", "-A", "-GA"]
    command += [f"+W{view.width_px}", f"+H{view.height_px}", f"+WT{THREADS}", "File_Gamma=1.0"]
    done = subprocess.run(
        command, cwd=scene.parent, capture_output=True, encoding="utf-8", check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")


def alike(one: Path, other: Path) -> float:
    """Share of pixels that show the object in both pictures or in neither, 0 to 1."""
    shown = [np.asarray(Image.open(file).convert("RGB")).any(axis=2) for file in (one, other)]
    return float(np.mean(shown[0] == shown[1]))


def _camera(view: Camera) -> str:
    half = view.half_sizes
    up = -np.cross(view.forward, view.right)
    axes = view.forward, 2 * half[0] * view.right, 2 * half[1] * up
    names = "direction", "right", "up"
    ways = " ".join(f"{name} {_vector(axis)}" for name, axis in zip(names, axes, strict=True))
    return f"camera {{ perspective location {_vector(view.pinhole)} {ways} }}\n"


def _lamp(way: Floats, light: float) -> str:
    aim = "parallel point_at 0 shadowless"
    return f"light_source {{ {_vector(FAR_MM * way)} color rgb {light!r} {aim} }}\n"


def _mirrors(at: Reflector) -> Iterable[str]:
    """Spheres; those that cross the seam or the foot are cut there, and the cut is black."""
    mirrors = at.mirrors
    if (mirrors.curvature <= 0).any():
        raise ValueError("mirrors that are no spheres")
    radius = 1 / mirrors.curvature
    centre = mirrors.apex - radius[:, None] * mirrors.normal
    inside = np.minimum(at.side * centre[:, 0], centre[:, 2] - at.foot) >= radius
    seam = f"plane {{ <{-at.side:g}, 0, 0>, 0 }}"
    foot = f"plane {{ <0, 0, -1>, {-at.foot!r} }}"
    for c, r, whole in zip(centre, radius.tolist(), inside.tolist(), strict=True):
        ball = f"sphere {{ {_vector(c)}, {r!r} texture {{ Mirror }} }}"
        yield f"{ball}\n" if whole else f"intersection {{ {ball} {seam} {foot} }}\n"


def _mesh(subject: SceneObject) -> str:
    points, normals = _list(subject.points), _list(subject.normals)
    faces = ",".join(f"<{a},{b},{c}>" for a, b, c in subject.faces.tolist())
    return (
        f"mesh2 {{ vertex_vectors {{ {points} }} normal_vectors {{ {normals} }}\n"
        f"face_indices {{ {len(subject.faces)}, {faces} }} texture {{ Matt }} }}\n"
    )


def _list(vectors: Floats) -> str:
    return f"{len(vectors)}, " + ",".join(map(_vector, vectors))


def _vector(vector: Floats) -> str:
    x, y, z = vector.tolist()
    return f"<{x!r}, {y!r}, {z!r}>"
