"""The stages that read the meshes. Each stands alone: one that breaks is unknown, never passed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tbcad_verify.mesh.mass import MassProperties, mass_properties
from tbcad_verify.mesh.mesh import Mesh, Topology, examine_topology, mesh_from_facets
from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.stl import Facets, read_facets
from tbcad_verify.mesh.threemf import read_3mf, same_check
from tbcad_verify.printing.assessment import assess, print_name, to_row
from tbcad_verify.printing.assessment import checks as printing_checks
from tbcad_verify.printing.part_measures import measure
from tbcad_verify.printing.profile import Profile, built_in, load
from tbcad_verify.prototype import stages as machine
from tbcad_verify.prototype.measured_parts import MeasuredPart
from tbcad_verify.record.poses import virtual_cameras
from tbcad_verify.record.prototype_record import Printed
from tbcad_verify.record.record import Export, Part, read_export
from tbcad_verify.report.checks import Check, CheckName, attempt, guarded, require
from tbcad_verify.run.results import ResultSink
from tbcad_verify.shell import coverage, mirrors_found, pixels
from tbcad_verify.shell.integrity import fold_check, manifest_checks, mesh_checks, record_checks
from tbcad_verify.shell.optics import OpticalSetup, pinhole_of, set_up
from tbcad_verify.shell.recover import Recovery, recover

STAGES = (
    "reading",
    "3MF",
    "files and record",
    "meshes and mirrors",
    "printability",
    "optical bench",
    "coverage",
    "every pixel",
)
SOLID = ("watertight", "facets", "outward", "components", "manifold3d")
FILES = (("manifest", "manifest.json", "wrong files"), ("other files", "", "files"))


@dataclass(frozen=True)
class Solid:
    """One part as read, None where working something out broke, and why."""

    mesh: Mesh | None
    topology: Topology | None
    bulk: MassProperties | None
    recovery: Recovery | None
    checks: list[Check]
    reason: str


def stages(export: Export) -> tuple[str, ...]:
    """Titles of the stages of an export's proof, in order."""
    return (*STAGES, *(machine.STAGES if export.prototype else ()))


def run_stages(folder: Path, taker: ResultSink, printers: Sequence[str] = ()) -> None:
    """Make all stages, and hand over what each finds.

    Args:
        folder: what `tbcad build` wrote.
        taker: of stages, checks and figures.
        printers: profiles that every part must suit; none: the built-in ones, told only.

    Raises:
        BadExport: the folder is no readable export, or a profile cannot be used.
    """
    profiles = [load(name) for name in printers or built_in()]
    taker.stage("reading")
    export = read_export(folder)
    printed = export.prototype.parts if export.prototype else ()
    facets, digests = _read_parts(export, export.parts)
    others, more = _read_parts(export, printed)
    digests |= more
    taker.stage("3MF")
    every: list[Part | Printed] = [*export.parts, *printed]
    for part, one in zip(every, facets + others, strict=True):
        if part.threemf:
            digests[part.threemf] = _threemf(export, part, one, taker)
    taker.stage("files and record")
    taker.checks(guarded(FILES, lambda: manifest_checks(export, {**export.digests, **digests})))
    taker.checks(record_checks(export))
    taker.stage("meshes and mirrors")
    solids = in_threads(
        lambda pair: _solid(export, *pair), list(zip(export.parts, facets, strict=True))
    )
    del facets
    for part, solid in zip(export.parts, solids, strict=True):
        taker.checks(solid.checks)
        if solid.bulk is not None:
            taker.bulk(part.name, solid.bulk)
    taker.stage("printability")
    for part, solid in zip(export.parts, solids, strict=True):
        _printing(part, solid, profiles, bool(printers), taker)
    if export.parts:
        _optics(export, solids, taker)
    if export.prototype:
        bodies = machine.verify_prototype(export, export.prototype, others, taker)
        taker.stage(machine.PRINTING)
        for body in bodies:
            _printing(body.part, body, profiles, bool(printers), taker)


