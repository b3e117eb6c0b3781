"""A STEP file compared with the mesh and with its own claims, whatever the part is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.mesh import MassProperties
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    guarded,
    guarded_each,
    short_list,
)
from tbcad_verify.step.step_file import StepFile

GAP_MM = 1e-5  # a hundred times the kernel's own precision
CLAIM_SHARE = 1e-6  # of what the file claims
CLAIMS = {"volume", "area", "centroid"}


@dataclass(frozen=True)
class PartComparison:
    """One part's STEP file and the mesh that it is compared with."""

    name: str  # of the part
    file: StepFile  # as read
    # of the mesh, in the same place; None where it could not be measured
    mesh_mass: MassProperties | None
    mesh_error: float  # maximum distance of the mesh from the exact surface, mm
    # maximum error of the file's own claims, as a share: faces between edges that have no closed
    # form are only integrated to about a millionth
    claim: float = CLAIM_SHARE

    @property
    def masses(self) -> tuple[MassProperties, MassProperties]:
        """Of mesh and file. Unknown: the mesh could not be measured."""
        if self.mesh_mass is None:
            raise Unknown("the mesh could not be measured")
        return self.mesh_mass, self.file.mass


Checks = Mapping[str, tuple[str, Callable[..., Check]]]  # unit and function of each, by name


def file_checks(checks: Checks, file: str, compare: Callable[[], PartComparison]) -> list[Check]:
    """All checks of one file, each unknown by itself; all where it cannot be compared.

    `file`: its name in the report.
    """
    names = [(name, file, unit) for name, (unit, _) in checks.items()]
    jobs = [job for _, job in checks.values()]
    return guarded(names, lambda: guarded_each(names, jobs, compare()))


def solid(name: CheckName, part: PartComparison) -> Check:
    """One solid of one closed shell, its product and it with the part's name."""
    counts, named = part.file.counts, part.file.solids + part.file.products
    faults = (
        int(named != (part.name, part.name))
        + abs(counts["solids"] - 1)
        + abs(counts["shells"] - 1)
        + counts["open_edges"]
    )
    counted = ", ".join(f"{count} {what.replace('_', ' ')}" for what, count in counts.items())
    return at_most(name, faults, 0, f"{counted}; named {short_list(named)}, not {part.name}")


def valid(name: CheckName, part: PartComparison) -> Check:
    """The kernel's own check accepts the shape."""
    return at_most(name, int(not part.file.valid), 0, "the kernel's check refuses the shape")


def gaps(name: CheckName, part: PartComparison) -> Check:
    """Corners lie on their edges and edges on their faces, before a reader widens them."""
    return at_most(name, part.file.gap, GAP_MM, "corners, edges and faces do not meet")


def volume(name: CheckName, part: PartComparison) -> Check:
    """The same as the mesh's, within the mesh's error."""
    mesh, solid = part.masses
    return at_most(
        name,
        abs(mesh.volume - solid.volume),
        solid.area * part.mesh_error,
        f"STEP {solid.volume:.3f}, mesh {mesh.volume:.3f}",
    )


def area(name: CheckName, part: PartComparison) -> Check:
    """Facets at distance h from a surface of radius r lose some 2 h / r of its area.

    Where the mesh's bend is known, the limit is tighter: no surface within h differs by more.
    """
    mesh, solid = part.masses
    radius = part.file.faces.radius
    smallest = np.nanmin(radius, initial=np.ptp([solid.low, solid.high], axis=0).max() / 2)
    limit = solid.area * 2 * part.mesh_error / float(smallest)
    limit = limit if mesh.bend is None else mesh.bend * part.mesh_error
    detail = f"STEP {solid.area:.3f}, mesh {mesh.area:.3f}"
    return at_most(name, abs(mesh.area - solid.area), limit, detail)


def centroid(name: CheckName, part: PartComparison) -> Check:
    """The mesh's error all on one side moves the centroid by its share of the volume."""
    mesh, solid = part.masses
    size = float(np.linalg.norm(np.subtract(solid.high, solid.low))) / 2
    distance = float(np.linalg.norm(np.subtract(mesh.centroid, solid.centroid)))
    detail = f"STEP {_three(solid.centroid)}, mesh {_three(mesh.centroid)}"
    return at_most(name, distance, size * solid.area * part.mesh_error / solid.volume, detail)


def box(name: CheckName, part: PartComparison) -> Check:
    """The same as the mesh's, on all six sides.

    STL has coordinates of 32 bits: each is off by up to half a step of theirs, and a point turned
    from the printer's bed into its place by less than one step.
    """
    mesh, solid = part.masses
    step = float(np.spacing(np.float32(np.abs([mesh.low, mesh.high]).max())))
    error = np.abs(np.subtract([mesh.low, mesh.high], [solid.low, solid.high])).max()
    detail = (
        f"STEP {_three(solid.low)} to {_three(solid.high)}, "
        f"mesh {_three(mesh.low)} to {_three(mesh.high)}"
    )
    return at_most(name, float(error), part.mesh_error + step, detail)


def properties(name: CheckName, part: PartComparison) -> Check:
    """The file's own claims, by which any reader can verify what it has read."""
    claims, solid = part.file.properties, part.file.mass
    if set(claims) != CLAIMS:
        claimed = short_list(sorted(claims)) or "nothing"
        detail = f"the file claims {claimed}; volume, area and centroid are required"
        return at_most(name, np.inf, part.claim, detail)
    size = float(np.linalg.norm(np.subtract(solid.high, solid.low)))
    shares = (
        abs(claims["volume"] / solid.volume - 1),
        abs(claims["area"] / solid.area - 1),
        float(np.linalg.norm(np.subtract(claims["centroid"], solid.centroid))) / size,
    )
    detail = f"volume, area, centroid off by {', '.join(f'{share:.3g}' for share in shares)}"
    return at_most(name, max(shares), part.claim, detail)


def _three(point: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in point) + ")"


SOLID_CHECKS: Checks = {
    "step solid": ("faults", solid),
    "step valid": ("complaints", valid),
    "step gaps": ("mm", gaps),
}
MASS_CHECKS: Checks = {
    "step volume": ("mm^3", volume),
    "step area": ("mm^2", area),
    "step centroid": ("mm", centroid),
    "step box": ("mm", box),
    "step properties": ("of the figure", properties),
}
CHECKS: Checks = {**SOLID_CHECKS, **MASS_CHECKS}
