"""The stages that read the meshes.

Each is independent of the others: the checks of one that breaks are unknown, never passed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from queue import SimpleQueue

from tbcad_verify.mesh.holes import RoundHoles
from tbcad_verify.mesh.rays import RayScene, build_scene
from tbcad_verify.mesh.stl import Facets, read_facets
from tbcad_verify.mesh.threemf import read_3mf, same_check
from tbcad_verify.printing.assessment import (
    assess,
    own_print_checks,
    own_print_name,
    print_check,
    print_name,
    to_row,
)
from tbcad_verify.printing.part_measures import PartMeasures, measure
from tbcad_verify.printing.profile import Profile, built_in, load
from tbcad_verify.prototype.measured_parts import MeasuredPart, measure_part
from tbcad_verify.prototype.stages import PRINTING, verify_prototype
from tbcad_verify.prototype.stages import STAGES as PROTOTYPE_STAGES
from tbcad_verify.record.export import Export, read_export
from tbcad_verify.record.validation import PartFiles
from tbcad_verify.report.checks import Check, attempt, check_names, guarded, require, unknown
from tbcad_verify.run.kept import is_kept, kept
from tbcad_verify.run.processes import Processes
from tbcad_verify.run.results import MirrorChecks, Results, ResultSink
from tbcad_verify.shell import coverage, mirrors_found, pixels
from tbcad_verify.shell import lamps as shell_lamps
from tbcad_verify.shell.cutter import fillet_checks
from tbcad_verify.shell.integrity import MANIFEST, manifest_checks, mesh_ends_checks, record_checks
from tbcad_verify.shell.mandrel import mandrel_results
from tbcad_verify.shell.measured_shell import ShellPart, flipped_measures, measure_shells
from tbcad_verify.shell.mesh_casing import casing_checks, casing_names
from tbcad_verify.shell.optics import OpticalSetup, set_up

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
NO_FOLDER = Path(os.devnull)  # nothing can be read from it
MANDRELS, LAMPS = "mandrels", "lamps"
READING, THREEMF, RECORD, MESHES, PRINTABILITY, SETUP, COVERAGE, PIXELS = SHELL_STAGES


def stage_titles(export: Export) -> tuple[str, ...]:
    """Titles of the stages that a build has, in order."""
    mandrels = (MANDRELS,) if export.mandrels else ()
    lamps = (LAMPS,) if export.lamps else ()
    return (*SHELL_STAGES, *mandrels, *lamps, *(PROTOTYPE_STAGES if export.prototype else ()))


def run_stages(
    folder: Path,
    printers: Sequence[str],
    cutter_mm: float | None,
    sink: ResultSink,
    beside: Processes | None = None,
) -> None:
    """Run all stages, and hand over what each measures.

    `printers`: profiles that every part must suit; without any, the built-in ones inform only.
    `cutter_mm`: radius of a ball that is put on all mirrors; None: no ball is.

    BadExport: the folder is not a readable build, or a profile cannot be used.
    """
    profiles = [load(name) for name in printers or built_in()]
    sink(Results(stages=[READING]))
    export = read_export(folder)
    parts = (*export.parts, *export.mandrels, *export.rings, *export.printed)
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

    own = len(export.parts) + len(export.mandrels) + len(export.rings)
    printed, facets = facets[own:], facets[:own]
    prototype: SimpleQueue[Results | None] = SimpleQueue()
    work = _verify_prototype, export, printed, profiles, bool(printers)
    shells = _of_shells(export), facets, profiles, bool(printers), cutter_mm
    # Another process has to load its libraries: not where this one is free at once.
    in_two = beside and export.prototype and not is_kept(_verify_shells, *shells)
    if beside and in_two:
        ending = beside.submit(*work, heard=prototype.put)
        ending.add_done_callback(lambda _: prototype.put(None))
    _verify_shells(*shells, sink)
    if in_two:
        for results in iter(prototype.get, None):
            sink(results)
        ending.result()
    else:
        _verify_prototype(*work[1:], sink)


def run_in_two(
    folder: Path, printers: Sequence[str], cutter_mm: float | None, sink: ResultSink
) -> None:
    """Run all stages, those of the prototype in another process while shells are verified."""
    with Processes(1) as beside:
        run_stages(folder, printers, cutter_mm, sink, beside)


def _of_shells(export: Export) -> Export:
    """The record without what no check of the shells may read: such a check would be unknown."""
    spec = export.spec.model_copy(update={"prototype": None})
    return replace(export, spec=spec, folder=NO_FOLDER, manifest={}, digests={}, prototype=None)


def _all_known(found: Results | None) -> bool:
    return found is None or all(check.passed is not None for check in found.checks)


@kept("checks of shells", heard=True, sure=_all_known)
def _verify_shells(
    export: Export,
    facets: list[Facets],
    profiles: list[Profile],
    required: bool,
    cutter_mm: float | None,
    sink: ResultSink,
) -> None:
    sink(Results(stages=[MESHES]))
    last = len(facets) - len(export.rings)
    negatives, rings = facets[len(export.parts) : last], facets[last:]
    shells = _measure_shells(export, facets[: len(export.parts)], sink)
    facets.clear()  # half of the memory

    sink(Results(stages=[PRINTABILITY]))
    first, holes = _print_shells(shells, profiles, required, sink)
    if shells:
        known = _trace_shells(export, shells, first, holes, sink)
        if cutter_mm is not None:
            names = [("fillet width", part.stl, "um") for part in export.parts]
            fillets = guarded(names, lambda: fillet_checks(known(), cutter_mm))
            sink(Results(checks=fillets))
        _verify_mandrels(export, negatives, known, cutter_mm, sink)
        _verify_lamps(export, rings, known, profiles, required, sink)


def _print_shells(
    shells: Sequence[ShellPart], profiles: list[Profile], required: bool, sink: ResultSink
) -> tuple[RayScene | None, dict[str, RoundHoles]]:
    """Assess all shells as parts.

    Returns the scene of one whose image is another, for its walls and for all light; and the holes
    of each, by its name.
    """
    measured: dict[str, PartMeasures] = {}
    mesh = shells[0].mesh if any(shell.image_of for shell in shells) else None
    first = attempt(partial(build_scene, mesh))[0] if mesh else None
    for shell in shells:
        measures, lost = attempt(partial(_shell_measures, shell, measured, first))
        if measures:
            measured[shell.part.name] = measures
        _assess_printing(shell.part.stl, measures, lost, profiles, required, sink)
    return first, {name: measures.holes for name, measures in measured.items()}


def _verify_mandrels(
    export: Export,
    facets: list[Facets],
    setup: Callable[[], OpticalSetup],
    cutter_mm: float | None,
    sink: ResultSink,
) -> None:
    """The negatives, whose mirrors are compared with what was found on the shells."""
    if not export.mandrels:
        return
    sink(Results(stages=[MANDRELS]))
    for mandrel, stl in zip(export.mandrels, facets, strict=True):
        sink(mandrel_results(export, mandrel, stl, setup, cutter_mm))


def _verify_lamps(
    export: Export,
    facets: list[Facets],
    setup: Callable[[], OpticalSetup],
    profiles: list[Profile],
    required: bool,
    sink: ResultSink,
) -> None:
    """The ring of LEDs as a part, and its light by the mirrors that were found."""
    if not export.lamps:
        return
    sink(Results(stages=[LAMPS]))
    lamps, ring = export.lamps, measure_part(export.lamps.ring, facets[0])
    masses = {ring.part.name: ring.placed_mass} if ring.placed_mass else {}
    sink(Results(checks=ring.checks, masses=masses))
    measures, lost = attempt(partial(_measures, ring))
    _assess_printing(ring.part.stl, measures, lost, profiles, required, sink)
    names = check_names(shell_lamps.CHECKS, ring.part.stl)
    work = guarded(names, lambda: shell_lamps.checks(lamps, ring.placed_mesh, setup()))
    sink(Results(checks=work))


def _shell_measures(
    shell: ShellPart, measured: Mapping[str, PartMeasures], first: RayScene | None
) -> PartMeasures:
    """Figures of a shell for printers; those of a mirror image are known already.

    `measured`: shells before it.
    `first`: scene of the first of two, if the second is its image.
    """
    original = measured.get(shell.image_of.name) if shell.image_of else None
    if original and shell.mesh and shell.mass:
        return flipped_measures(original, shell.mesh, shell.mass)
    return _measures(shell, None if shell.image_of else first)


def _verify_prototype(
    export: Export, facets: list[Facets], profiles: list[Profile], required: bool, sink: ResultSink
) -> None:
    if export.prototype is None:
        return
    measured = verify_prototype(export, export.prototype, facets, sink)
    sink(Results(stages=[PRINTING]))
    for printed in measured:
        measures, lost = attempt(partial(_measures_alone, printed))
        _assess_printing(printed.part.stl, measures, lost, profiles, required, sink)
        own = partial(own_print_checks, printed.part, export.spec.printer, measures, lost)
        sink(Results(checks=guarded([own_print_name(printed.part)], own)))


def _compare_3mf(
    export: Export, part: PartFiles, facets: Facets, sink: ResultSink
) -> tuple[int, str]:
    check, digest = _compared_3mf(export.folder / part.threemf, facets)
    sink(Results(checks=[check]))
    return digest


@kept("checks of 3MF files", sure=lambda found: found[0].passed is not None)
def _compared_3mf(file: Path, facets: Facets) -> tuple[Check, tuple[int, str]]:
    corners, blob = read_3mf(file.parent, file.name)
    name = ("3MF", file.name, "mm")
    return guarded([name], lambda: [same_check(name, corners, facets)])[0], blob.digest


def _measure_shells(export: Export, stls: list[Facets], sink: ResultSink) -> list[ShellPart]:
    shells = measure_shells(export, stls)
    for shell in shells:
        masses = {} if shell.mass is None else {shell.part.name: shell.mass}
        ends = mesh_ends_checks(export, shell.part, shell.mass, shell.reason)
        sink(Results(checks=shell.checks + ends, masses=masses))
    return shells


def _measures(part: ShellPart | MeasuredPart, scene: RayScene | None = None) -> PartMeasures:
    return measure(
        require(part.mesh, part.reason),
        require(part.topology, part.reason).status,
        require(part.mass, part.reason),
        part.edges,
        scene,
    )


@kept("checks of printed parts")
def _measures_alone(part: MeasuredPart) -> PartMeasures:
    return _measures(part)


def _assess_printing(
    stl: str,
    measures: PartMeasures | None,
    lost: str,
    profiles: list[Profile],
    required: bool,
    sink: ResultSink,
) -> None:
    """The checks of all printers, of what was measured, or why it was not."""

    def work() -> list[Check]:
        shape = require(measures, lost)
        prints = [assess(stl, shape, profile) for profile in profiles]
        sink(Results(printing=[to_row(one) for one in prints]))
        return [print_check(one, required) for one in prints]

    sink(Results(checks=guarded([print_name(stl, profile) for profile in profiles], work)))


def _trace_shells(
    export: Export,
    shells: list[ShellPart],
    first: RayScene | None,
    holes: Mapping[str, RoundHoles],
    sink: ResultSink,
) -> Callable[[], OpticalSetup]:
    """The optical stages: mirrors against the record, the casing, coverage, and every pixel.

    Returns the setup, or raises Unknown.
    """
    files = ", ".join(part.stl for part in export.parts)

    def report(units: Mapping[str, str], work: Callable[[], MirrorChecks]) -> None:
        found, reason = attempt(work)
        lost = [unknown(name, reason) for name in check_names(units, files)]
        checks, columns = found or (lost, {})
        sink(Results(checks=checks, mirrors=columns))

    sink(Results(stages=[SETUP]))
    setup, no_setup = attempt(lambda: _set_up(export, shells, first))
    known = partial(require, setup, no_setup)
    report(mirrors_found.CHECKS, lambda: mirrors_found.checks(known(), files))
    casing = guarded(casing_names(export), lambda: casing_checks(known(), holes))
    sink(Results(checks=casing))
    sink(Results(stages=[COVERAGE]))
    covered, lost = attempt(lambda: coverage.measure(known()))
    report(coverage.CHECKS, lambda: coverage.checks(known(), require(covered, lost), files))
    sink(Results(stages=[PIXELS]))
    report(pixels.CHECKS, lambda: pixels.checks(known(), covered, files))
    return known


def _set_up(export: Export, shells: list[ShellPart], first: RayScene | None) -> OpticalSetup:
    meshes = [require(shell.mesh, shell.reason) for shell in shells]
    recoveries = [require(shell.recovery, shell.reason) for shell in shells]
    has_image = any(shell.image_of for shell in shells)
    shells.clear()  # from here they are one mesh: half of the memory
    return set_up(export, [meshes.pop(0) for _ in recoveries], recoveries, has_image, first)