def _printing(
    part: Part | Printed,
    solid: Solid | MeasuredPart,
    profiles: list[Profile],
    wanted: bool,
    taker: ResultSink,
) -> None:
    def work() -> list[Check]:
        topology = require(solid.topology, solid.reason)
        mesh, lump = require(solid.mesh, solid.reason), require(solid.bulk, solid.reason)
        shape = measure(mesh, topology.status, lump)
        prints = [assess(part.stl, shape, profile) for profile in profiles]
        taker.prints([to_row(one) for one in prints])
        return printing_checks(prints, wanted)

    taker.checks(guarded([print_name(part.stl, profile) for profile in profiles], work))


def _read_parts(
    export: Export, parts: Sequence[Part | Printed]
) -> tuple[list[Facets], dict[str, tuple[int, str]]]:
    facets, digests = [], {}
    for part in parts:
        one, blob = read_facets(export.folder, part.stl)
        facets.append(one)
        digests[part.stl] = blob.digest
    return facets, digests


def _threemf(
    export: Export, part: Part | Printed, facets: Facets, taker: ResultSink
) -> tuple[int, str]:
    corners, blob = read_3mf(export.folder, part.threemf)
    name = ("3MF", part.threemf, "mm")
    taker.checks(guarded([name], lambda: [same_check(name, corners, facets)]))
    return blob.digest


def _solid(export: Export, part: Part, facets: Facets) -> Solid:
    mesh, reason = attempt(lambda: mesh_from_facets(facets))
    topology, odd = attempt(lambda: examine_topology(require(mesh, reason), facets))
    checks = guarded(
        [(name, part.stl, "") for name in SOLID],
        lambda: mesh_checks(part.stl, require(topology, odd)),
    )
    lump, off = attempt(lambda: mass_properties(require(mesh, reason)))
    recovery, why = attempt(
        lambda: recover(require(mesh, reason), pinhole_of(export, part), export.target_mm / 2)
    )
    folds = guarded(
        [("folds", part.stl, "edges")],
        lambda: [fold_check(part.stl, require(recovery, reason or why).folds)],
    )
    return Solid(mesh, topology, lump, recovery, checks + folds, reason or why or odd or off)


def _optics(export: Export, solids: list[Solid], taker: ResultSink) -> None:
    files = ", ".join(part.stl for part in export.parts)
    taker.stage("optical bench")
    bench, reason = attempt(lambda: _bench(export, solids))

    def ready() -> OpticalSetup:
        return require(bench, reason)

    taker.checks(
        guarded(_names(mirrors_found.CHECKS, files), lambda: mirrors_found.checks(ready(), files))
    )
    if bench is not None:
        errors = bench.match.centre_error, bench.match.radius_error
        taker.mirrors(dict(zip(("centre_error_mm", "radius_error_mm"), errors, strict=True)))
    taker.stage("coverage")
    seen, why = attempt(lambda: coverage.measure(ready()))
    taker.checks(
        guarded(
            _names(coverage.CHECKS, files),
            lambda: coverage.checks(ready(), require(seen, why), files),
        )
    )
    if seen is not None:
        virtual = virtual_cameras(export.mirrors).index
        taker.mirrors(
            {
                "coverage_facet_mm": seen.facet[virtual],
                "coverage_fitted_mm": seen.fitted[virtual],
            }
        )
    taker.stage("every pixel")
    light, why = attempt(lambda: pixels.checks(ready(), seen, files))
    taker.checks(guarded(_names(pixels.CHECKS, files), lambda: require(light, why)[1]))
    if light is not None:
        taker.mirrors({"pixels": light[0]})


def _names(units: dict[str, str], files: str) -> list[CheckName]:
    return [(name, files, unit) for name, unit in units.items()]


def _bench(export: Export, solids: list[Solid]) -> OpticalSetup:
    ready = [
        (require(solid.mesh, solid.reason), require(solid.recovery, solid.reason))
        for solid in solids
    ]
    return set_up(export, [mesh for mesh, _ in ready], [recovery for _, recovery in ready])
