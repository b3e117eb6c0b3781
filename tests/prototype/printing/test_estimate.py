"""Estimates of prints: against volumes in closed form."""

import numpy as np
import pytest
import trimesh

from tbcad.cad.kernel.mesh import Mesh
from tbcad.prototype.printed import (
    FLAT_MM,
    FLOWS,
    INFILL,
    LAYER_S,
    SIDE_MM,
    SUPPORT,
    print_estimate,
)


def mesh(*bodies: trimesh.Trimesh) -> Mesh:
    whole = trimesh.util.concatenate(bodies)
    return Mesh(np.asarray(whole.vertices), np.asarray(whole.faces))


def box(low: list[float], high: list[float]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


def test_a_thick_box_is_walls_and_infill() -> None:
    """Cube of 40 mm: walls and solid layers by their areas, the rest a quarter; 200 layers."""
    found = print_estimate(mesh(box([0, 0, 0], [40, 40, 40])))
    sides, flats = SIDE_MM * 4 * 1600, FLAT_MM * 2 * 1600
    infill = INFILL * (64000 - sides - flats)
    assert found[0] == pytest.approx(sides + flats + infill)
    seconds = sides / FLOWS[0] + flats / FLOWS[1] + infill / FLOWS[2] + 200 * LAYER_S
    assert found[1] == pytest.approx(seconds / 3600)


def test_a_thin_wall_is_solid() -> None:
    found = print_estimate(mesh(box([0, 0, 0], [2, 60, 80])))
    assert found[0] == pytest.approx(2 * 60 * 80)


def test_an_overhang_is_supported_down_to_what_is_below() -> None:
    """A roof 30 mm above the bed, beside a post, or above a block that leaves 10 mm below half."""
    roof, post = box([0, 0, 30], [40, 20, 32]), box([50, 0, 0], [60, 20, 32])
    block = box([0, 0, 0], [20, 20, 20])
    free, filled = print_estimate(mesh(roof, post)), print_estimate(mesh(roof, post, block))
    bodies = {"free": mesh(roof, post), "filled": mesh(roof, post, block)}
    support = {name: SUPPORT * height for name, height in (("free", 800 * 30), ("filled", 16000))}
    for name, found in (("free", free), ("filled", filled)):
        assert found[0] - unsupported(bodies[name]) == pytest.approx(support[name], rel=0.01)


def unsupported(whole: Mesh) -> float:
    """Filament by areas and volume alone, where nothing is thin."""
    corner = whole.vertices[whole.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2
    area, flat = np.linalg.norm(across, axis=1), np.abs(across[:, 2]) > 0
    solid = SIDE_MM * area[~flat].sum() + FLAT_MM * area[flat].sum()
    assert solid < whole.volume
    return float(solid + INFILL * (whole.volume - solid))


def test_a_slope_of_45_degrees_needs_no_support() -> None:
    wedge = trimesh.convex.convex_hull(
        [[x, y, 0] for x in (0, 10) for y in (0, 20)]
        + [[x, y, 20] for x in (0, 30) for y in (0, 20)]
    )
    upright = mesh(wedge)
    solid = upright.volume
    assert print_estimate(upright)[0] < solid
