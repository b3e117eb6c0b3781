"""Pixels' rays off the exact mirrors, also on pedestals, against a search over all of them."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.core.optics.reflection import miss_distances
from tbcad.errors import InputError
from tbcad.light.simulate.scene.rays import (
    TracedRays,
    camera_around_object,
    exact_tracer,
    pixel_directions,
)
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, read_export, reflectors
from tbcad.light.simulate.scene.shell_meshes import mesh_tracer, read_shell_meshes
from tbcad.tolerancing.montecarlo.draws import draw
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.sharpness import built_reflector
from tests.exported_files import Rows, edit_csv, edit_json
from tests.mirror_arrays import mirror_design
from tests.pedestal_designs import pedestal_design
from tests.shell_meshes import export_with_meshes

Cameras = tuple[Reflector, Reflector]
SETTINGS = ("n=6", "width_px=416", "height_px=310", "shell.groove_mm=0.4")
CENTRE = (0.0, 0.0)
SOME = 7  # a pixel of so many is searched
RECORD, MIRRORS = "design.json", "mirrors.csv"


def every_row(at: Reflector) -> TracedRays:
    return exact_tracer(at)(range(at.camera.height_px), (0.0, 0.0))


def searched(at: Reflector, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First mirror, from 1, of rays (k, 3), and how far it is, by trying all of them.

    With the rows' own quadratic formula for sphere centres, not the one under test; no mirror
    where the point lies beyond seam or foot, or inside another sphere.
    """
    mirrors = at.mirrors
    to_centre = mirrors.centre - at.camera.pinhole
    along = way @ to_centre.T
    rest = mirrors.radius**2 - dot(to_centre, to_centre) + along**2
    reach = np.where((rest > 0) & (along > 0), along - np.sqrt(np.maximum(rest, 0)), np.inf)
    finite = np.where(np.isfinite(reach), reach, 0)
    x, z = (at.camera.pinhole[i] + finite * way[:, [i]] for i in (0, 2))
    reach[(at.side * x < 0) | (z < at.foot)] = np.inf
    first = reach.argmin(axis=1)
    t = reach[np.arange(len(way)), first]
    point = at.camera.pinhole + np.where(np.isfinite(t), t, 0)[:, None] * way
    away = [norm(point - centre) for centre in mirrors.centre]
    inside = np.stack(away, axis=1) < mirrors.radius - 1e-7
    there = np.isfinite(t) & ~inside.any(axis=1)
    return np.where(there, first + 1, 0), t


WIDE = ("n=6", "hfov_deg=110", "width_px=416", "height_px=310")  # sees spheres below the foot


@pytest.mark.parametrize("number", [0, 1, 2])
def test_first_mirror_is_the_one_that_a_search_finds(cameras: Cameras, number: int) -> None:
    at = cameras[number] if number < 2 else reflectors(mirror_design(*WIDE))[0]
    rays = every_row(at)
    way = unit(pixel_directions(at.camera, range(at.camera.height_px))).reshape(-1, 3)
    found, reach = searched(at, way[::SOME])
    assert np.array_equal(rays.mirror.ravel()[::SOME], found)
    on, origin = found > 0, rays.origin.reshape(-1, 3)[::SOME]
    assert norm(origin[on] - at.camera.pinhole) == pytest.approx(reach[on])


def test_reflection_obeys_its_law(cameras: Cameras) -> None:
    """The angles to the normal are equal, and both rays and the normal lie in one plane."""
    at = cameras[1]
    rays = every_row(at)
    on = rays.mirror > 0
    point, out = rays.origin[on], rays.direction[on]
    normal = at.mirrors.gradient(rays.mirror[on] - 1, point)
    back = unit(at.camera.pinhole - point)
    assert norm(out) == pytest.approx(np.ones(len(out)))
    assert dot(out, normal) == pytest.approx(dot(back, normal), abs=1e-12)
    assert dot(np.cross(out, normal), back) == pytest.approx(np.zeros(len(out)), abs=1e-12)
    assert miss_distances(at.camera.pinhole, point, normal) == pytest.approx(
        norm(np.cross(point, out))
    )


