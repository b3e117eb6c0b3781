"""A build: the record, what was asked for, and the manifest."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from tbcad_verify.run.processes import at_once

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.common.schedule import Submit
from tbcad.core.camera.sheet import RigLight, write_camera_sheet
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.design import Spec, without_sections
from tbcad.core.spec.errors import SpecError
from tbcad.output.manifest import write_manifest
from tbcad.output.parts import PARTS, PROTOTYPE, SHELL, only_shell_remains
from tbcad.prototype.files.write import export_prototype
from tbcad.prototype.purchased.parts import load_parts
from tbcad.records.design import ShellLamps
from tbcad.shell.files import mandrel_record, write_mandrels, write_shell_meshes, write_shell_solids
from tbcad.shell.halves import check_mirrors, design_mandrel, shell_envelope
from tbcad.shell_lamps.files import printed_ring, ring_record, write_ring
from tbcad.shell_lamps.ring import lamp_ring
from tbcad.types import Progress


@dataclass(frozen=True)
class Export:
    """What was written."""

    spec: Spec  # the design's, with a value for every key that was chosen on the way
    parts: tuple[str, ...]  # some of PARTS
    note: str = ""  # why a part was left out, or cannot be used in every way; empty otherwise


def write_export(
    design: MirrorDesign,
    folder: Path,
    parts: Sequence[str] = PARTS,
    progress: Progress = lambda _: None,
    submit: Submit = at_once,
    *,
    optional_prototype: bool = False,
) -> Export:
    """Write some of PARTS into an empty folder; `submit` takes what can be done meanwhile.

    An optional prototype is left out where it cannot be made, instead of refusing.

    SpecError when something does not fit; it says what to change; InvalidSolidError when the kernel
    fails.
    """
    pending: list[Future[Any]] = []

    def submit_file(work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        pending.append(submit(work, *arguments))
        return pending[-1]

    # Refused before anything is written.
    mandrel = design_mandrel(design) if design.spec.shell.negative and SHELL in parts else None
    export = Export(design.spec, tuple(part for part in PARTS if part in parts))
    lamps, own = None, without_sections(design.spec, "prototype", "printer")
    shells = replace(design, spec=own)  # which do not follow from the rest
    if SHELL in parts:
        check_mirrors(design)
        envelope = shell_envelope(design)  # refuses flanges that do not fit
        lamps = _lamps(design, folder, submit_file)
        submit_file(write_shell_meshes, shells, envelope, folder)
        if PROTOTYPE in parts:
            submit_file(write_shell_solids, shells, envelope, folder)
        else:
            write_shell_solids(shells, envelope, folder, progress)
    # The prototype's light and mount are in its own, which replaces it.
    light, radius = (
        RigLight(lamps.lux[1] if lamps else None),
        design.spec.optics.capture_diameter_mm,
    )
    write_camera_sheet(folder, design.arrays[0], radius / 2, light)
    if PROTOTYPE in parts:
        try:
            export = replace(export, spec=export_prototype(design, folder, progress, submit_file))
        except (SpecError, InvalidSolidError) as error:
            if SHELL in parts and optional_prototype:
                export = Export(design.spec, (SHELL,), f"no prototype: {error}")
            elif SHELL in parts and isinstance(error, SpecError):
                raise only_shell_remains(error) from None
            else:
                raise
        if SHELL in parts:
            progress("shells")
    if mandrel:
        submit_file(write_mandrels, shells, mandrel, folder)
    for future in pending:
        future.result()
    if mandrel and mandrel.draft.angle < 0:
        undercut = (
            f"mandrels: undercut by up to {-np.degrees(mandrel.draft.angle):.0f} degrees, so no "
            "shell can be drawn off: dissolve them or melt them out, or set shell.edges to valley"
        )
        export = replace(export, note="; ".join(filter(None, (export.note, undercut))))
    mandrels = [mandrel_record(array, mandrel) for array in design.arrays if mandrel]
    write_record(folder, replace(design, spec=export.spec), SHELL in parts, mandrels, lamps)
    progress("manifest")
    write_manifest(folder, "build")
    return export


def _lamps(
    design: MirrorDesign, folder: Path, submit: Callable[..., Future[Any]]
) -> ShellLamps | None:
    """Write the ring of a shell's lamps; what design.json says of them, None without any."""
    ring = lamp_ring(design, load_parts())
    if ring is None:
        return None
    part = printed_ring(ring, design.spec.printer)
    submit(write_ring, design.spec, ring, part, folder)
    return ring_record(ring, part, design)
