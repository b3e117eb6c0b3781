"""How the pads lie when the carrier is printed: none faces down so far that it needs support."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.inventory import ZERO_DISC
from tbcad_verify.prototype.measured_parts import MeasuredPart
from tbcad_verify.report.checks import Check, CheckName, at_most, informative, require
from tbcad_verify.types import Floats

STEEP = np.sin(np.radians(45.0))  # of a normal's downward part
DIRECTIONS = 4000  # over the sphere, in which the pads' openings are searched
ROTATIONS = np.radians(np.arange(0, 180, 5))  # about the vertical
SLACK_MM = 1.0  # of the bed, below which a pose is not asked for
CHECKS = {"pads printed up": "pads"}


def checks(
    names: list[CheckName], context: PrototypeContext, carriers: list[MeasuredPart]
) -> list[Check]:
    """Pads that face down by more than 45 degrees as printed; where the bed permits it, none."""
    carriers = [part for part in carriers if part.part.name != ZERO_DISC]
    seats = context.prototype.seats
    normals = np.array([seat.normals for seat in seats]).reshape(-1, 3)
    owner = _owners(np.array([seat.contacts for seat in seats]).reshape(-1, 3), carriers)
    down, possible = 0, True
    for number, part in enumerate(carriers):
        own = normals[owner == number]
        down += int((own @ part.part.axes[:, 2] < -STEEP).sum())
        possible &= _fits_open(context, part, own)
    detail = f"of {len(normals)} pads"
    if down and not possible:
        return [informative(names[0], down, f"{detail}; no better pose fits the bed")]
    return [at_most(names[0], down, 0, detail)]


def _owners(contacts: Floats, carriers: list[MeasuredPart]) -> Floats:
    """(P,) part that each pad is on: the one with the nearest corner."""
    trees = [cKDTree(require(part.placed, part.reason).points) for part in carriers]
    return np.asarray(np.array([tree.query(contacts)[0] for tree in trees]).argmin(axis=0))


def _fits_open(context: PrototypeContext, part: MeasuredPart, normals: Floats) -> bool:
    """Whether the pose with the pads' openings up is without steep pads and fits the bed."""
    if not len(normals):
        return True
    ups = _directions()
    least = (normals @ ups.T).min(axis=0)
    up = ups[int(least.argmax())]
    points = require(part.placed, part.reason).points
    corners = points[ConvexHull(points).vertices]
    side = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    side /= np.linalg.norm(side)
    level = corners @ np.stack([side, np.cross(up, side)]).T
    cosine, sine = np.cos(ROTATIONS), np.sin(ROTATIONS)
    width = np.ptp(level @ np.stack([cosine, sine]), axis=0)
    depth = np.ptp(level @ np.stack([-sine, cosine]), axis=0)
    printer = context.export.spec.printer
    bed = np.array(printer.bed_mm) - SLACK_MM - np.array([2, 2, 1]) * printer.bed_margin_mm
    fits = (width <= bed[0]) & (depth <= bed[1]) & (np.ptp(corners @ up) <= bed[2])
    return bool(fits.any() and least.max() >= -STEEP)


def _directions() -> Floats:
    """(D, 3) unit directions, evenly over the sphere (Fibonacci's lattice)."""
    number = np.arange(DIRECTIONS) + 0.5
    height = 1 - 2 * number / DIRECTIONS
    azimuth = np.pi * (1 + 5**0.5) * number
    across = np.sqrt(1 - height**2)
    return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), height])
