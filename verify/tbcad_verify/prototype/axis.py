"""Polar angles and azimuths about the axis that the base rotates on; vectors as columns (3, N)."""

from __future__ import annotations

import numpy as np

from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.types import Floats


def axis_frame(pinhole: Floats) -> Floats:
    """(3, 3) rows: axis from the origin to the pinhole, azimuth zero (the zenith's), third."""
    axis = pinhole / np.sqrt((pinhole**2).sum())
    up = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    up /= np.sqrt((up**2).sum())
    return np.stack([axis, up, np.cross(axis, up)])


def polar_and_azimuth(frame: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Polar angles and azimuths (N,) of directions d (3, N), radians."""
    along, zero, third = (dot(np.broadcast_to(row[:, None], d.shape), d) for row in frame)
    return np.arctan2(np.hypot(zero, third), along), np.arctan2(third, zero)


def angles_between(a: Floats, b: Floats) -> Floats:
    """(N,) angles between columns, radians; exact for small ones too.

    Source: W. Kahan, How Futile are Mindless Assessments of Roundoff, 2006, section 12.
    """
    one, two = unit(a), unit(b)
    return np.asarray(2 * np.arctan2(norm(one - two), norm(one + two)))
