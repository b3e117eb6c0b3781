"""From an export to what a workshop is told of its shell."""

from pathlib import Path
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.mirror_limits.files import halves, write_half, write_record
from tbcad.mirror_limits.sensitivity import (
    Deviation,
    MirrorLimits,
    Sensitivities,
    mirror_limits,
    sensitivities,
    whole_margin_steps,
)
from tbcad.tolerancing.montecarlo.coverage import coverage
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.types import Progress

BUILDS, SEED = 50, 1


def checked_export(folder: Path) -> ExportedDesign:
    """Read an export whose shell can be inspected: it is there, and no mirror is planar."""
    export = read_export(folder)
    for name in ("shell_a.step", "shell_b.step"):
        if not (folder / name).is_file():
            raise InputError(f"{folder / name} is not there: build the shell too, tbcad build")
    if not all((one.mirrors.curvature > 0).all() for one in export.reflectors):
        raise InputError(f"{folder}: its mirrors are planar: limits are for spheres only")
    return export


def inspect(
    export: ExportedDesign, wanted: float, folder: Path, progress: Progress
) -> dict[str, Any]:
    """Write the limits of every mirror, for a wanted yield, into a folder, and return the record.

    InputError if the shell leaves no deviation, or its solids are not those of its record.
    """
    progress("sensitivities")
    found, limits = found_limits(export, wanted)
    facts = {
        "exports": str(export.folder),
        "target_mm": export.capture_mm,
        "yield": wanted,
        "simulated_minimum_mm": minimum_at_limits(export, limits),
    }
    files = {}
    for half in halves(export, limits):
        progress(half.name)
        files[half.name] = write_half(folder, export.folder, half)
    return write_record(folder, found, limits, {**facts, "files": files})


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
        wall = np.zeros(shape)
        angle = generator.uniform(0, 2 * np.pi, shape)
        tilt = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * each[:, 1, None]
        if len(model.walls):
            wall = generator.choice([-1.0, 1.0], shape) * each[:, 3]
        off = Deviation(sign[0] * each[:, 0], tilt, sign[1] * each[:, 2], wall)
        draws.append(off.draws(model))
    return float(coverage(models, (draws[0], draws[1]), worst_only=True)[0].min())