def test_bands_and_shifts_are_parts_of_one_picture(cameras: Cameras) -> None:
    at = cameras[0]
    whole, trace = every_row(at), exact_tracer(at)
    part = trace(range(100, 140), (0.0, 0.0))
    assert np.array_equal(part.mirror, whole.mirror[100:140])
    assert np.array_equal(part.direction, whole.direction[100:140])
    shifted = trace(range(100, 140), (1.0, 2.0))
    assert np.array_equal(shifted.mirror[:-2, :-1], part.mirror[2:, 1:])


def test_planar_mirrors() -> None:
    at, _ = reflectors(mirror_design("n=4", "radius_rule=flat", "width_px=208", "height_px=155"))
    rays = every_row(at)
    on = rays.mirror > 0
    assert set(np.unique(rays.mirror[on])) == set(range(1, len(at) + 1))
    # All rays off a planar mirror come from one point, the virtual camera d u.
    camera = at.u * 2 * np.hypot(100.0, np.sqrt(2) * 50)
    past = np.cross(rays.origin[on] - camera[rays.mirror[on] - 1], rays.direction[on])
    assert norm(past).max() < 1e-9


@pytest.fixture(scope="module")
def made() -> MirrorDesign:
    return pedestal_design(*SETTINGS)


@pytest.fixture(scope="module")
def on_pedestals(made: MirrorDesign) -> Cameras:
    return reflectors(made)


def searched_solids(at: Reflector, way: np.ndarray) -> np.ndarray:
    """First mirror, from 1, that rays (k, 3) meet: balls cut by half-spaces, on segments.

    A ray may meet the wall of a pedestal first, which is no mirror.
    """
    cells, pinhole = at.cells, at.camera.pinhole
    assert isinstance(cells, PedestalCells)
    to_centre = at.mirrors.centre - pinhole
    along = way @ to_centre.T
    rest = at.mirrors.radius**2 - dot(to_centre, to_centre) + along**2
    half = np.sqrt(np.maximum(rest, 0))
    low, high = along - half, np.where(rest > 0, along + half, -np.inf)
    on_sphere = low.copy()
    normal, apex = (k[cells.mirrors :] for k in (cells.surfaces.normal, cells.surfaces.apex))
    every = [slice(None)] * PLANES
    normal = np.concatenate([-normal[:PLANES], normal[PLANES:]])
    for mirror, n, p in zip([*every, *cells.walls[:, 0]], normal, apex, strict=True):  # out: > 0
        value, rate = n @ (pinhole - p), way @ n
        crossing = -value / rate
        enters, leaves = np.where(rate < 0, crossing, -np.inf), np.where(rate > 0, crossing, np.inf)
        if isinstance(mirror, slice):
            enters, leaves = enters[:, None], leaves[:, None]
        low[:, mirror] = np.maximum(low[:, mirror], enters)
        high[:, mirror] = np.minimum(high[:, mirror], leaves)
    reach = np.where(low < high, low, np.inf)
    first = reach.argmin(axis=1)
    row = np.arange(len(way))
    there = np.isfinite(reach[row, first]) & (reach[row, first] == on_sphere[row, first])
    return np.where(there, first + 1, 0)


@pytest.mark.parametrize("camera", [0, 1])
def test_mirrors_on_pedestals_are_those_that_a_search_finds(
    on_pedestals: Cameras, camera: int
) -> None:
    at = on_pedestals[camera]
    way = unit(pixel_directions(at.camera, range(at.camera.height_px))).reshape(-1, 3)
    found = searched_solids(at, way[::SOME])
    assert np.array_equal(every_row(at).mirror.ravel()[::SOME], found)
    assert (found == 0).mean() > 0.05  # grooves, and what lies beside the mirrors


def counted(at: Reflector) -> np.ndarray:
    """Pixels of each mirror."""
    return np.bincount(every_row(at).mirror.ravel(), minlength=len(at) + 1)[1:]


def within_frame(at: Reflector) -> np.ndarray:
    """Which mirrors' pictures lie inside the frame."""
    box = at.boxes()
    inside = (box[:, ::2].min(axis=1) > 0) & (box[:, 1] < at.camera.width_px)
    return inside & (box[:, 3] < at.camera.height_px)


