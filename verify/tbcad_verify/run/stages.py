"""The stages that read the meshes.

Each is independent of the others: the checks of one that breaks are unknown, never passed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tbcad_verify.mesh.holes import RoundHoles
from tbcad_verify.mesh.mass import MassProperties, mass_properties
from tbcad_verify.mesh.mesh import Mesh, Topology, examine_topology, mesh_from_facets
from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.segments import Edges, measure_edges
from tbcad_verify.mesh.stl import Facets, read_facets
from tbcad_verify.mesh.threemf import read_3mf, same_check
from tbcad_verify.printing.assessment import assess, print_check, print_name, to_row
from tbcad_verify.printing.part_measures import PartMeasures, measure
from tbcad_verify.printing.profile import Profile, built_in, load
from tbcad_verify.prototype.measured_parts import MeasuredPart
from tbcad_verify.prototype.stages import PRINTING, verify_prototype
from tbcad_verify.prototype.stages import STAGES as PROTOTYPE_STAGES
from tbcad_verify.record.export import Export, Part, read_export
from tbcad_verify.record.validation import PartFiles
from tbcad_verify.report.checks import Check, attempt, check_names, guarded, require
from tbcad_verify.run.fork import StagesWork, in_order
from tbcad_verify.run.results import Results, ResultSink
from tbcad_verify.shell import coverage, mirrors_found, pixels
from tbcad_verify.shell.integrity import (
    FOLDS,
    MANIFEST,
    TOPOLOGY,
    fold_check,
    manifest_checks,
    mesh_checks,
    record_checks,
)
from tbcad_verify.shell.mandrel import mandrel_results
from tbcad_verify.shell.mesh_casing import casing_checks, casing_names
from tbcad_verify.shell.optics import OpticalSetup, pinhole_of, set_up
from tbcad_verify.shell.recover import Recovery, recover
from tbcad_verify.types import Floats

SHELL_STAGES = (
    "reading",
    "3MF",
    "files and record",
    "meshes and mirrors",
    "printability",
    "optical setup",
    "coverage",
    "every pixel",
)
MANDRELS = "mandrels"
READING, THREEMF, RECORD, MESHES, PRINTABILITY, SETUP, COVERAGE, PIXELS = SHELL_STAGES


@dataclass(frozen=True)
class ShellPart:
    """One part of a shell as measured; None where that failed.

    Attributes:
        part: its record.
        mesh: its triangles, joined.
        edges: of the mesh.
        topology: what is wrong with the mesh.
        mass: volume, area, centroid and box.
        recovery: its patches and mirrors.
        checks: of the mesh.
        reason: why something is None.
    """

    part: Part
    mesh: Mesh | None
    edges: Edges | None
    topology: Topology | None
    mass: MassProperties | None
    recovery: Recovery | None
    checks: list[Check]
    reason: str


def stage_titles(export: Export) -> tuple[str, ...]:
    """Titles of the stages that an export has, in order."""
    mandrels = (MANDRELS,) if export.mandrels else ()
    return (*SHELL_STAGES, *mandrels, *(PROTOTYPE_STAGES if export.prototype else ()))


def run_stages(
    folder: Path,
    sink: ResultSink,
    printers: Sequence[str] = (),
    begin: Callable[[StagesWork], StagesWork] = in_order,
) -> None:
    """Run all stages, and hand over what each measures.

    Args:
        folder: what `tbcad build` wrote.
        sink: takes the results.
        printers: profiles that every part must suit; without any, the built-in ones inform only.
        begin: may do the prototype's stages while the shells' are done, by its value when it is
            called.

    Raises:
        BadExport: the folder is not a readable export, or a profile cannot be used.
    """
    profiles = [load(name) for name in printers or built_in()]
    sink(Results(stages=[READING]))
    export = read_export(folder)
    parts = (*export.parts, *export.mandrels, *export.printed)
    blobs = [read_facets(export.folder, part.stl) for part in parts]
    digests = {blob.name: blob.digest for _, blob in blobs}
    facets = [facets for facets, _ in blobs]
    del blobs  # half of the memory

    sink(Results(stages=[THREEMF]))
    for part, stl in zip(parts, facets, strict=True):
        if part.threemf:
            digests[part.threemf] = _compare_3mf(export, part, stl, sink)

    sink(Results(stages=[RECORD]))
    manifest = guarded(MANIFEST, lambda: manifest_checks(export, {**export.digests, **digests}))
    sink(Results(checks=manifest + record_checks(export)))

    shells, mandrels = len(export.parts), len(export.mandrels)
    printed, facets = facets[shells + mandrels :], facets[: shells + mandrels]
    prototype = begin(lambda to: _verify_prototype(export, printed, profiles, bool(printers), to))
    _verify_shells(export, facets, profiles, bool(printers), sink)
    prototype(sink)


def _verify_shells(
    export: Export,
    facets: list[Facets],
    profiles: list[Profile],
    required: bool,
    sink: ResultSink,
) -> None:
    sink(Results(stages=[MESHES]))
    negatives = facets[len(export.parts) :]
    shells = _measure_shells(export, facets[: len(export.parts)], sink)
    facets.clear()  # half of the memory

    sink(Results(stages=[PRINTABILITY]))
    holes = {}
    for shell in shells:
        measures = _assess_printing(shell, profiles, required, sink)
        if measures:
            holes[shell.part.name] = measures.holes
    if shells:
        setup, no_setup = _trace_shells(export, shells, holes, sink)
        _verify_mandrels(export, negatives, lambda: require(setup, no_setup), sink)


def _verify_mandrels(
    export: Export, facets: list[Facets], setup: Callable[[], OpticalSetup], sink: ResultSink
) -> None:
    """The negatives, whose mirrors are compared with what was found on the shells."""
    if not export.mandrels:
        return
    sink(Results(stages=[MANDRELS]))
    for mandrel, stl in zip(export.mandrels, facets, strict=True):
        sink(mandrel_results(export, mandrel, stl, setup))


def _verify_prototype(
    export: Export,
    facets: list[Facets],
    profiles: list[Profile],
    required: bool,
    sink: ResultSink,
) -> None:
    if export.prototype is None:
        return
    measured = verify_prototype(export, export.prototype, facets, sink)
    sink(Results(stages=[PRINTING]))
    for printed in measured:
        _assess_printing(printed, profiles, required, sink)


def _compare_3mf(
    export: Export, part: PartFiles, facets: Facets, sink: ResultSink
) -> tuple[int, str]:
    corners, blob = read_3mf(export.folder, part.threemf)
    name = ("3MF", part.threemf, "mm")
    sink(Results(checks=guarded([name], lambda: [same_check(name, corners, facets)])))
    return blob.digest


def _measure_shells(export: Export, stls: list[Facets], sink: ResultSink) -> list[ShellPart]:
    pairs = list(zip(export.parts, stls, strict=True))
    shells = in_threads(lambda pair: _measure_shell(export, *pair), pairs)
    for shell in shells:
        masses = {} if shell.mass is None else {shell.part.name: shell.mass}
        sink(Results(checks=shell.checks, masses=masses))
    return shells


def _measure_shell(export: Export, part: Part, facets: Facets) -> ShellPart:
    radius_mm, pinhole = export.target_mm / 2, pinhole_of(export, part)
    mesh, no_mesh = attempt(lambda: mesh_from_facets(facets))
    topology, no_topology = attempt(lambda: examine_topology(require(mesh, no_mesh), facets))
    mass, no_mass = attempt(lambda: mass_properties(require(mesh, no_mesh)))
    edges, _ = attempt(lambda: measure_edges(require(mesh, no_mesh)))
    recovery, no_mirrors = attempt(
        lambda: recover(require(mesh, no_mesh), pinhole, radius_mm, edges)
    )
    checks = guarded(
        check_names(TOPOLOGY, part.stl),
        lambda: mesh_checks(part.stl, require(topology, no_topology)),
    ) + guarded(
        check_names(FOLDS, part.stl),
        lambda: [fold_check(part.stl, require(recovery, no_mirrors).folds)],
    )
    reason = no_mesh or no_mirrors or no_topology or no_mass
    return ShellPart(part, mesh, edges, topology, mass, recovery, checks, reason)


def _assess_printing(
    measured: ShellPart | MeasuredPart, profiles: list[Profile], required: bool, sink: ResultSink
) -> PartMeasures | None:
    """The checks of all printers; what was measured for them, if it could be."""
    stl, reason = measured.part.stl, measured.reason
    mesh, mass, topology = measured.mesh, measured.mass, measured.topology
    measures, lost = attempt(
        lambda: measure(
            require(mesh, reason),
            require(topology, reason).status,
            require(mass, reason),
            measured.edges,
        )
    )

    def work() -> list[Check]:
        shape = require(measures, lost)
        prints = [assess(stl, shape, profile) for profile in profiles]
        sink(Results(printing=[to_row(one) for one in prints]))
        return [print_check(one, required) for one in prints]

    sink(Results(checks=guarded([print_name(stl, profile) for profile in profiles], work)))
    return measures


def _trace_shells(
    export: Export,
    shells: list[ShellPart],
    holes: Mapping[str, RoundHoles],
    sink: ResultSink,
) -> tuple[OpticalSetup | None, str]:
    """The optical stages: mirrors against the record, the casing, coverage, and every pixel."""
    files = ", ".join(part.stl for part in export.parts)

    def report(
        units: Mapping[str, str], work: Callable[[], list[Check]], mirrors: dict[str, Floats]
    ) -> None:
        sink(Results(checks=guarded(check_names(units, files), work), mirrors=mirrors))

    sink(Results(stages=[SETUP]))
    setup, no_setup = attempt(lambda: _set_up(export, shells))
    report(
        mirrors_found.CHECKS,
        lambda: mirrors_found.checks(require(setup, no_setup), files),
        mirrors_found.columns(setup) if setup else {},
    )
    casing = guarded(casing_names(export), lambda: casing_checks(require(setup, no_setup), holes))
    sink(Results(checks=casing))

    sink(Results(stages=[COVERAGE]))
    covered, not_covered = attempt(lambda: coverage.measure(require(setup, no_setup)))
    report(
        coverage.CHECKS,
        lambda: coverage.checks(require(setup, no_setup), require(covered, not_covered), files),
        coverage.columns(setup, covered) if setup and covered else {},
    )

    sink(Results(stages=[PIXELS]))
    pixel_counts, no_pixels = attempt(
        lambda: pixels.checks(require(setup, no_setup), covered, files)
    )
    report(
        pixels.CHECKS,
        lambda: require(pixel_counts, no_pixels)[1],
        {"pixels": pixel_counts[0]} if pixel_counts else {},
    )
    return setup, no_setup


def _set_up(export: Export, shells: list[ShellPart]) -> OpticalSetup:
    return set_up(
        export,
        [require(shell.mesh, shell.reason) for shell in shells],
        [require(shell.recovery, shell.reason) for shell in shells],
    )
