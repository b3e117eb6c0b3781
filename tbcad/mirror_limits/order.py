"""From an export and a process chain to what a workshop is told of the shells."""

import json
from dataclasses import asdict
from math import ceil, log
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.core.mirrors.array import mirror_ids
from tbcad.core.optics.reflection import SCATTERED, roughness_nm
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.mirror_limits.files import (
    RECORD,
    SCHEMA,
    UNITS,
    halves,
    write_solid,
    write_table_of,
)
from tbcad.mirror_limits.held import (
    GOOD,
    TWO_SIGMA,
    Chain,
    chain_of,
    confidence,
    measurements,
    sampled,
)
from tbcad.mirror_limits.sensitivity import (
    Deviation,
    MirrorLimits,
    Sensitivities,
    mirror_limits,
    sensitivities,
    whole_margin_steps,
)
from tbcad.options.builds import OrderOptions
from tbcad.tolerancing.montecarlo.coverage import coverage
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.process.process import Process

BUILDS, SEED = 50, 1


def checked_export(folder: Path, process: Process, chain: str) -> ExportedDesign:
    """Read an export whose shells a chain can make: its solids are there, no mirror is planar."""
    export, remedies = read_export(folder), {"shell": "build the shell too, tbcad build"}
    if process.mandrel_cutter_mm is not None:
        way = "tbcad build --set shell.negative=true, or with --for-process"
        remedies["mandrel"] = f"{chain} takes shells from mandrels: {way} {chain}"
    for solid, remedy in remedies.items():
        missing = (one for half in "ab" if not (one := folder / f"{solid}_{half}.step").is_file())
        if file := next(missing, None):
            raise InputError(f"{file} is not there: {remedy}")
    if not all((one.mirrors.curvature > 0).all() for one in export.reflectors):
        raise InputError(f"{folder}: its mirrors are planar: limits are for spheres only")
    return export


def write_order(
    export: ExportedDesign, process: Process, options: OrderOptions, folder: Path
) -> dict[str, Any]:
    """Write limits of every mirror and what a chain holds of them into a folder; the record.

    InputError if the shell leaves no deviation, the mandrel's cutter does not fit, or solids are
    not those of the record.
    """
    options.progress("sensitivities")
    found, limits = found_limits(export, options.wanted)
    options.progress(process.name)
    chain = chain_of(export, process, options.chain, limits, options.wanted)
    files = [RECORD]
    of_shells = halves(export, limits, chain.each)
    shares = np.split(chain.mandrel_share, 2)
    for half, share in zip(of_shells, shares, strict=True):
        mandrel = [half.mandrel(share)] if process.mandrel_cutter_mm is not None else []
        files.append(write_table_of(folder, half))
        for one in (half, *mandrel):
            options.progress(one.name)
            files.append(write_solid(folder, export.folder, one, _notes(chain)))
    record = _record(export, found, limits, chain) | {"files": sorted(files)}
    (folder / RECORD).write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return record


def _notes(chain: Chain) -> dict[str, str]:
    """Notes of STEP files: each figure with what the chain holds of it."""
    told = {f"chain holds {one.name}": one.text for one in chain.figures}
    return {"chain": f"{chain.process.name}: {chain.verdict}"} | told


def _record(
    export: ExportedDesign, found: Sensitivities, limits: MirrorLimits, chain: Chain
) -> dict[str, Any]:
    """The record of an order."""
    each = {"smallest": limits.each.min(axis=0), "median": np.median(limits.each, axis=0)}
    process, numbers = chain.process, sampled(export.reflectors[0].mirrors.apex, limits)
    ids = [mirror_ids(one.camera_id, len(one)) for one in export.reflectors]
    return {
        "schema": SCHEMA,
        "exports": str(export.folder),
        "target_mm": export.capture_mm,
        "yield": chain.wanted,
        "foot_z_mm": export.reflectors[0].foot,
        "simulated_minimum_mm": minimum_at_limits(export, limits),
        "designed_minimum_mm": float(found.coverage.min()),
        "limits": {
            **{name: dict(zip(UNITS, row.tolist(), strict=False)) for name, row in each.items()},
            "seat_um": limits.seat_um,
        },
        "chain": {
            "name": process.name,
            "title": process.title,
            "good": chain.good,
            "holds": chain.holds,
            "verdict": chain.verdict,
            "mandrel_cutter_mm": process.mandrel_cutter_mm,
            "coat": {
                "mean_um": process.coating_um.mean,
                "two_sigma_um": TWO_SIGMA * process.coating_um.sigma,
            },
            "smallest_radius_mm": min(float(one.mirrors.radius.min()) for one in export.reflectors),
            "figures": [asdict(one) for one in chain.figures],
            "steps": [step.model_dump(mode="json", exclude_none=True) for step in process.made],
        },
        "finish": {"rq_nm": roughness_nm(), "scattered": SCATTERED},
        "measuring": measurements(export, limits, process.made, chain.mandrel_share),
        "samples": {
            "mirrors": [[names[k] for k in numbers] for names in ids],
            "good": GOOD,
            "confidence": confidence(len(ids) * len(numbers)),
            "for_95": ceil(log(1 - 0.95) / log(GOOD)),
        },
    }


def found_limits(export: ExportedDesign, wanted: float) -> tuple[Sensitivities, MirrorLimits]:
    """Losses of an export's virtual cameras, and the limits that follow; see `mirror_limits`.

    Losses are taken for small deviations. They grow faster than those: another edge of a cell
    becomes the one that limits its coverage. Where edges do not depend on neighbours, deviations
    are large enough for that. So losses are then taken for deviations that would cost the whole
    margin. Each is convex, so what several kinds cost together is at most the mean of what each
    costs when it is as many times as large.
    """
    found = sensitivities(export.reflectors)
    limits = mirror_limits(found, export.capture_mm, wanted)
    if minimum_at_limits(export, limits) >= export.capture_mm:
        return found, limits
    radius = np.concatenate([one.mirrors.radius for one in export.reflectors])
    steps = whole_margin_steps(found, limits, radius)
    found = sensitivities(export.reflectors, steps)
    return found, mirror_limits(found, export.capture_mm, wanted).within(steps, found)


def minimum_at_limits(export: ExportedDesign, limits: MirrorLimits, builds: int = BUILDS) -> float:
    """Minimum coverage of simulated shells whose mirrors are all at their limits, mm.

    Each deviation is at its limit one way or the other, at random; tilts in random directions.
    """
    models, generator = edge_models(export.reflectors), np.random.default_rng(SEED)
    draws = []
    for model, each in zip(models, np.split(limits.each, 2), strict=True):
        shape = (builds, len(model))
        sign = generator.choice([-1.0, 1.0], (2, *shape))
        angle, wall = generator.uniform(0, 2 * np.pi, shape), np.zeros(shape)
        tilt = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * each[:, 1, None]
        if len(model.walls):
            wall = generator.choice([-1.0, 1.0], shape) * each[:, 3]
        off = Deviation(sign[0] * each[:, 0], tilt, sign[1] * each[:, 2], wall)
        draws.append(off.draws(model))
    return float(coverage(models, (draws[0], draws[1]), worst_only=True).min())
