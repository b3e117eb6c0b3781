"""What the sheet of an order says in words and figures, by the record of the order."""

from typing import Any

from tbcad.cad.drafting.sheet import TitleBlock
from tbcad.cad.formats.pdf import drawable
from tbcad.core.spec.design import Spec
from tbcad.mirror_limits.held import IN_STATISTICS
from tbcad.mirror_limits.measuring import UNCERTAINTY_SHARE

FIGURE_HEAD = ("figure", "limit", "limit of 2 sigma", "chain, 2 sigma", "verdict")
ANY, AS_AGREED = "any", "as agreed with the workshop"
LIMITS = (
    "Limits hold for all mirrors at once. A line is of the mirror that would pass its limit first; "
    "all are in inspection_a.csv and inspection_b.csv. Offset counts against neighbouring "
    "mirrors; warp is what they share in the frame A | B | C. 0: the others use up the margin."
)
STATISTICS = (
    "Held in statistics: single mirrors may pass their limits; accept by the standard deviation of "
    "the samples, at most half of the limit of 2 sigma."
)
FINE = "white-light interferometer"  # for roughness
COARSE = "tactile CMM"  # for planes and holes
Block = tuple[str, list[str]]
"""A head and its texts, each of which begins a line."""


def title_block(record: dict[str, Any], spec: Spec) -> TitleBlock:
    """What the title block says."""
    named = [step["material"]["value"] for step in record["chain"]["steps"] if "material" in step]
    return TitleBlock(
        title=f"Order: shells by {record['chain']['name']}",
        design=f"{spec.name}, n = {spec.optics.n}",
        item="shell_a as drawn; shell_b mirrored at x = 0",
        quantity=len(record["samples"]["mirrors"]),
        material=named[-1] if named else AS_AGREED,
        tolerances="of *_tolerances.step",
    )


def figure_rows(record: dict[str, Any]) -> list[tuple[str, ...]]:
    """Each figure with its limits and what the chain holds."""
    return [
        (
            f"{one['name']}, {one['unit']}",
            *(ANY if one[key] is None else f"{one[key]:.3g}" for key in ("limit", "statistics")),
            f"{one['chain']:.3g}",
            one["verdict"],
        )
        for one in record["chain"]["figures"]
    ]


def blocks(record: dict[str, Any], spec: Spec) -> list[Block]:
    """All that is told in words."""
    chain, half = record["chain"], record["measuring"]
    cutter, solids = chain["mandrel_cutter_mm"], "Mandrel and shell" if len(half) > 1 else "Shell"
    told = [
        ("Verdict", [f"{chain['title']}. {chain['verdict']}.", LIMITS, *_statistics(chain)]),
        ("Steps", [_step(k, step) for k, step in enumerate(chain["steps"], 1)]),
        ("Coat", [_coat(record, spec)]),
        ("Edges, radii", _edges(chain)),
        ("Flanges", [_flanges(spec)]),
        ("Clamping", _clamping(cutter is not None)),
        ("Finish", [_finish(record["finish"])]),
        ("Measuring", [*map(_measurement, half), _planes(record)]),
        ("Sampling", _sampling(record["samples"], solids)),
        ("Quantity", [_quantity(cutter is not None)]),
    ]
    return [(head, [drawable(text) for text in texts]) for head, texts in told]


def _statistics(chain: dict[str, Any]) -> list[str]:
    return [STATISTICS] if any(one["verdict"] == IN_STATISTICS for one in chain["figures"]) else []


def _step(number: int, step: dict[str, Any]) -> str:
    facts = [step[key]["value"] for key in ("material", "treatment") if key in step]
    return f"{number} {': '.join(filter(None, (step['title'], '; '.join(facts))))}."


def _coat(record: dict[str, Any], spec: Spec) -> str:
    coat, known = record["chain"]["coat"], spec.mirrors.coating_um
    return (
        f"On mirrors only; A, B and holes are masked. {coat['mean_um']:.3g} ± "
        f"{coat['two_sigma_um']:.2g} um thick (the design allows for {known:g} um). STEP files and "
        "tables are of the surface below it."
    )


