"""The planes in which a shell or a negative must end: the seam x = 0 and the foot.

The other half lies beyond the one, the table or the base below the other: what sticks out by a
tenth of a millimetre keeps the joint open. A half touches both planes, so its box says it all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tbcad_verify.record.export import Export, Part
from tbcad_verify.record.flange_holes import X, Z
from tbcad_verify.report.checks import Check, CheckName, at_most, short_list


def has_joining_planes(export: Export, part: Part) -> bool:
    """Whether a part is one camera's half: other parts may be anywhere."""
    return part.camera in export.cameras


def ends_check(
    name: CheckName,
    export: Export,
    part: Part,
    box: tuple[Sequence[float], Sequence[float]],
    limit: float,
) -> Check:
    """A half ends in the planes of seam and foot, neither beyond nor short of them.

    Args:
        name: of the check.
        export: the record.
        part: the half.
        box: its minimum and maximum x, y, z, mm.
        limit: mm.
    """
    beyond = _beyond(export, part, box)
    worst = max(abs(way) for way in beyond.values())
    told = [_told(plane, way) for plane, way in beyond.items() if not abs(way) <= limit]
    return at_most(name, worst, limit, f"{part.name} ends {short_list(told)}")


def _beyond(
    export: Export, part: Part, box: tuple[Sequence[float], Sequence[float]]
) -> dict[str, float]:
    """How far a half reaches beyond each plane, mm; negative: how far it falls short."""
    low, high = box
    side = float(np.sign(export.cameras[part.camera].pinhole[X]))
    nearest = low[X] if side > 0 else -high[X]
    return {"seam": -nearest, "foot": export.foot_z_mm - low[Z]}


def _told(plane: str, way: float) -> str:
    return f"{abs(way):.3g} mm {'beyond' if way > 0 else 'short of'} the {plane}"
