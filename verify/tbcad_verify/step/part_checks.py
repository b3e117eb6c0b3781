"""A STEP file held against the mesh and its own claims, whatever the part is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, guarded, short_list
from tbcad_verify.step.step_file import StepFile

GAP_MM = 1e-5  # a hundred times the kernel's own precision
CLAIM_SHARE = 1e-6  # of what the file claims
UNITS = {
    "step solid": "faults",
    "step valid": "complaints",
    "step gaps": "mm",
    "step volume": "mm^3",
    "step area": "mm^2",
    "step centroid": "mm",
    "step box": "mm",
    "step properties": "of the figure",
}


@dataclass(frozen=True)
class PartComparison:
    """One part's STEP file and the mesh that it is held against.

    Attributes:
        name: of the part.
        file: as read.
        mass: the mesh's, in the same place; None where it could not be measured.
        off: how far the mesh may be from the exact surface, mm.
        claim: by what share the file's own claims may be off: faces between edges that have no
            closed form are only integrated to about a millionth.
    """

    name: str
    file: StepFile
    mass: MassProperties | None
    off: float
    claim: float = CLAIM_SHARE


Job = Callable[[CheckName, PartComparison], Check]


def comparison_checks(file: str, lump: PartComparison) -> list[Check]:
    """All checks of one file, each guarded; `file` is its name in the report."""
    names = [(name, file, unit) for name, unit in UNITS.items()]
    return [
        check
        for name, job in zip(names, JOBS, strict=True)
        for check in guarded([name], partial(_one, job, name, lump))
    ]


def _one(job: Job, name: CheckName, lump: PartComparison) -> list[Check]:
    return [job(name, lump)]


def solid(name: CheckName, lump: PartComparison) -> Check:
    """One solid of one closed shell, with the part's name."""
    counts, named = lump.file.counts, lump.file.solids
    faults = abs(counts["solids"] - 1) + abs(counts["shells"] - 1) + counts["open_edges"]
    said = ", ".join(f"{count} {what.replace('_', ' ')}" for what, count in counts.items())
    odd = int(named != (lump.name,))
    return at_most(name, faults + odd, 0, f"{said}; named {short_list(named)}, not {lump.name}")


def valid(name: CheckName, lump: PartComparison) -> Check:
    """The kernel's own check accepts the shape."""
    return at_most(name, int(not lump.file.valid), 0, "the kernel's check refuses the shape")


def gaps(name: CheckName, lump: PartComparison) -> Check:
    """Corners lie on their edges and edges on their faces, before a reader widens them."""
    return at_most(name, lump.file.gap, GAP_MM, "corners, edges and faces do not meet")


def volume(name: CheckName, lump: PartComparison) -> Check:
    """The mesh's, as far as it may be off."""
    mesh, solid = _bulks(lump)
    return at_most(
        name,
        abs(mesh.volume - solid.volume),
        solid.area * lump.off,
        f"STEP {solid.volume:.3f}, mesh {mesh.volume:.3f}",
    )


def area(name: CheckName, lump: PartComparison) -> Check:
    """Facets off by h from a surface of radius r lose some 2 h / r of its area.

    Where the mesh's bend is known, that says more: no surface within h differs by more than it.
    """
    mesh, solid = _bulks(lump)
    radius = lump.file.faces.radius
    least = np.nanmin(radius, initial=np.ptp([solid.low, solid.high], axis=0).max() / 2)
    limit = solid.area * 2 * lump.off / float(least)
    limit = limit if mesh.bend is None else mesh.bend * lump.off
    detail = f"STEP {solid.area:.3f}, mesh {mesh.area:.3f}"
    return at_most(name, abs(mesh.area - solid.area), limit, detail)


def centroid(name: CheckName, lump: PartComparison) -> Check:
    """A layer of the mesh's error all on one side moves the middle by its share of the volume."""
    mesh, solid = _bulks(lump)
    wide = float(np.linalg.norm(np.subtract(solid.high, solid.low))) / 2
    away = float(np.linalg.norm(np.subtract(mesh.centroid, solid.centroid)))
    detail = f"STEP {_three(solid.centroid)}, mesh {_three(mesh.centroid)}"
    return at_most(name, away, wide * solid.area * lump.off / solid.volume, detail)


def box(name: CheckName, lump: PartComparison) -> Check:
    """Reaches as far as the mesh, on all six sides."""
    mesh, solid = _bulks(lump)
    away = np.abs(np.subtract([mesh.low, mesh.high], [solid.low, solid.high])).max()
    detail = (
        f"STEP {_three(solid.low)} to {_three(solid.high)}, "
        f"mesh {_three(mesh.low)} to {_three(mesh.high)}"
    )
    return at_most(name, float(away), lump.off, detail)


def properties(name: CheckName, lump: PartComparison) -> Check:
    """The file's own claims, so that any reader can tell whether it has read what was written."""
    claims, solid = lump.file.properties, lump.file.mass
    if set(claims) != {"volume", "area", "centroid"}:
        detail = f"the file claims {short_list(sorted(claims)) or 'nothing'}; all three are wanted"
        return at_most(name, np.inf, lump.claim, detail)
    wide = float(np.linalg.norm(np.subtract(solid.high, solid.low)))
    shares = (
        abs(claims["volume"] / solid.volume - 1),
        abs(claims["area"] / solid.area - 1),
        float(np.linalg.norm(np.subtract(claims["centroid"], solid.centroid))) / wide,
    )
    detail = f"volume, area, centroid off by {', '.join(f'{share:.3g}' for share in shares)}"
    return at_most(name, max(shares), lump.claim, detail)


def _bulks(lump: PartComparison) -> tuple[MassProperties, MassProperties]:
    if lump.mass is None:
        raise Unknown("the mesh could not be measured")
    return lump.mass, lump.file.mass


def _three(point: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in point) + ")"


JOBS: tuple[Job, ...] = (solid, valid, gaps, volume, area, centroid, box, properties)
