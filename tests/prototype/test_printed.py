"""Printed parts: solids of primitives, pads on the bed, and estimates by closed forms."""

import numpy as np
import pytest
import trimesh

from tbcad.cad.kernel.checks import properties
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.solids import faces, fused, one_solid
from tbcad.core.geometry.primitives import Slot, slot_parts, volume
from tbcad.core.geometry.vectors import unit
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.printed import (
    FLAT_MM,
    FLOWS,
    LAYER_S,
    NO_PADS,
    SIDE_MM,
    SUPPORT,
    downward_pads,
    opening_up,
    primitive_solid,
    print_estimate,
)

TILTED = unit(np.array([0.3, -0.5, 0.8]))

INFILL = 0.25


def cone(axis: np.ndarray, angle_deg: float, count: int = 12) -> np.ndarray:
    """Unit vectors at an angle about an axis."""
    side = unit(np.cross(axis, [0.2, 0.5, 0.8]))
    turn = 2 * np.pi * np.arange(count) / count
    across = np.outer(np.cos(turn), side) + np.outer(np.sin(turn), np.cross(axis, side))
    angle = np.radians(angle_deg)
    return np.cos(angle) * axis + np.sin(angle) * across


def test_the_middle_of_a_cone_is_up(carrier: BaseLayout) -> None:
    axis = np.array([0.6, 0.0, 0.8])
    assert opening_up(cone(axis, 50.0)) == pytest.approx(-axis, abs=1e-6)
    assert opening_up(np.vstack([np.eye(3), -np.eye(3)])) is None
    assert opening_up(NO_PADS) is None
    normals = carrier.seats.pad_normals.reshape(-1, 3)
    down = opening_up(normals)
    assert down is not None
    assert (normals @ down).max() < 0


def test_pads_are_counted() -> None:
    normals = cone(np.array([0.0, 0.0, 1.0]), 100.0, 8)
    assert downward_pads(normals, np.eye(3)) == (0, 8)
    assert downward_pads(normals, np.diag([1.0, -1.0, -1.0])) == (0, 0)
    assert downward_pads(np.array([[0.0, 0.0, -1.0]]), np.eye(3)) == (1, 1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_slot_is_the_union_of_its_parts(sign: float) -> None:
    across = unit(np.cross(TILTED, [1.0, -2.0, 3.0]))
    slot = Slot(np.array([1.0, -2.0, 3.0]), sign * 4 * across, 2.0, 7 * TILTED)
    solid = one_solid("slot", primitive_solid(slot))
    found = properties(solid)
    expected = properties(fused([primitive_solid(part) for part in slot_parts(slot)]))
    assert len(faces(solid)) == 6
    assert found.volume == pytest.approx(volume(slot), rel=1e-12)
    assert found.volume == pytest.approx(expected.volume, rel=1e-9)
    assert found.area == pytest.approx(expected.area, rel=1e-9)
    assert found.centroid == pytest.approx(expected.centroid, abs=1e-9)


def mesh(*bodies: trimesh.Trimesh) -> Mesh:
    whole = trimesh.util.concatenate(bodies)
    return Mesh(np.asarray(whole.vertices), np.asarray(whole.faces))


def box(low: list[float], high: list[float]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


def test_a_thick_box_is_walls_and_infill_and_a_thin_wall_is_solid() -> None:
    """Cube of 40 mm: walls and solid layers by their areas, the rest a quarter; 200 layers."""
    filament, hours = print_estimate(mesh(box([0, 0, 0], [40, 40, 40])), INFILL)
    sides, flats = SIDE_MM * 4 * 1600, FLAT_MM * 2 * 1600
    infill = INFILL * (64000 - sides - flats)
    assert filament == pytest.approx(sides + flats + infill)
    seconds = sides / FLOWS[0] + flats / FLOWS[1] + infill / FLOWS[2] + 200 * LAYER_S
    assert hours == pytest.approx(seconds / 3600)
    filament, _ = print_estimate(mesh(box([0, 0, 0], [2, 60, 80])), INFILL)
    assert filament == pytest.approx(2 * 60 * 80)


def unsupported(whole: Mesh) -> float:
    """Filament by areas and volume alone, where nothing is thin."""
    corner = whole.vertices[whole.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2
    sides, flats = np.linalg.norm(across[:, :2], axis=1).sum(), np.abs(across[:, 2]).sum()
    solid = SIDE_MM * sides + FLAT_MM * flats
    return float(solid + INFILL * (whole.volume - solid))


@pytest.mark.parametrize(("filled", "room"), [(False, 800 * 30), (True, 16000)])
def test_an_overhang_is_supported_down_to_what_is_below(filled: bool, room: float) -> None:
    """A roof 30 mm above the bed, beside a post, or above a block that leaves 10 mm below half."""
    bodies = [box([0, 0, 30], [40, 20, 32]), box([50, 0, 0], [60, 20, 32])]
    whole = mesh(*bodies, *[box([0, 0, 0], [20, 20, 20])] * filled)
    assert print_estimate(whole, INFILL)[0] - unsupported(whole) == pytest.approx(
        SUPPORT * room, rel=0.01
    )


def test_a_slope_of_45_degrees_needs_no_support() -> None:
    ends = [[x, y, z] for z, far in ((0, 10), (20, 30)) for x in (0, far) for y in (0, 20)]
    upright = mesh(trimesh.convex.convex_hull(ends))
    assert print_estimate(upright, INFILL)[0] == pytest.approx(unsupported(upright))
