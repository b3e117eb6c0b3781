"""A light field reconstructed: rays, choice, fit with checkpoints, and what came of it."""

from collections.abc import Callable
from dataclasses import replace
from math import log10
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.light.reconstruction.field import FACT, Field, light_field_fingerprint
from tbcad.light.reconstruction.fit import all_spans, chosen, fit, squared_error
from tbcad.light.reconstruction.marching import Singles
from tbcad.light.reconstruction.rays import (
    NO_FOOTPRINT,
    CapturedRays,
    captured_rays,
    pixel_places,
    with_weights,
)
from tbcad.light.reconstruction.start import (
    CENTRAL,
    Checkpoint,
    Level,
    Settings,
    State,
    first_state,
    hull,
    read_checkpoint,
    settings_of,
    settings_record,
    start,
    write_checkpoint,
)
from tbcad.light.reconstruction.surface import best_level, resolved_mm
from tbcad.light.simulate.capture.light_field import RAY_SIGMAS, LightField
from tbcad.options.captures import ReconstructOptions
from tbcad.types import Bools
from tbcad.version import __version__

READING, CHOICE = "rays and hull", "choice by mirrors left out"
LEFT_OUT = 0.02  # share of the mirrors that the fit does not see
LEAST_MIRRORS = 10  # with fewer none is left out
COLOURS = 3
LARGEST_DB = 99.0  # of colours that are equal
FIT = ("nodes", "epochs", "order", "rays", "blur_px", "seed")  # options that a field follows from


def asked_for(
    source: LightField, options: ReconstructOptions, last: Field | None = None
) -> dict[str, Any]:
    """All that a field follows from; the fit starts from the last field."""
    return {
        "tbcad": __version__,
        "options": {name: getattr(options, name) for name in FIT},
        FACT: light_field_fingerprint(source),
        "started_from": None if last is None else last.facts[FACT],
    }


def reconstruction(
    source: LightField,
    options: ReconstructOptions,
    part: Path | None = None,
    last: Field | None = None,
    show: Callable[[Field], None] = lambda _: None,
) -> Field:
    """Fit a field to the rays of a light field; its facts say how it was made.

    The fit starts from the last frame's field. After each epoch the field is shown, and a
    checkpoint is written to `part`, from which an interrupted fit goes on. InputError: no ray shows
    anything, or the checkpoint is of another fit.
    """
    options.progress(READING)
    asked = asked_for(source, options, last)
    places = CENTRAL if options.rays == 1 else _places(source, options)
    order = int(options.order == "1")
    settings = Settings(levels(options), order=order, places=places, seed=options.seed)
    saved = None
    if part is not None and part.exists():
        saved = read_checkpoint(part, asked, settings.places)
    rays = _weighted_rays(source, settings)
    used = used_rays(rays, options.seed)
    inside = hull(rays)
    if saved is None:
        settings, trials = _chosen(rays, inside, settings, options, last)
        state = start(inside, last, rays.capture_mm, settings)
    else:
        settings, trials, state = saved.settings, saved.trials, saved.state
    options.progress(level_name(settings.levels[state.level]))
    for reached in fit(rays, settings, used, state):
        state = reached
        if part is not None:
            write_checkpoint(part, Checkpoint(asked, settings, trials, state))
        _tell(state, settings, options)
        show(state.field())
    made = state.field()
    if not len(made.grid):
        raise InputError(
            f"nothing is left of the object after --epochs {options.epochs}: take more of them"
        )
    facts = _facts(rays, used, made, inside, settings)
    about = {"object": source.facts.get("object"), "trials": trials}
    return replace(made, facts=asked | about | facts)


def level_name(level: Level) -> str:
    """A grid as a stage."""
    return f"grid of {level.nodes} nodes"


def levels(options: ReconstructOptions) -> tuple[Level, ...]:
    """The usual grids, in proportion to the finest that is asked for."""
    usual = Settings().levels
    finest = usual[-1]
    return tuple(
        Level(
            round(one.nodes * options.nodes / finest.nodes),
            max(round(one.epochs * options.epochs / finest.epochs), 1),
        )
        for one in usual
    )


