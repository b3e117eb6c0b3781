"""Outlines of cells against spheres whose outlines are known."""

import numpy as np
import pytest
from tbcad_verify.prototype.light.pinhole_cells import (
    MAX_ANGLE,
    OUTLINE_DIRECTIONS,
    MirrorSpheres,
    cell_outlines,
    first_mirrors,
)

DISTANCE, RADIUS, SPACING = 144.0, 12.0, 0.014  # mm, mm, rad
FOOT, ROWS, COLUMNS = -2.4, 5, 9


def dome_of_spheres() -> MirrorSpheres:
    """Spheres on a sphere about a pinhole far below the foot; the lowest mirrors are just above it.

    The lower edge of their spheres rises above the foot again before its silhouette, 0.077 rad
    from the apex.
    """
    steps = np.arange(ROWS), np.arange(COLUMNS) - COLUMNS // 2
    up, aside = np.meshgrid(*(SPACING * step for step in steps), indexing="ij")
    up += np.pi / 4
    out = np.stack([np.cos(up) * np.cos(aside), np.cos(up) * np.sin(aside), np.sin(up)])
    out = out.reshape(3, -1)
    pinhole = np.array([120.0, 0.0, -DISTANCE * np.sin(np.pi / 4)])
    apex, centre = (pinhole[:, None] + reach * out for reach in (DISTANCE, DISTANCE + RADIUS))
    count = out.shape[1]
    radius, halved = np.full(count, RADIUS), np.zeros(count, dtype=bool)
    return MirrorSpheres(pinhole, apex, centre, radius, 1.0, FOOT, halved)


def test_an_outline_is_the_first_edge_of_its_cell() -> None:
    """What rises above the foot again is no part of the cell: a bisection might end there."""
    shell = dome_of_spheres()
    outlines = cell_outlines(shell)
    inside = outlines.at_share(np.full(outlines.angle.shape, 0.98)).reshape(3, -1)
    lowest = slice(1, COLUMNS - 1)  # with neighbours on both sides, and the foot below
    mirror = np.arange(ROWS * COLUMNS)[lowest, None]
    first = first_mirrors(shell, inside).reshape(-1, OUTLINE_DIRECTIONS)[lowest]
    assert (first == mirror).all()
    assert outlines.angle[lowest].max() < 3 * SPACING


def test_a_single_sphere_ends_at_its_silhouette() -> None:
    """Without neighbours and foot: the arcsine of radius by distance."""
    pinhole, centre = np.array([300.0, 0.0, 0.0]), np.array([[200.0], [0.0], [0.0]])
    apex = centre + np.array([[RADIUS], [0.0], [0.0]])
    one = MirrorSpheres(
        pinhole, apex, centre, np.array([RADIUS]), 1.0, -np.inf, np.zeros(1, dtype=bool)
    )
    angle = cell_outlines(one).angle
    assert angle == pytest.approx(np.full_like(angle, np.arcsin(RADIUS / 100)), abs=1e-9)
    assert angle.max() < MAX_ANGLE
