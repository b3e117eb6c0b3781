"""The printer's bed: the ways a part can be laid on it, by its corners alone."""

from collections.abc import Sequence

import numpy as np

from tbcad.geometry.vectors import unit
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Floats

# Parts are measured by coarse meshes whose facets may lie this far inside of them.
SLACK_MM = 0.4
TURNS = np.radians(np.arange(0, 180, 5))


def room(printer: PrinterSpec) -> Floats:
    """Width, depth and height that a part may have, mm, (3,)."""
    return np.array(printer.bed_mm) - np.array([2, 2, 1]) * printer.bed_margin_mm - SLACK_MM


def fitting(corners: Floats, down: Floats, printer: PrinterSpec) -> Floats | None:
    """A way of laying a part so that it fits, or None.

    Args:
        corners: of the part, mm, (n, 3).
        down: unit direction that is to point down, (3,).
        printer: with its bed.

    Returns:
        Rows that the axes become, (3, 3).
    """
    ways = _ways(down)
    fits = (np.ptp(corners @ ways, axis=1) <= room(printer)).all(axis=1)
    return ways[int(fits.argmax())] if fits.any() else None


def shortfall(corners: Floats, downs: Sequence[Floats], printer: PrinterSpec) -> float:
    """By how much the bed is too small for corners (n, 3), mm; 0 or less: they fit."""
    return float(_lacks(_sizes(corners, downs), printer).min())


def needed(corners: Floats, downs: Sequence[Floats], printer: PrinterSpec) -> Floats:
    """Least bed for corners (n, 3), laid the way that lacks least of the bed, mm, (3,)."""
    sizes = _sizes(corners, downs)
    size = sizes[_lacks(sizes, printer).argmin()]
    least: Floats = np.ceil(size + np.array(printer.bed_mm) - room(printer))
    return least


def _sizes(corners: Floats, downs: Sequence[Floats]) -> Floats:
    """Width, depth and height in all ways to lay corners down, (w, 3)."""
    return np.concatenate([np.ptp(corners @ _ways(down), axis=1) for down in downs])


def _lacks(sizes: Floats, printer: PrinterSpec) -> Floats:
    result: Floats = (sizes - room(printer)).max(axis=1)
    return result


def as_text(bed: Floats) -> str:
    """A bed's sizes (3,) as they are said in errors."""
    return " x ".join(f"{size:.0f}" for size in bed)


def _ways(down: Floats) -> Floats:
    """Rows that the axes become when a direction points down, for each turn, (t, 3, 3)."""
    cosine, sine, still = np.cos(TURNS), np.sin(TURNS), np.zeros(len(TURNS))
    spin = [[cosine, sine, still], [-sine, cosine, still], [still, still, still + 1]]
    ways: Floats = _upright(down) @ np.moveaxis(np.array(spin), -1, 0)
    return ways


def _upright(down: Floats) -> Floats:
    """Rows that the axes become when a direction becomes -z."""
    side = unit(np.cross(np.eye(3)[np.argmin(np.abs(down))], down))
    return np.stack([side, np.cross(-down, side), -down]).T
