"""Photographs: what each pixel sees, whether spheres and meshes agree, what hides what."""

from pathlib import Path

import numpy as np
import pytest

from tbcad.cad.formats.stl import write_stl
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.capture.photograph import Tracer, photograph, subpixel_shifts
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.light.simulate.scene.shell_meshes import mesh_tracer, read_shell_meshes
from tbcad.shell.files import camera_a_mesh

Cameras = tuple[Reflector, Reflector]


def picture(at: Reflector, scene: Scene, samples: int = 1) -> tuple[np.ndarray, np.ndarray]:
    bands = list(photograph(at.camera, exact_tracer(at), scene, samples))
    return (
        np.concatenate([band.colour for band in bands]),
        np.concatenate([band.rays.mirror for band in bands]),
    )


def test_a_pixel_sees_what_its_ray_sees(cameras: Cameras, knot: Scene) -> None:
    at = cameras[0]
    colour, mirror = picture(at, knot)
    rays = exact_tracer(at)(range(at.camera.height_px), (0.0, 0.0))
    seen = cast_rays(knot, rays.origin.reshape(-1, 3), rays.direction.reshape(-1, 3))
    on = mirror.ravel() > 0
    assert np.array_equal(np.rint(seen.colour[on]), colour.reshape(-1, 3)[on])
    assert colour.reshape(-1, 3)[on].any(axis=1).sum() > 1000


def test_the_object_hides_what_is_behind_it(cameras: Cameras, knot: Scene) -> None:
    """Where the camera sees the object directly there is a colour and no mirror's ray."""
    at = cameras[0]
    colour, mirror = picture(at, knot)
    direct = colour.any(axis=2) & (mirror == 0)
    assert direct.sum() > 100
    middle = np.argwhere(direct).mean(axis=0)
    # The middle of the object appears where the camera sees the origin, above the seam.
    way = -at.camera.pinhole
    down = np.cross(at.camera.forward, at.camera.right)
    x, y = (way @ at.camera.right, way @ down) / (way @ at.camera.forward)
    expected = np.array([y, x]) / (2 * at.camera.half_sizes[0] / at.camera.width_px)
    size = (np.array([at.camera.height_px, at.camera.width_px]) - 1) / 2
    assert np.abs(middle - size - expected)[1] < 5
    assert middle[0] < at.camera.height_px / 4


def test_anti_aliasing_is_the_mean_of_finer_pixels(cameras: Cameras, knot: Scene) -> None:
    at = cameras[1]
    fine = [
        np.concatenate(
            [band.colour for band in photograph(at.camera, _shifted(at, shift), knot)]
        ).astype(float)
        for shift in subpixel_shifts(2)
    ]
    smooth, mirror = picture(at, knot, 2)
    on = mirror > 0
    assert np.abs(smooth - np.mean(fine, axis=0))[on].max() <= 1.0
    plain, same = picture(at, knot)
    assert np.array_equal(mirror, same)  # rays are those of the pixels' centres
    assert not np.array_equal(plain, smooth)


def _shifted(at: Reflector, shift: tuple[float, float]) -> Tracer:
    trace = exact_tracer(at)
    return lambda rows, _: trace(rows, shift)


def test_subpixel_shifts_are_even() -> None:
    assert subpixel_shifts(1) == [(0.0, 0.0)]
    assert sorted(subpixel_shifts(2)) == [
        (-0.25, -0.25),
        (-0.25, 0.25),
        (0.25, -0.25),
        (0.25, 0.25),
    ]
    assert np.mean(subpixel_shifts(5), axis=0) == pytest.approx([0, 0])


@pytest.fixture(scope="module")
def with_meshes(
    low_resolution_design: MirrorDesign,
    record: Path,
    exported: ExportedDesign,
    tmp_path_factory: pytest.TempPathFactory,
) -> ExportedDesign:
    """The record with shells beside it, as STL."""
    folder, mesh = tmp_path_factory.mktemp("meshes"), camera_a_mesh(low_resolution_design)
    write_stl(folder / "shell_a.stl", mesh)
    write_stl(folder / "shell_b.stl", mesh.mirrored())
    return exported.model_copy(update={"folder": folder})


def test_spheres_and_meshes_agree(with_meshes: ExportedDesign, knot: Scene) -> None:
    shells = read_shell_meshes(with_meshes)
    for at in with_meshes.reflectors:
        rows = range(at.camera.height_px)
        exact, mesh = exact_tracer(at)(rows, (0.0, 0.0)), mesh_tracer(shells, at)(rows, (0.0, 0.0))
        same = exact.mirror == mesh.mirror
        assert same.mean() > 0.999  # but for pixel centres on an edge
        both = same & (exact.mirror > 0)
        apart = mesh.origin[both] - exact.origin[both]
        assert np.abs(apart).max() < 1e-4
        turned = np.cross(exact.direction[both], mesh.direction[both])
        assert 200 * np.linalg.norm(turned, axis=1).max() < 2e-3  # mm at the object
        pictures = [
            np.concatenate([band.colour for band in photograph(at.camera, trace, knot)]).astype(int)
            for trace in (exact_tracer(at), mesh_tracer(shells, at))
        ]
        assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 2)[both].mean() < 1e-3
