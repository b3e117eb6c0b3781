"""The proof as a list of stages. Each stands alone: one that breaks is unknown, never passed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tbcad_verify import coverage, found, sensor
from tbcad_verify.bench import Bench, pinhole_of, set_up
from tbcad_verify.checks import Check, Name, Unknown, guarded, reason_of
from tbcad_verify.errors import BadExport
from tbcad_verify.integrity import fold_check, manifest_checks, mesh_checks, record_checks
from tbcad_verify.mesh import Mesh, examine, merge
from tbcad_verify.poses import virtual_cameras
from tbcad_verify.rays import in_threads
from tbcad_verify.record import Export, Part, read_export
from tbcad_verify.recover import Recovery, recover
from tbcad_verify.report import Findings, Report
from tbcad_verify.stl import Facets, read_facets

Floats = NDArray[np.float64]
T = TypeVar("T")

SOLID = ("watertight", "facets", "outward", "components", "manifold3d")
FILES = (("manifest", "manifest.json", "wrong files"), ("other files", "", "files"))


@dataclass(frozen=True)
class Solid:
    """One part as read: its mesh and patches, None where working them out broke, and why."""

    mesh: Mesh | None
    recovery: Recovery | None
    checks: list[Check]
    reason: str


def verify(
    folder: Path, progress: Callable[[str], None] = lambda _: None, write: bool = True
) -> Report:
    """Prove an export, and write verify.json into it.

    Args:
        folder: what `tbcad build` wrote.
        progress: called with the name of each stage before it starts.
        write: False leaves the folder as it is.

    Raises:
        BadExport: the folder is no readable export, or cannot be written to; nothing is written.
    """
    progress("reading")
    export = read_export(Path(folder))
    facets, digests = _read_parts(export)
    progress("files and record")
    checks = guarded(FILES, lambda: manifest_checks(export, {**export.digests, **digests}))
    checks += record_checks(export)
    progress("meshes and mirrors")
    solids = in_threads(
        lambda pair: _solid(export, *pair), list(zip(export.parts, facets, strict=True))
    )
    del facets
    checks += [check for solid in solids for check in solid.checks]
    findings, optical = _optics(export, solids, progress)
    report = Report(export.target_mm, (*checks, *optical), findings)
    if write:
        _write(report, export.folder)
    return report


def _write(report: Report, folder: Path) -> None:
    try:
        report.write(folder)
    except OSError as error:
        raise BadExport(f"{folder}: verify.json cannot be written ({error.strerror})") from error


def _read_parts(export: Export) -> tuple[list[Facets], dict[str, tuple[int, str]]]:
    facets, digests = [], {}
    for part in export.parts:
        one, blob = read_facets(export.folder, part.stl)
        facets.append(one)
        digests[part.stl] = blob.digest
    return facets, digests


def _solid(export: Export, part: Part, facets: Facets) -> Solid:
    mesh, reason = _attempt(lambda: merge(facets))
    checks = guarded(
        [(name, part.stl, "") for name in SOLID],
        lambda: mesh_checks(part.stl, examine(_needed(mesh, reason), facets)),
    )
    recovery, why = _attempt(
        lambda: recover(_needed(mesh, reason), pinhole_of(export, part), export.target_mm / 2)
    )
    folds = guarded(
        [("folds", part.stl, "edges")],
        lambda: [fold_check(part.stl, _needed(recovery, reason or why).folds)],
    )
    return Solid(mesh, recovery, checks + folds, reason or why)


def _optics(
    export: Export, solids: list[Solid], progress: Callable[[str], None]
) -> tuple[Findings, list[Check]]:
    files = ", ".join(part.stl for part in export.parts)
    progress("optical bench")
    bench, reason = _attempt(lambda: _bench(export, solids))

    def ready() -> Bench:
        return _needed(bench, reason)

    checks = guarded(_names(found.CHECKS, files), lambda: found.checks(ready(), files))
    progress("coverage")
    seen, why = _attempt(lambda: coverage.measure(ready()))
    checks += guarded(
        _names(coverage.CHECKS, files),
        lambda: coverage.checks(ready(), _needed(seen, why), files),
    )
    progress("every pixel")
    light, why = _attempt(lambda: sensor.checks(ready(), seen, files))
    checks += guarded(_names(sensor.CHECKS, files), lambda: _needed(light, why)[1])
    return _findings(export, bench, seen, light[0] if light else None), checks


def _names(units: dict[str, str], files: str) -> list[Name]:
    return [(name, files, unit) for name, unit in units.items()]


def _bench(export: Export, solids: list[Solid]) -> Bench:
    ready = [
        (_needed(solid.mesh, solid.reason), _needed(solid.recovery, solid.reason))
        for solid in solids
    ]
    return set_up(export, [mesh for mesh, _ in ready], [recovery for _, recovery in ready])


def _findings(
    export: Export, bench: Bench | None, seen: coverage.Coverage | None, pixels: Floats | None
) -> Findings:
    blank = np.full(len(export.mirrors), np.nan)
    virtual = virtual_cameras(export.mirrors).index
    return Findings(
        export.mirrors.ids,
        virtual,
        blank if seen is None else seen.facet[virtual],
        blank if seen is None else seen.fitted[virtual],
        blank if bench is None else bench.match.centre_error,
        blank if bench is None else bench.match.radius_error,
        blank if pixels is None else pixels,
    )


def _attempt(work: Callable[[], T]) -> tuple[T | None, str]:
    try:
        return work(), ""
    except Exception as error:
        return None, reason_of(error)


def _needed(value: T | None, reason: str) -> T:
    if value is None:
        raise Unknown(reason)
    return value
