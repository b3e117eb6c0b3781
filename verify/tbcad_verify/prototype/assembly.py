"""The assembly as STEP and as GLB: its bodies are those of the record and of the parts' own files.

Purchased parts have no file of their own. Their shapes are taken from the assembly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad_verify.mesh.mesh import MassProperties
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.glb import read_glb
from tbcad_verify.prototype.measured_parts import MeasuredPart, manifold
from tbcad_verify.record.export import Export
from tbcad_verify.record.files import MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype import RECORD, PrintedPart
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    guarded,
    no_faults,
    require,
    short_list,
)
from tbcad_verify.step.part_checks import CHECKS as PART_CHECKS
from tbcad_verify.step.part_checks import PartComparison, file_checks
from tbcad_verify.step.solids_text import TextSolid, holes, read_solids
from tbcad_verify.step.step_file import StepFile, known
from tbcad_verify.types import Floats, Ints

Shape = tuple[Floats, Ints]  # corners (V, 3) in mm, facets (F, 3)

FILE = RECORD
CHECKS = {"inventory": "faults", "leds as designed": "faults", "assembly step": "mm"}
TURNING = frozenset({"wheel", "shaft", "spacer", "collar", "coupling", "rotary_stage_top"})
VIEWS = frozenset({"capture_sphere", "camera_view"})
COUPON, SIZE_DIGITS = "coupon_", 6  # names of coupons; decimals of sizes that are the same, mm
COUPONS = ("coupons", f"{COUPON}*.step", "seats")
TOOL = "tool"  # role of parts that are not in the assembly
SAME_MM = 1e-6  # of corners in two STEP files
SINGLE_MM = 2e-3  # of the same corner in the GLB, whose numbers are single precision
CLAIM_SHARE = 1e-5  # see `PartComparison.claim`
BYTE = 1 / 255
UPWARD = np.array([0.0, 0.0, 1.0])
# Radius of an LED's pocket, and height of its dome's centre over the pocket's floor, mm. Usual T-1
# and T-1 3/4: flange 3.8 and 5.9, height 5.4 and 8.7, dome 3 and 5; play 0.1 all round.
LEDS = {"LED-3": (3.8 / 2 + 0.1, 5.4 - 1.5), "LED-5": (5.9 / 2 + 0.1, 8.7 - 2.5)}


def assembly_meshes(context: PrototypeContext) -> dict[str, Shape]:
    """Shapes of all bodies by name, in the frame of the shell.

    Unknown: there is no GLB, or it cannot be read.
    """
    name = context.prototype.assembly.glb
    if not name:
        raise Unknown("there is no GLB of the assembly")
    bodies = read_glb(read(context.export.folder, name))
    return {title: _welded(body.points, body.faces) for title, body in sorted(bodies.items())}


def _welded(points: Floats, faces: NDArray[np.int64]) -> Shape:
    """Equal corners as one: shading needs them apart."""
    # Sorted column by column, which takes a fifth of the time of np.unique's rows.
    order = np.lexsort(points.T[::-1])
    ordered = points[order]
    first = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))
    number = np.empty(order.size, dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return ordered[first], number[faces]


def assembly_solids(context: PrototypeContext) -> dict[str, TextSolid]:
    """Solids of the STEP assembly, by name. Unknown: there is none, or it cannot be read."""
    return _solids(context, context.prototype.assembly.step)


def part_solids(context: PrototypeContext) -> dict[str, TextSolid]:
    """Solids of the STEP files of all parts that are in the assembly, by name.

    Unknown: a file has no solid of its part's name, or cannot be read.
    """
    found: dict[str, TextSolid] = {}
    for part in context.prototype.parts:
        if part.role != TOOL:
            solids = _solids(context, part.step)
            if list(solids) != [part.name]:
                raise Unknown(f"{part.step} holds {short_list(list(solids))}, not {part.name}")
            found |= solids
    return found


def _solids(context: PrototypeContext, file: str) -> dict[str, TextSolid]:
    if not file:
        raise Unknown("there is no STEP file")
    try:
        return read_solids(read(context.export.folder, file, MAX_TEXT_BYTES).text())
    except Unknown as error:
        raise Unknown(f"{file}: {error}") from error


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    drawn: dict[str, Shape],
    solids: dict[str, TextSolid],
    own: dict[str, TextSolid],
) -> list[Check]:
    """Everything is there, everywhere, and in the same place.

    Of the GLB (`drawn`), the STEP assembly (`solids`) and the parts' own STEP files (`own`).
    """
    inventory, leds, same = names
    return [
        no_faults(inventory, _inventory_faults(context, drawn, solids)),
        no_faults(leds, _led_faults(context, solids.get("stage_crown"))),
        _same_places(same, context, drawn, solids, own),
    ]


def _inventory_faults(
    context: PrototypeContext, drawn: dict[str, Shape], solids: dict[str, TextSolid]
) -> Iterator[str]:
    """Bodies that the assembly lacks or has in excess, and those that turn without need."""
    prototype = context.prototype
    panels = prototype.shroud.panels if prototype.shroud else ()
    names = {part.name for part in prototype.parts if part.role != TOOL} | VIEWS
    names |= {f"ball_{k + 1}" for k in np.flatnonzero(~prototype.balls.cap)}
    names |= {one.name for one in (*prototype.bought, *prototype.fasteners, *panels)}
    for found, what in (
        (set(drawn), f"body in {prototype.assembly.glb}"),
        (set(solids), f"solid in {prototype.assembly.step}"),
    ):
        yield from (f"{what} {name} is missing" for name in sorted(names - found))
        yield from (f"{what} {name} is not asked for" for name in sorted(found - names))
    for one in prototype.bought:
        if one.turns != (one.name in TURNING):
            yield f"{one.name} turns" if one.turns else f"{one.name} does not turn"
    for name, body in read_glb(read(context.export.folder, prototype.assembly.glb)).items():
        if name in solids and not _alike(body.colour, solids[name].colour):
            yield f"{name} has another colour in {prototype.assembly.glb}"


def _alike(light: tuple[float, ...], told: tuple[float, ...]) -> bool:
    """Whether a colour as light is one as sRGB (IEC 61966-2-1), as far as bytes tell; opacities."""
    code = np.array(told[:3])
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    return len(told) == len(light) and bool(
        (np.abs([*linear, *told[3:]] - np.array(light)) <= BYTE).all()
    )


def _led_faults(context: PrototypeContext, crown: TextSolid | None) -> Iterator[str]:
    """Every LED has its pocket in the crown, where the centre of its dome is to be."""
    leds, pockets = context.prototype.leds, list[Floats]()
    if crown is not None and leds:
        radius, to_dome = LEDS[context.export.spec.prototype.stage.led]
        pockets = [
            hole.point + (to_dome - hole.depth / 2) * UPWARD
            for hole in holes(crown.faces, radius, SAME_MM)
            if abs(hole.axis @ UPWARD) > 1 - SAME_MM
        ]
    if len(pockets) != len(leds):
        yield f"{len(leds)} LEDs, the crown has {len(pockets)} pockets"
    if [led.position.tolist() for led in leds] != context.export.spec.prototype.stage.leds_mm:
        yield "the spec has LEDs elsewhere"
    for led in leds:
        distance = [np.abs(led.position - pocket).max() for pocket in pockets]
        if not min(distance, default=np.inf) <= SAME_MM:
            yield f"{led.name} has no pocket"


def _same_places(
    name: CheckName,
    context: PrototypeContext,
    drawn: dict[str, Shape],
    solids: dict[str, TextSolid],
    own: dict[str, TextSolid],
) -> Check:
    """Corners of the STEP assembly are those of the parts' own files, and of the GLB."""
    errors: dict[str, float] = {}
    for title in own.keys() & solids.keys():
        one, two = own[title].corners, solids[title].corners
        same = one.shape == two.shape
        # Both have all digits, and their limit is stricter in this share.
        errors[title] = float(np.abs(one - two).max(initial=0)) if same else np.inf
        errors[title] *= SINGLE_MM / SAME_MM
    for title in solids.keys() & drawn.keys():
        distance = np.asarray(cKDTree(drawn[title][0]).query(solids[title].corners)[0])
        errors[title] = max(errors.get(title, 0.0), float(distance.max(initial=0)))
    balls = context.prototype.balls
    for k in np.flatnonzero(~balls.cap).tolist():
        title, centre = f"ball_{k + 1}", balls.columns("bx", 3)[:, k]
        faces = solids[title].faces if title in solids else ()
        off = [
            float(
                max(np.abs(face.point - centre).max(), abs(face.radius - balls.body_radius_mm[k]))
            )
            for face in faces
            if face.kind == "sphere"
        ]
        errors[title] = max(off, default=np.inf)
    wrong = sorted(title for title, error in errors.items() if not error <= SINGLE_MM)
    worst = max(errors.values(), default=np.inf)
    return at_most(name, worst, SINGLE_MM, f"elsewhere, or of another shape: {short_list(wrong)}")


