"""Outlines of cells, lamps' shadows and drawings, each against what is known of small examples."""

from __future__ import annotations

import io
from typing import cast

import numpy as np
import pytest
from ezdxf.document import Drawing
from ezdxf.units import IN, MM
from tbcad_verify.prototype.bodies import Bodies
from tbcad_verify.prototype.drawing_files import read_dxf
from tbcad_verify.prototype.light.lamp_light import FACET_MM, EdgedBodies
from tbcad_verify.prototype.light.pinhole_cells import (
    MAX_ANGLE,
    OUTLINE_DIRECTIONS,
    MirrorSpheres,
    cell_outlines,
    first_mirrors,
)
from tbcad_verify.record.files import FileBytes
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Bools, Floats

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


class Edge:
    """A body that fills y > 0."""

    def blocked(self, starts: Floats, ends: Floats, angle: float) -> Bools:
        return np.maximum(starts[:, 1], ends[:, 1]) > 0


@pytest.mark.parametrize(
    ("y", "stopped"),
    [(-2.0, (False, False)), (-0.9, (True, False)), (0.9, (True, False)), (2.0, (True, True))],
)
def test_only_rays_near_an_edge_are_undecided(y: float, stopped: tuple[bool, bool]) -> None:
    starts = np.array([[100.0, y * FACET_MM, -50.0]])
    ends = starts * [0.0, 1.0, 0.0]
    found = tuple(
        bool(EdgedBodies(cast(Bodies, Edge()), grazing).blocked(starts, ends, 0.0)[0])
        for grazing in (True, False)
    )
    assert found == stopped


def drawing(circles: int, units: int = MM, layer: str = "centre") -> FileBytes:
    """A DXF with circles and a square to be cut, and a circle that only shows something."""
    document = Drawing.new("R2010")
    document.units = units
    for name in sorted({"cut", layer}):
        document.layers.add(name)
    space = document.modelspace()
    for k in range(circles):
        space.add_circle((k, 2), 0.5, dxfattribs={"layer": "cut"})
    space.add_circle((9, 9), 9, dxfattribs={"layer": layer})
    square = [(0, 0), (3, 0), (3, 4), (0, 4)]
    space.add_lwpolyline(square, close=True, dxfattribs={"layer": "cut"})
    text = io.StringIO()
    document.write(text)
    return file_of(text.getvalue())


def file_of(text: str) -> FileBytes:
    return FileBytes("plate.dxf", np.frombuffer(text.encode(), np.uint8), "")


def test_what_is_cut_is_read() -> None:
    flat = read_dxf(drawing(2))
    assert flat.circles.tolist() == [[0, 2, 0.5], [1, 2, 0.5]]
    assert flat.corners.tolist() == [[0, 0], [3, 0], [3, 4], [0, 4]]


@pytest.mark.parametrize(
    ("file", "words"),
    [
        (drawing(1001), "1001 circles"),
        (drawing(2, IN), r"\$INSUNITS is 1, allowed is 4"),
        (drawing(2, layer="cuts"), "layer cuts is foreign"),
        (file_of("plate"), "no DXF"),
    ],
)
def test_anything_else_is_not_read(file: FileBytes, words: str) -> None:
    with pytest.raises(Unknown, match=words):
        read_dxf(file)
