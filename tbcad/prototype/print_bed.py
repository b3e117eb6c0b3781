"""The printer's bed: the orientations in which a part fits, from its corners alone."""

from collections.abc import Sequence

import numpy as np

from tbcad.core.geometry.vectors import unit
from tbcad.core.spec.design import PrinterSpec
from tbcad.types import Floats

# Parts are measured by coarse meshes whose facets may lie this far inside of them.
SLACK_MM = 0.4
ROTATIONS = np.radians(np.arange(0, 180, 5))  # about the vertical
MARGINS = np.array([2, 2, 1])  # free on both sides of width and depth, and above


def usable_size(printer: PrinterSpec) -> Floats:
    """Width, depth and height that a part may have, mm, (3,)."""
    return np.array(printer.bed_mm) - MARGINS * printer.bed_margin_mm - SLACK_MM


def fitting_orientation(corners: Floats, down: Floats, printer: PrinterSpec) -> Floats | None:
    """Rows (3, 3) that the axes become where corners (n, 3) fit with a direction down, or None."""
    orientations = _orientations(down)
    fits = (np.ptp(corners @ orientations, axis=1) <= usable_size(printer)).all(axis=1)
    return orientations[int(fits.argmax())] if fits.any() else None


def shortfall(corners: Floats, downs: Sequence[Floats], printer: PrinterSpec) -> float:
    """By how much the bed is too small for corners (n, 3), mm; 0 or less: they fit."""
    return float(_shortfalls(_sizes(corners, downs), printer).min())


def min_bed(corners: Floats, downs: Sequence[Floats], printer: PrinterSpec) -> Floats:
    """Smallest bed for corners (n, 3) in the orientation nearest to fitting, mm, (3,)."""
    sizes = _sizes(corners, downs)
    size = sizes[_shortfalls(sizes, printer).argmin()]
    return np.asarray(np.ceil(size + np.array(printer.bed_mm) - usable_size(printer)))


def _sizes(corners: Floats, downs: Sequence[Floats]) -> Floats:
    """Width, depth and height in all orientations of corners, (w, 3)."""
    return np.concatenate([np.ptp(corners @ _orientations(down), axis=1) for down in downs])


def _shortfalls(sizes: Floats, printer: PrinterSpec) -> Floats:
    return np.asarray((sizes - usable_size(printer)).max(axis=1))


def size_text(bed: Floats) -> str:
    """A bed's sizes (3,) as errors give them."""
    return " x ".join(f"{size:.0f}" for size in bed)


def _orientations(down: Floats) -> Floats:
    """Rows that the axes become when a direction points down, for each rotation, (t, 3, 3)."""
    cosine, sine, zero = np.cos(ROTATIONS), np.sin(ROTATIONS), np.zeros(len(ROTATIONS))
    rotation = [[cosine, sine, zero], [-sine, cosine, zero], [zero, zero, zero + 1]]
    side = unit(np.cross(np.eye(3)[np.argmin(np.abs(down))], down))
    upright = np.stack([side, np.cross(-down, side), -down]).T
    return np.asarray(upright @ np.moveaxis(np.array(rotation), -1, 0))