def all_solids(parts: list[MeasuredPart], drawn: Mapping[str, Shape]) -> dict[str, Any]:
    """All bodies of the assembly by name as manifold3d has them; printed ones are their meshes'.

    Unknown: one is no closed solid, or a part has no mesh.
    """
    solids = {name: closed_solid(name, drawn) for name in sorted(drawn) if name not in VIEWS}
    return solids | {part.part.name: part.solid for part in parts if part.part.name in solids}


def closed_solid(name: str, drawn: Mapping[str, Shape]) -> Any:
    """One body as manifold3d has it. Unknown: it is missing, or no closed solid."""
    if name not in drawn:
        raise Unknown(f"the assembly lacks {name}")
    solid = manifold(*drawn[name])
    if solid.status().name != "NoError":
        raise Unknown(f"{name} of the assembly is no closed solid ({solid.status().name})")
    return solid


def part_step_checks(
    export: Export, masses: dict[str, MassProperties], files: dict[str, StepFile | Unknown]
) -> list[Check]:
    """All checks of the STEP files of a prototype's parts, and of its coupons."""
    checked = printed_step_checks(export, export.printed, masses, files)
    return checked + guarded([COUPONS], lambda: [_coupon_check(export, files)])


def printed_step_checks(
    export: Export,
    parts: Sequence[PrintedPart],
    masses: dict[str, MassProperties],
    files: dict[str, StepFile | Unknown],
) -> list[Check]:
    """All checks of the STEP files of printed parts, against figures of the placed meshes."""

    def compared(part: PrintedPart) -> PartComparison:
        file, mass = known(files[part.name]), masses.get(part.name)
        return PartComparison(part.name, file, mass, export.mesh_error_mm, CLAIM_SHARE)

    return [
        check
        for part in parts
        if part.step
        for check in file_checks(PART_CHECKS, part.step, partial(compared, part))
    ]


def _coupon_check(export: Export, files: dict[str, StepFile | Unknown]) -> Check:
    """The coupons have a seat, which is a hollow sphere, for each size to try and each offset."""
    base = export.spec.prototype.base
    radii = np.round(require(export.prototype, "").balls.body_radius_mm, SIZE_DIGITS)
    wanted = min(base.coupon_sizes, len(np.unique(radii))) * len(base.coupon_offsets_mm)
    coupons = [part for part in export.printed if part.name.startswith(COUPON)]
    seats = sum(int(known(files[part.name]).faces.inward.sum()) for part in coupons)
    return at_most(COUPONS, abs(seats - wanted), 0, f"{seats} seats, the spec asks for {wanted}")