def _places(source: LightField, options: ReconstructOptions) -> Singles:
    """Of the rays of a pixel; InputError: its pixels are single rays."""
    blur = source.facts.get("blur_px", 0) if options.blur_px is None else options.blur_px
    area = source.facts.get("samples") != 1
    if not area and not blur:
        raise InputError(
            f"--rays {options.rays}: a pixel of this light field is a single ray: leave it out, or "
            "say with --blur how far the lens spread it"
        )
    return pixel_places(options.rays, float(blur), area=area)


def _weighted_rays(source: LightField, settings: Settings) -> CapturedRays:
    """The rays with what a calibration says of them; footprints only where a fit needs them."""
    wide = settings.places is not CENTRAL
    if wide or RAY_SIGMAS not in source.facts:
        return with_weights(captured_rays(source, wide), source)
    weighted = with_weights(captured_rays(source, True), source)
    return replace(weighted, footprint=NO_FOOTPRINT)


def used_rays(rays: CapturedRays, seed: int) -> Bools:
    """Which rays (n,) the fit sees: those of some mirrors are left out, to judge it by."""
    mirrors = np.unique(rays.mirror)
    if len(mirrors) < LEAST_MIRRORS:
        return np.ones(len(rays), dtype=bool)
    count = max(round(LEFT_OUT * len(mirrors)), 1)
    out = np.random.default_rng([seed, len(mirrors)]).choice(mirrors, count, replace=False)
    return ~np.isin(rays.mirror, out)


def _chosen(
    rays: CapturedRays,
    inside: Bools,
    settings: Settings,
    options: ReconstructOptions,
    last: Field | None,
) -> tuple[Settings, list[dict[str, Any]]]:
    """Weights and order by mirrors left out, and the trials; the first frame's hold for all."""
    if last is not None:
        before = settings_of(last.facts["chosen"], settings.places)
        return replace(before, levels=settings.levels, seed=settings.seed), last.facts["trials"]
    options.progress(CHOICE)
    orders = (0, 1) if options.order == "auto" else (settings.order,)
    # Trials are coarse: they do not resolve a pixel.
    single = replace(settings, places=CENTRAL)
    best, trials = chosen(rays, inside, single, orders, options.detail, options.scheduler)
    tried = [
        {"order": one.settings.order, "smooth_density": one.settings.smooth_density,
         "loss": one.loss} for one in trials
    ]  # fmt: skip
    return replace(best, places=settings.places), tried


def _tell(state: State, settings: Settings, options: ReconstructOptions) -> None:
    """Tell of an epoch that is done, and of the next grid if it was the last of this one."""
    epochs = settings.levels[state.level].epochs
    options.detail(f"epoch {state.epoch} of {epochs}, {decibels(state.loss / COLOURS):.1f} dB")
    if state.epoch == epochs and state.level + 1 < len(settings.levels):
        options.progress(level_name(settings.levels[state.level + 1]))


def _facts(
    rays: CapturedRays, used: Bools, made: Field, inside: Bools, settings: Settings
) -> dict[str, Any]:
    missed = _unexplained(rays, first_state(inside, rays.capture_mm, settings))
    error = squared_error(rays, ~used, made, settings)
    return {
        "chosen": settings_record(settings),
        "rays": len(rays),
        "rays_a_pixel": settings.places.shape[1],
        "node_count": len(made.grid),
        "unexplained_light": missed,
        "mirrors_left_out": len(np.unique(rays.mirror[~used])),
        "psnr_left_out_db": None if used.all() else decibels(error / COLOURS),
        "surface_level": _surface_level(made, rays, used),
        "resolved_mm": resolved_mm(rays),
    }


def _surface_level(made: Field, rays: CapturedRays, used: Bools) -> float | None:
    """Density of the surface, 1/mm, by rays left out, or by all; None: there is no surface."""
    try:
        return best_level(made, rays, np.ones_like(used) if used.all() else ~used)
    except InputError:
        return None


def decibels(error: float) -> float:
    """Peak signal-to-noise ratio of a mean squared error of colours from 0 to 1."""
    return -10 * log10(error) if error > 0 else LARGEST_DB


def _unexplained(rays: CapturedRays, first: State) -> float:
    """Share of the light brighter than the background on rays past the first grid."""
    light = rays.colour.max(axis=1)
    light[light < rays.dark_level()] = 0
    past = all_spans(rays, first.grid)[0] < 0
    return float(light[past].sum(dtype=np.float64) / light.sum(dtype=np.float64))
