"""Estimates of prints against closed forms; PrusaSlicer says the rest (tests/clients)."""

import numpy as np
import pytest
import trimesh

from tbcad.cad.kernel.mesh import Mesh
from tbcad.prototype.slicing import HOP_S, HOPS, print_estimate, print_settings

INFILL, NOZZLE = 0.25, 0.6
USE = print_settings(NOZZLE)


def box(low: list[float], high: list[float]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


def estimate(*bodies: trimesh.Trimesh, nozzle: float = NOZZLE) -> tuple[float, float]:
    whole = trimesh.boolean.union(bodies) if len(bodies) > 1 else bodies[0]
    mesh = Mesh(np.asarray(whole.vertices, dtype=float), np.asarray(whole.faces))
    return print_estimate(mesh, INFILL, nozzle)


def test_a_cube_is_walls_solid_layers_and_infill() -> None:
    """Of 39 mm: 130 layers, 8 of them solid; infill overlaps the walls by a quarter of a line."""
    inner = 39 - 2 * USE.depth
    core = inner**2 + 0.25 * 0.65 * 4 * inner
    expected = 39 * (39**2 - inner**2) + 0.3 * core * (8 + 122 * INFILL)
    assert estimate(box([0, 0, 0], [39, 39, 39]))[0] == pytest.approx(expected, rel=2e-3)


def test_walls_are_three_lines_and_depend_on_the_nozzle() -> None:
    assert USE.depth == pytest.approx(0.325 + 2.5 * (0.65 - 0.3 * (1 - np.pi / 4)))
    assert print_settings(0.4).depth == pytest.approx(1.65, abs=0.01)


def test_a_thin_plate_is_solid_and_takes_the_time_of_its_lines() -> None:
    """2 mm thick and 300 mm long: three lines a layer."""
    filament, hours = estimate(box([0, 0, 0], [300, 2, 60]))
    assert filament == pytest.approx(300 * 2 * 60, rel=1e-6)
    length, outer = 3 * 302, 2 * (302 - USE.line)
    seconds = outer / 35 + (length - outer) / 45 + HOPS * HOP_S
    assert hours * 3600 / 200 == pytest.approx(seconds, rel=0.05)


def test_a_small_layer_takes_its_least_time() -> None:
    """Of 15 s, were it not slower than 15 mm/s."""
    assert estimate(box([0, 0, 0], [18, 18, 60]))[1] * 3600 / 200 == pytest.approx(15, rel=0.01)
    assert estimate(box([0, 0, 0], [4, 4, 60]))[1] * 3600 / 200 < 5


def test_the_smaller_nozzle_takes_longer() -> None:
    cube = box([0, 0, 0], [40, 40, 40])
    assert 1.5 < estimate(cube, nozzle=0.4)[1] / estimate(cube)[1] < 2.5


LEGS = box([0, 0, 0], [10, 30, 30]), box([50, 0, 0], [60, 30, 30])
ROOF = box([0, 0, 30], [60, 30, 39])


def support(*bodies: trimesh.Trimesh) -> float:
    """Filament beyond that of the bodies when they stand apart on the bed, mm^3."""
    return estimate(*bodies)[0] - sum(estimate(body)[0] for body in bodies)


def test_a_bridge_needs_no_support_and_a_cantilever_does() -> None:
    """Below 40 x 30 mm, and 2.4 mm round it: lines of 0.49 mm 2.49 mm apart, 30 mm high."""
    bridge, cantilever = support(*LEGS, ROOF), support(LEGS[0], ROOF)
    line = USE.spacing(0.55)
    held = 30 * line / (line + 2) * (50 + 2.4) * (30 + 4.8)
    assert bridge < 0.1 * held
    assert held < cantilever < 1.5 * held  # a dense interface and a wide first layer


def test_supports_stand_on_the_build_plate_only() -> None:
    """A shelf over a foot that reaches as far has none."""
    shelf, wall = box([0, 0, 30], [40, 30, 33]), box([0, 0, 0], [6, 30, 30])
    foot = box([0, -5, 0], [45, 35, 6])
    assert support(wall, shelf) > 3000
    assert support(foot, wall, shelf) < 0.1 * support(wall, shelf)


@pytest.mark.parametrize(("slope_deg", "needs"), [(38, True), (45, False)])
def test_slopes_below_40_degrees_are_supported(slope_deg: float, needs: bool) -> None:
    reach = 20 / np.tan(np.radians(slope_deg))
    ends = [[x, y, z] for z, far in ((0, 10), (20, 10 + reach)) for x in (0, far) for y in (0, 20)]
    leaning = trimesh.convex.convex_hull(ends)
    upright = trimesh.convex.convex_hull(np.array(ends) * [1, 1, -1] + [0, 0, 20])
    more = estimate(leaning)[0] - estimate(upright)[0]
    assert (more > 300) is needs
