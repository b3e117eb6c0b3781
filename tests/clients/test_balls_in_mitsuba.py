"""A stop of a small prototype, n = 4 with six caps, photographed by Mitsuba as well.

Fronts of caps are fine meshes with the spheres' own normals there; the lens is a thin lens, lamps
are area lights. No code is shared with tbcad.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from tbcad.core.optics.lamp_light import RectangularLamps
from tbcad.light.simulate.capture.real import RealOptics, with_halo
from tbcad.light.simulate.prototype.real_balls import BallView, ball_light
from tbcad.light.simulate.prototype.run import prototype_runs, read_plan
from tbcad.light.simulate.scene.object import SceneObject, patterned_ball
from tbcad.light.simulate.scene.real_scene import real_scene
from tbcad.types import Bools, Floats, Ints
from tests.clients.real_machine import (
    BALL_MM,
    LENS,
    NEAR_MM,
    RAY_SHARE,
    ROUGHNESS,
    WHITE_LUX,
    at_pixels,
    machine,
    shown,
)
from tests.clients.render_real import Before, by_mitsuba, object_file, without_lamps

pytestmark = pytest.mark.clients
STOP, SMALLER, EDGE_PX, LAMP = 5, 2, 7, 4
RINGS, SPOKES = 60, 240  # of a front's mesh


@dataclass(frozen=True)
class Photographed:
    """A camera before the caps of a stop."""

    view: BallView
    folder: Path
    mi: Any

    @cached_property
    def compared(self) -> Ints:
        """Ball (h, w), from 1, of pixels near the object and off edges; 0 of all others."""
        camera = self.view.camera
        pixels = np.arange(camera.height_px * camera.width_px)
        hits = self.view.hits(camera.pinhole, camera.directions(self.view.centres(pixels)))
        near = np.linalg.norm(np.cross(hits.origin, hits.direction), axis=1) < NEAR_MM
        ball = hits.ball.reshape(camera.height_px, camera.width_px)
        inner = minimum_filter(ball, EDGE_PX) == maximum_filter(ball, EDGE_PX)
        return np.where(near.reshape(ball.shape) & inner, ball, 0)

    def ours(self, subject: SceneObject, lamps: RectangularLamps, gloss: float | None) -> Floats:
        """Levels (h, w, 3) without scatter and noise."""
        scene, camera = real_scene(machine().export, subject, lamps, gloss), self.view.camera
        optics = RealOptics(LENS, 1.0, np.zeros(1), ray_share=RAY_SHARE)
        every = np.arange(camera.height_px * camera.width_px)
        light = ball_light(self.view, scene, optics, every)
        whole = light.reshape(camera.height_px, camera.width_px, 3)
        return with_halo(whole, optics.kernel(self.view.pinhole_camera)) * shown(scene, lamps)

    def theirs(self, part: str, lamps: list[int]) -> Floats:
        """The same by Mitsuba."""
        camera = self.view.pinhole_camera
        fronts = {f"front_{k}": front(self.folder, k, b) for k, b in enumerate(self.view.balls)}
        first, last = (at(np.argwhere(self.compared > 0), axis=0) for at in (np.min, np.max))
        top, left = np.maximum(first - EDGE_PX, 0)
        size = np.array(self.compared.shape) - [top, left]
        rows, columns = np.minimum(last + EDGE_PX - [top, left], size)
        before = Before(camera, (int(left), int(top), int(columns), int(rows)), fronts)
        mesh = object_file(self.folder, part)
        light = {part: np.array([by_mitsuba(self.mi, mesh, part, k, before) for k in lamps])}
        full = np.pi * 255 / (1e-6 * WHITE_LUX)
        whole = np.zeros((*self.compared.shape, 3))
        seen = at_pixels(full * without_lamps(light)[part], camera)
        whole[top : top + rows, left : left + columns] = seen
        return whole


def front(folder: Path, number: int, ball: Floats) -> dict[str, Any]:
    """What of a cap's sphere is within its body, as a mesh that reflects all."""
    centre, radius, body, body_radius = ball[:3], ball[3], ball[4:7], ball[7]
    away = np.linalg.norm(body - centre)
    axis = (body - centre) / away
    widest = np.arccos((radius**2 + away**2 - body_radius**2) / (2 * radius * away))
    first = np.linalg.svd(axis[None])[2][1]
    second = np.cross(axis, first)
    angle, turn = np.meshgrid(
        widest * np.arange(1, RINGS + 1) / RINGS, 2 * np.pi * np.arange(SPOKES) / SPOKES
    )
    flat = np.cos(turn)[..., None] * first + np.sin(turn)[..., None] * second
    normal = np.cos(angle)[..., None] * axis + np.sin(angle)[..., None] * flat
    normal = np.concatenate([axis[None], normal.transpose(1, 0, 2).reshape(-1, 3)])
    k = np.arange(SPOKES)
    after = (k + 1) % SPOKES
    faces = [np.stack([0 * k, 1 + k, 1 + after], axis=1)]
    for ring in range(RINGS - 1):
        low, high = 1 + ring * SPOKES, 1 + (ring + 1) * SPOKES
        faces += [np.stack([low + k, high + k, high + after], axis=1)]
        faces += [np.stack([low + k, high + after, low + after], axis=1)]
    points, every = np.hstack([centre + radius * normal, normal]), np.concatenate(faces)
    path = folder / f"front_{number}.ply"
    names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{names}"
    head += f"element face {len(every)}\nproperty list uchar int vertex_indices\nend_header\n"
    body_text = "".join(" ".join(f"{x:.9g}" for x in row) + "\n" for row in points)
    path.write_text(head + body_text + "".join(f"3 {a} {b} {c}\n" for a, b, c in every.tolist()))
    return {
        "type": "ply",
        "filename": str(path),
        "bsdf": {"type": "conductor", "material": "none"},
    }