@pytest.mark.parametrize("pedestals", [False, True])
def test_the_mesh_of_the_shell_shows_the_same(
    low_resolution_design: MirrorDesign, made: MirrorDesign, tmp_path: Path, pedestals: bool
) -> None:
    """Rays of every pixel off the facets of the STL; grooves are dark in both."""
    exported = export_with_meshes(tmp_path, made if pedestals else low_resolution_design)
    shells = read_shell_meshes(exported)
    for at in exported.reflectors:
        exact = every_row(at)
        mesh = mesh_tracer(shells, at)(range(at.camera.height_px), CENTRE)
        same = exact.mirror == mesh.mirror
        assert same.mean() > 0.999  # but for pixel centres on an edge
        both = same & (exact.mirror > 0)
        assert np.abs(mesh.origin[both] - exact.origin[both]).max() < 1e-4
        turned = np.cross(exact.direction[both], mesh.direction[both])
        assert 200 * norm(turned).max() < 2e-3  # mm at the object


def test_walls_of_a_build_that_are_off_change_its_pictures(on_pedestals: Cameras) -> None:
    """Shells that are moved, turned and grown take their walls along; each wall is off as well."""
    errors = Errors(
        sphere_centre=Error(0.02),
        scale_isotropic=Error(0.01),
        shell_shift=Error(0.4),
        shell_tilt=Error(5e-3),
        camera_shift=Error(0.2),
        camera_focal=Error(5e-3),
    )
    at = on_pedestals[0]
    one = draw(errors, 5, range(1), len(at), None, len(at.walls))[0]
    moved = replace(one, wall=np.random.default_rng(3).normal(0, 0.2, one.wall.shape))
    inside = within_frame(built_reflector(at, moved, 0))
    assert inside.sum() > 50
    pixels, others = (counted(built_reflector(at, drawn, 0)) for drawn in (moved, one))
    off = np.abs(pixels - others)[inside]
    assert 30 < off.max() < pixels.max()


def test_the_record_gives_the_designs_rays(
    exported: ExportedDesign, cameras: tuple[Reflector, Reflector]
) -> None:
    assert exported.capture_mm == 60
    assert exported.spec.optics.n == 6
    for read, made in zip(exported.reflectors, cameras, strict=True):
        rows = range(150, 200)
        one, other = (exact_tracer(at)(rows, (0.0, 0.0)) for at in (read, made))
        assert np.array_equal(one.mirror, other.mirror)
        assert one.direction == pytest.approx(other.direction, abs=1e-12)


def cell(key: str, value: str) -> Callable[[Rows], object]:
    """Change a cell of the fourth row."""
    return lambda rows: rows[3].update({key: value})


@pytest.mark.parametrize(
    ("name", "change", "wrong"),
    [
        (RECORD, lambda d: d.update(schema="tbcad-design/1"), "reads 'tbcad-design/2'"),
        (RECORD, lambda d: d["cameras"].reverse(), "not a and b"),
        (RECORD, lambda d: d["cameras"][0].update(forward=[0, 0, 2]), "axes"),
        (RECORD, lambda d: d["spec"]["optics"].update(n=99), r"spec\.optics\.n"),
        (MIRRORS, lambda rows: rows.pop(), "has 102 mirrors, allowed is 103"),
        (MIRRORS, cell("camera", "c"), "row 4 camera: "),
        (MIRRORS, cell("ux", "5.0"), "u of another length"),
        (MIRRORS, cell("px", "1000.0"), "bound no cells"),
    ],
)
def test_refused(
    record: Path, tmp_path: Path, name: str, change: Callable[[Any], object], wrong: str
) -> None:
    shutil.copytree(record, tmp_path, dirs_exist_ok=True)
    edit = edit_json if name == RECORD else edit_csv
    edit(tmp_path / name, change)
    with pytest.raises(InputError, match=wrong) as error:
        read_export(tmp_path)
    assert name == RECORD or str(tmp_path / name) in str(error.value)
    assert "\n" not in str(error.value)
    (tmp_path / name).unlink()
    with pytest.raises(InputError, match=f"{name} is not there: name a folder that tbcad build"):
        read_export(tmp_path)


@pytest.mark.parametrize(
    ("distance", "says"),
    [(np.inf, "inf is no length"), (np.nan, "nan is no length"), (30, "30 is inside the object's")],
)
def test_distances_of_no_camera_are_refused(distance: float, says: str) -> None:
    with pytest.raises(InputError, match=says):
        camera_around_object(0.0, 0.5, distance, 60.0)
