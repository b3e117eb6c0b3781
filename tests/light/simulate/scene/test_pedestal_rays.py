"""Pixels' rays off mirrors on pedestals: a search over all solids, and the mesh of a shell."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import TracedRays, exact_tracer, pixel_directions
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, reflectors
from tbcad.light.simulate.scene.shell_meshes import mesh_tracer, read_shell_meshes
from tbcad.tolerancing.montecarlo.coverage import mirror_coverage
from tbcad.tolerancing.montecarlo.draws import draw
from tbcad.tolerancing.montecarlo.edge_model import edge_model
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.sharpness import built_reflector
from tests.pedestal_designs import pedestal_design
from tests.shell_meshes import export_with_meshes

SETTINGS = ("n=6", "width_px=416", "height_px=310", "shell.groove_mm=0.4")
CENTRE = (0.0, 0.0)


@pytest.fixture(scope="module")
def made() -> MirrorDesign:
    return pedestal_design(*SETTINGS)


@pytest.fixture(scope="module")
def cameras(made: MirrorDesign) -> tuple[Reflector, Reflector]:
    return reflectors(made)


@pytest.fixture(scope="module")
def exported(made: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> ExportedDesign:
    return export_with_meshes(tmp_path_factory.mktemp("pedestals"), made)


def every_row(at: Reflector) -> TracedRays:
    return exact_tracer(at)(range(at.camera.height_px), CENTRE)


def searched(at: Reflector, way: np.ndarray) -> np.ndarray:
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
    planes = [(slice(None), -n, p) for n, p in cells_planes(cells)]
    walls = zip(*wall_planes(cells), strict=True)
    for mirror, n, p in [*planes, *walls]:  # outside where value > 0
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


def cells_planes(cells: PedestalCells) -> list[tuple[np.ndarray, np.ndarray]]:
    at, m = cells.surfaces, cells.mirrors
    return [(at.normal[k], at.apex[k]) for k in range(m, m + PLANES)]


def wall_planes(cells: PedestalCells) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    first = cells.mirrors + PLANES
    return cells.walls[:, 0], cells.surfaces.normal[first:], cells.surfaces.apex[first:]


@pytest.mark.parametrize("camera", [0, 1])
def test_mirrors_are_those_that_a_search_finds(
    cameras: tuple[Reflector, Reflector], camera: int
) -> None:
    at = cameras[camera]
    rays = every_row(at)
    way = unit(pixel_directions(at.camera, range(at.camera.height_px))).reshape(-1, 3)
    found = searched(at, way)
    assert np.array_equal(rays.mirror.ravel(), found)
    assert (found == 0).mean() > 0.05  # grooves, and what lies beside the mirrors


def counted(at: Reflector) -> np.ndarray:
    """Pixels of each mirror."""
    return np.bincount(every_row(at).mirror.ravel(), minlength=len(at) + 1)[1:]


def within_frame(at: Reflector) -> np.ndarray:
    """Which mirrors' pictures lie inside the frame."""
    box = at.boxes()
    inside = (box[:, ::2].min(axis=1) > 0) & (box[:, 1] < at.camera.width_px)
    return inside & (box[:, 3] < at.camera.height_px)


def test_the_mesh_of_the_shell_shows_the_same(exported: ExportedDesign, knot: Scene) -> None:
    """Rays of every pixel off the facets of the STL; grooves are dark in both."""
    shells = read_shell_meshes(exported)
    for at in exported.reflectors:
        rays = range(at.camera.height_px)
        exact, mesh = every_row(at), mesh_tracer(shells, at)(rays, CENTRE)
        same = exact.mirror == mesh.mirror
        assert same.mean() > 0.999  # but for pixel centres on an edge
        both = same & (exact.mirror > 0)
        assert np.abs(mesh.origin[both] - exact.origin[both]).max() < 1e-4
        turned = np.cross(exact.direction[both], mesh.direction[both])
        assert 200 * norm(turned).max() < 2e-3  # mm at the object
        pictures = [
            np.concatenate([band.colour for band in photograph(at.camera, trace, knot)]).astype(int)
            for trace in (exact_tracer(at), mesh_tracer(shells, at))
        ]
        assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 2)[both].mean() < 1e-3


def test_pixels_of_builds_are_those_of_the_fast_model(
    cameras: tuple[Reflector, Reflector],
) -> None:
    """Shells that are moved, turned and grown take their walls along; each wall is off as well."""
    errors = Errors(
        sphere_centre=Error(0.02),
        scale_isotropic=Error(0.01),
        shell_shift=Error(0.4),
        shell_tilt=Error(5e-3),
        camera_shift=Error(0.2),
        camera_focal=Error(5e-3),
    )
    for at, one in zip(
        cameras,
        draw(errors, 5, range(1), len(cameras[0]), None, len(cameras[0].walls)),
        strict=True,
    ):
        moved = replace(one, wall=np.random.default_rng(3).normal(0, 0.2, one.wall.shape))
        pixels = counted(built_reflector(at, moved, 0))
        area = mirror_coverage(edge_model(at), moved).pixels[0]
        inside = within_frame(built_reflector(at, moved, 0))
        assert inside.sum() > 50
        assert np.abs(area - pixels)[inside] == pytest.approx(0, abs=0.6 * np.sqrt(pixels.max()))
        # Walls of the design would give other pictures.
        assert np.abs(area - counted(built_reflector(at, one, 0)))[inside].max() > 30