@pytest.fixture(scope="module")
def photographed(tmp_path_factory: pytest.TempPathFactory) -> Photographed:
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    export = machine().export
    run = prototype_runs(export.reflectors, read_plan(export))[0]
    camera = run.camera
    size = camera.width_px // SMALLER, camera.height_px // SMALLER
    middle = (np.array(size) - 1) / 2
    names = "principal", "focal", "width_px", "height_px"
    small = dict(zip(names, (middle, camera.focal / SMALLER, *size), strict=True))
    camera = replace(camera, **small)
    view = BallView(camera, run.balls[STOP], camera.directions)
    return Photographed(view, tmp_path_factory.mktemp("fronts"), mi)


def edges(picture: Floats, own: Bools) -> float:
    """How sharp a picture is there: root mean square of differences of pixels, over its own."""
    light = picture.mean(axis=-1) if picture.ndim == 3 else picture
    across = np.diff(light, axis=1)[own[:, 1:] & own[:, :-1]]
    return float(np.sqrt(np.mean(across**2) / np.mean(light[own] ** 2)))


def one_lamp() -> RectangularLamps:
    lamps = machine().lamps
    return replace(lamps, places=lamps.places[[LAMP]], inward=lamps.inward[[LAMP]])


def test_light_and_shadows_in_caps(photographed: Photographed) -> None:
    ours = photographed.ours(machine().subject, one_lamp(), None)
    theirs = photographed.theirs("matt", [LAMP])
    lit = (photographed.compared > 0) & (np.maximum(ours, theirs).max(axis=2) > 10)
    apart = (ours - theirs)[lit]
    assert lit.sum() > 500
    assert abs(apart.mean()) < 1
    assert np.sqrt(np.mean(apart**2)) < 5  # of 27
    assert edges(ours, lit) == pytest.approx(edges(theirs, lit), rel=0.05)


def test_highlights_in_caps_are_where_theirs_are(photographed: Photographed) -> None:
    one, ball = one_lamp(), patterned_ball(BALL_MM)
    shiny, matt = (photographed.ours(ball, one, gloss)[..., 0] for gloss in (ROUGHNESS, None))
    ours, theirs = shiny - matt, photographed.theirs("ball", [LAMP])[..., 0]
    apart = []
    for number in range(1, len(photographed.view.balls) + 1):
        own = photographed.compared == number
        if theirs[own].max(initial=0) > 50:
            middles = [
                np.average(np.argwhere(own), axis=0, weights=np.maximum(light[own], 0))
                for light in (ours, theirs)
            ]
            apart.append(middles[0] - middles[1])
    assert len(apart) >= 2
    assert np.sqrt(np.mean(np.square(apart))) < 0.05
