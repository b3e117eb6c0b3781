"""Checks that need no optics.

The files are those of the manifest, the record is the design's, and the meshes are closed solids.
"""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase

import numpy as np

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.mesh import MassProperties, Topology
from tbcad_verify.record.export import Export, Part
from tbcad_verify.record.files import digest, listing
from tbcad_verify.record.flange_holes import ends_check, has_joining_planes
from tbcad_verify.record.poses import (
    POSE_MM,
    contradictions,
    figure_errors,
    malformed,
    missing_directions,
    pose_errors,
)
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    check_names,
    each_at_most,
    guarded,
    guarded_each,
    informative,
    require,
    short_list,
)
from tbcad_verify.report.report import NAME
from tbcad_verify.report.text import CHANGED, PAPER

LEAST_VOLUME_MM3 = 1e-6
KINDS = {"stl": ".stl", "step": ".step", "threemf": ".3mf"}  # files that every part has
# Written after the manifest; report.html shows what a verification found, and is no part.
OWN_FILES = frozenset({"manifest.json", NAME, "report.html"})
# What a person reads, and no machine: its owner may edit it. Drawings keep their paper's size.
PAPER_FILES = (
    *("bom.csv", "wiring.csv", "camera.json", "lamp_list.csv", "lamp_wiring.csv"),
    *("assembly.pdf", "*.pdf"),
)
MANIFEST = (("manifest", "manifest.json", "wrong files"), PAPER, ("other files", "", "files"))
TOPOLOGY = {
    "watertight": "bad edges",
    "facets": "bad facets",
    "signed volume": "mm^3",
    "components": "solids",
    "manifold3d": "complaints",
}
FOLDS = {"folds": "edges"}
ENDS = {"mesh seam and foot": "mm"}


def manifest_checks(export: Export, parsed: Mapping[str, tuple[int, str]]) -> list[Check]:
    """Every listed file is there with its size and sha256; paper and other files are listed."""
    changed = [
        name
        for name, listed in sorted(export.manifest.items())
        if parsed.get(name, _found(export, name)) != listed
    ]
    edited = [name for name in changed if is_paper(name)]
    wrong = [name for name in changed if not is_paper(name)]
    unlisted = sorted({*parsed, *export.files} - {*export.manifest} - OWN_FILES)
    unread = sorted({*export.manifest} - export.files - {*PAPER_FILES})
    others = sorted(listing(export.folder) - {*export.manifest} - OWN_FILES)
    manifest, paper, other_files = MANIFEST
    return [
        at_most(
            manifest,
            len(wrong + unlisted + unread),
            0,
            "missing, unlisted, not as written, or of no part: "
            + short_list(wrong + unlisted + unread),
        ),
        informative(paper, len(edited), CHANGED + ", ".join(edited) if edited else ""),
        informative(other_files, len(others), short_list(others)),
    ]


def is_paper(name: str) -> bool:
    """Whether a file is only read by people."""
    return any(fnmatchcase(name, pattern) for pattern in PAPER_FILES)


RECORD = (
    ("requirements", "design.json", "unlike its spec"),
    ("part files", "design.json", "files"),
    ("ids", "mirrors.csv", "bad ids"),
    ("poses", "mirrors.csv", "mm off"),
    ("figures", "mirrors.csv", "mm off"),
    ("directions", "mirrors.csv", "misplaced or missing"),
)


def record_checks(export: Export) -> list[Check]:
    """Record and spec agree, and mirrors are on their ellipsoids."""
    return guarded_each(
        RECORD, (_requirements, _part_files, _ids, _poses, _figures, _directions), export
    )


def mesh_checks(file: str, topology: Topology) -> list[Check]:
    """The checks of `TOPOLOGY`: one closed, oriented solid without faulty facets."""
    watertight, facets, outward, components, manifold = check_names(TOPOLOGY, file)
    return [
        at_most(
            watertight,
            topology.open_edges + topology.crowded_edges + topology.turned_edges,
            0,
            f"{topology.open_edges} open, {topology.crowded_edges} with more than two facets, "
            f"{topology.turned_edges} with facets turned against each other",
        ),
        at_most(
            facets,
            topology.degenerate + topology.duplicate + topology.stored_normals,
            0,
            f"{topology.degenerate} without area, {topology.duplicate} doubled, "
            f"{topology.stored_normals} with a stored normal against their corners' order",
        ),
        at_least(
            outward,
            topology.volume,
            LEAST_VOLUME_MM3,
            "inside out: the signed volume is not positive",
        ),
        at_most(components, topology.components, 1, "more than one piece"),
        at_most(manifold, int(topology.status != "NoError"), 0, topology.status),
    ]


def fold_check(file: str, folds: int) -> Check:
    """No facet lies back to back with its neighbour."""
    (name,) = check_names(FOLDS, file)
    return at_most(name, folds, 0, "the surface is folded onto itself")


def mesh_ends_checks(
    export: Export, part: Part, mass: MassProperties | None, reason: str
) -> list[Check]:
    """A half's mesh ends at seam and foot; none for other parts.

    Both planes are exact in a mesh, whatever its chords: only float32 moves a corner, by half a
    step of its largest coordinates.

    `reason`: why the mass is None.
    """
    if not has_joining_planes(export, part):
        return []
    (name,) = check_names(ENDS, part.stl)

    def work() -> list[Check]:
        low, high = require(mass, reason).low, require(mass, reason).high
        step = float(np.spacing(np.float32(np.abs([low, high]).max())))
        return [ends_check(name, export, part, (low, high), step)]

    return guarded([name], work)


def _found(export: Export, name: str) -> tuple[int, str] | None:
    if name in OWN_FILES:
        return None
    try:
        return digest(export.folder, name)
    except BadExport:
        return None


def _requirements(name: CheckName, export: Export) -> Check:
    keys = contradictions(export)
    return at_most(name, len(keys), 0, f"the record is not its own spec's: {short_list(keys)}")


def _part_files(name: CheckName, export: Export) -> Check:
    """Every part has a mesh, a solid and a 3MF, all called as it is."""
    wrong = [
        f"{part.name} has {getattr(part, kind) or 'none'} for {part.name}{suffix}"
        for part in (*export.parts, *export.mandrels, *export.printed, *export.rings)
        for kind, suffix in KINDS.items()
        if getattr(part, kind) != part.name + suffix
    ]
    return at_most(name, len(wrong), 0, short_list(wrong))


def _ids(name: CheckName, export: Export) -> Check:
    bad = malformed(export.mirrors)
    return at_most(name, len(bad), 0, f"twice, or not camera letter and number: {short_list(bad)}")


def _poses(name: CheckName, export: Export) -> Check:
    reason = "off the ellipsoid, not bisecting, or centre off the normal: "
    return each_at_most(name, export.mirrors.ids, pose_errors(export), POSE_MM, "mm", reason)


def _figures(name: CheckName, export: Export) -> Check:
    reason = "polar angle, azimuth, theta_0, half width or theta_1 is another: "
    return each_at_most(name, export.mirrors.ids, figure_errors(export), POSE_MM, "mm", reason)


def _directions(name: CheckName, export: Export) -> Check:
    misplaced, missing = missing_directions(export)
    return at_most(
        name,
        len(misplaced) + missing,
        0,
        f"{missing} vertices of the polyhedron without a mirror; "
        f"no vertex of their own: {short_list(misplaced) or 'none'}",
    )