def _edges(chain: dict[str, Any]) -> list[str]:
    fillet = chain["figures"][-1]
    allowed = ANY if fillet["limit"] is None else f"{fillet['limit']:.3g} {fillet['unit']}"
    rounded = f"radius {allowed} at most, {fillet['chain']:.3g} {fillet['unit']} by the chain"
    outer = "Outer edges and holes broken 0.2 to 0.5 mm, no burr."
    smallest, cutter = chain["smallest_radius_mm"], chain["mandrel_cutter_mm"]
    if cutter is None:
        return [outer, f"Inner radius: fillets in the valleys between mirrors, {rounded}."]
    return [
        f"Ridges between the mandrel's mirrors stay sharp, not broken: {rounded}. {outer}",
        f"Inner radius: smallest pocket R {smallest:.2f} mm; ball cutter R {cutter:g} mm.",
    ]


def _flanges(spec: Spec) -> str:
    shell = spec.shell
    sizes = (
        f"{name} {flange.thickness_mm:g} mm thick, {flange.width_mm:g} mm wide"
        for name, flange in (("foot", shell.foot_flange), ("seam", shell.seam_flange))
    )
    return (
        f"{', '.join(sizes).capitalize()}; wall {shell.wall_mm:g} mm behind the deepest valley. "
        f"Holes of {shell.foot_flange.dowel_hole_mm:g} mm are H7 for dowels, the others for bolts."
    )


def _clamping(mandrel: bool) -> list[str]:
    if not mandrel:
        return ["On back and flanges, never on mirrors; A, B and mirrors are cut in one set-up."]
    return [
        "Mandrel: a plate is bolted on A by its blind holes, one of plastic on B for the bath; A, "
        "B and mirrors are cut in one set-up.",
        "Shell: plates with pins in the mandrel's dowel holes shape the flanges, cast behind the "
        "deposit.",
    ]


def _finish(finish: dict[str, Any]) -> str:
    return (
        f"Mirrors Rq (Sq) {finish['rq_nm']:.1f} nm or less: total integrated scatter "
        f"1 - exp(-(4 pi Rq / 550 nm)^2) of {finish['scattered']:.0%}. Others: Ra 1.6 um."
    )


def _measurement(one: dict[str, Any]) -> str:
    known = "" if one["uncertainty_um"] is None else f", U {one['uncertainty_um']:g} um"
    return (
        f"{one['solid'].capitalize()}, offset, tilt, radius of each patch by a fit: heights to U "
        f"{one['required_um']:.2g} um (k = 2), {UNCERTAINTY_SHARE:.0%} of the limits; "
        f"{one['instrument']}{known}: {one['verdict']}."
    )


def _planes(record: dict[str, Any]) -> str:
    rq, seat = record["finish"]["rq_nm"], record["limits"]["seat_um"]
    return (
        f"Rq: {FINE}, U {UNCERTAINTY_SHARE * rq:.1f} nm. Flatness of A and B {seat:g} um: "
        f"{COARSE}, U {UNCERTAINTY_SHARE * seat:.2g} um; holes ±0.02 mm: the same, U 5 um."
    )


def _sampling(samples: dict[str, Any], solids: str) -> list[str]:
    first, other = samples["mirrors"]
    count, good = len(first) + len(other), samples["good"]
    return [
        f"{solids}: {len(first)} mirrors of each half, the tightest all over it: "
        f"{' '.join(first)}, and of b the same numbers.",
        f"All within limits: {good:.0%} of the mirrors are good with a confidence of 1 - "
        f"{good:g}^{count} = {samples['confidence']:.0%} ({samples['for_95']} for 95 %). One "
        "outside: measure all.",
    ]


def _quantity(mandrel: bool) -> str:
    source = ", from 1 mandrel_a and 1 mandrel_b, which stay the customer's" if mandrel else ""
    return f"1 shell_a and 1 shell_b{source}."
