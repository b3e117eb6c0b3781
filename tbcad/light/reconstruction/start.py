"""Where a fit starts: in the hull of the object, on a coarser grid, at another frame or checkpoint.

The hull is what rays that see the background do not pass through.
"""

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tbcad.common.atomic_files import replace_files
from tbcad.common.compiled import compiled_sum
from tbcad.errors import InputError
from tbcad.light.reconstruction.field import (
    Field,
    Grid,
    field_bytes,
    read_arrays,
    resampled,
)
from tbcad.light.reconstruction.gradient import Moments
from tbcad.light.reconstruction.marching import GLOSSY, MATT, Singles
from tbcad.light.reconstruction.rays import CapturedRays
from tbcad.light.simulate.parallel import chunks, first_then_threads
from tbcad.types import Bools

CENTRAL = np.zeros((1, 1, 2), dtype=np.float32)
FIRST_NUMBER, FIRST_COLOUR = 0.05, 0.4  # of the density; of the colours
NUMBERS = (-3.0, 60.0)
KEPT_NUMBER = 0.02  # a node near one of more than this goes on to the finer level
UNKNOWN = 0.3  # of the least number, that finer nodes outside of the coarser grid begin with
BORDER = 0.3  # of a mask between its nodes
SKIPPED = 1  # coarse grids that are left out after another frame
KNOWN = 0.05  # share of a node that must lie in the last field
HULL_NODES = (12, 64)  # along an edge: the fewest and the most
RAYS_OF_NODE = 5  # at least, in the mean
MOST_DARK = 0.3  # share of a voxel's rays that may see the background, past its edges
HULL_PARTS = 8  # of the rays, whatever the number of threads
LIGHT = 0.25  # of white: no dark background is lighter
ANEW = "begin anew with --force"


@dataclass(frozen=True)
class Level:
    """One grid of the fit."""

    nodes: int  # along each edge
    epochs: int  # how often each ray is used


@dataclass(frozen=True)
class Settings:
    """How a field is fitted."""

    levels: tuple[Level, ...] = (Level(60, 2), Level(100, 3), Level(144, 5))  # from coarse to fine
    order: int = 0  # of the view dependence of colours, 0 or 1
    # weight of the total variation of the numbers, against the squared errors of as many rays as
    # there are nodes
    smooth_density: float = 5e-5
    smooth_colour: float = 5e-4  # weight of the squared differences of colours, likewise
    sparse: float = 5e-4  # weight of the density's logarithm, likewise
    batch: int = 30_000  # rays of a step, at most
    steps: tuple[float, float] = (0.5, 0.03)  # of the numbers and of the colours, largest
    last_steps: tuple[float, float] = (0.005, 0.0005)  # of both at the end
    stride: float = 0.6  # between samples of a ray, in distances of nodes
    # of the rays of a pixel on the finest grid, (p, k, 2); coarser ones, which do not resolve a
    # pixel, take its central ray
    places: Singles = field(default_factory=lambda: CENTRAL)
    seed: int = 0  # of the random order


@dataclass
class State:
    """A fit under way, after some epochs."""

    level: int  # number of the present level
    epoch: int  # number of epochs of it that are done
    grid: Grid  # of that level
    values: Singles  # of its nodes, as of a field; two copies, of which a step reads one
    moments: Moments  # of Adam
    step: int = 0  # number of steps of the level that are done
    loss: float = np.nan  # mean squared error of the last epoch, summed over the colours

    def field(self) -> Field:
        """As a field."""
        return Field(self.grid, self.values)


def first_state(inside: Bools, capture_mm: float, settings: Settings, level: int = 0) -> State:
    """An even fog in a hull (k, k, k), on the grid of a level."""
    n = settings.levels[level].nodes
    grid = Grid.about(resampled(inside.astype(np.float32), n) > BORDER, capture_mm)
    values = np.zeros((len(grid), GLOSSY if settings.order else MATT), dtype=np.float32)
    values[:, 0], values[:, 1:MATT] = FIRST_NUMBER, FIRST_COLOUR
    return _begun(level, grid, values)


def finer(state: State, settings: Settings) -> State:
    """The present values on the next level's nodes, where something is or is near."""
    level = settings.levels[state.level + 1]
    coarse, values = state.grid, state.values
    number = coarse.dense(values[:, 0], 10 * NUMBERS[0])
    near = ndimage.binary_dilation(ndimage.maximum_filter(number, 3) > KEPT_NUMBER)
    grid = Grid.about(resampled(near.astype(np.float32), level.nodes) > BORDER, coarse.width_mm)
    known = np.maximum(grid.sampled(coarse.dense(np.ones(len(coarse), dtype=np.float32))), 0.05)
    columns: list[Singles] = [grid.sampled(coarse.dense(values[:, 0], UNKNOWN * NUMBERS[0]))]
    columns += [
        np.asarray(grid.sampled(coarse.dense(column)) / known, dtype=np.float32)
        for column in values[:, 1:].T
    ]
    return _begun(state.level + 1, grid, np.stack(columns, axis=1).astype(np.float32))


def _begun(level: int, grid: Grid, values: Singles) -> State:
    return State(level, 0, grid, values, Moments(np.zeros_like(values), np.zeros_like(values)))


def start(inside: Bools, last: Field | None, capture_mm: float, settings: Settings) -> State:
    """An even fog in the hull (k, k, k), where the object may be now, or the last frame's field.

    What the last field has there is taken on a finer grid.
    """
    if last is None or len(settings.levels) <= SKIPPED:
        return first_state(inside, capture_mm, settings)
    state = first_state(inside, capture_mm, settings, SKIPPED)
    grid, values = state.grid, state.values
    known = grid.sampled(last.grid.dense(np.ones(len(last.grid), dtype=np.float32)))
    there = known > KNOWN
    for k in range(min(values.shape[1], last.values.shape[1])):
        sampled = grid.sampled(last.grid.dense(last.values[:, k]))
        values[there, k] = sampled[there] / known[there]
    return state


def hull(rays: CapturedRays) -> Bools:
    """Nodes of a lattice (k, k, k) over the capture sphere's cube where the object may be.

    InputError: the photographs show nothing, or no background.
    """
    level = rays.dark_level()
    dark = rays.colour.max(axis=1) < level
    if dark.all() and level < LIGHT:
        raise InputError(
            f"the photographs show nothing brighter than {level:.1%} of white before a dark "
            "background: light the object, or expose longer, and capture again"
        )
    found = _inside(rays, dark)
    if not found.any():
        raise InputError(
            "the photographs show no object before a dark background: it must fit into the "
            f"capture sphere of {rays.capture_mm:g} mm, and what is behind it must be black"
        )
    return np.asarray(ndimage.binary_dilation(found))


def _inside(rays: CapturedRays, dark: Bools) -> Bools:
    """Nodes that few of the rays near them see the background through."""
    n = int(np.clip((len(rays) / RAYS_OF_NODE) ** 0.5, *HULL_NODES))
    scale, shape = (n - 1) / rays.capture_mm, (2, n, n, n)

    def count(part: slice) -> NDArray[np.int32]:
        votes = np.zeros(shape, dtype=np.int32)
        _vote(rays.entry[part], rays.direction[part], rays.length[part], dark[part], scale, votes)
        return votes

    parts = [slice(0, 0), *chunks(len(rays), max(-(-len(rays) // HULL_PARTS), 1))]
    total, seen_through = sum(first_then_threads(count, parts), np.zeros(shape, dtype=np.int64))
    return np.asarray((total > 0) & (seen_through < MOST_DARK * total))


@compiled_sum
def _vote(
    entry: Singles,
    direction: Singles,
    length: Singles,
    dark: Bools,
    scale: float,
    votes: NDArray[np.int32],
) -> None:
    """Count all rays near each node, and those that see the background."""
    middle = np.float32((votes.shape[1] - 1) / 2 + 0.5)
    for i in range(len(entry)):
        for k in range(int(length[i] * scale)):
            t = (k + np.float32(0.5)) / scale
            x = int((entry[i, 0] + direction[i, 0] * t) * scale + middle)
            y = int((entry[i, 1] + direction[i, 1] * t) * scale + middle)
            z = int((entry[i, 2] + direction[i, 2] * t) * scale + middle)
            votes[0, x, y, z] += 1
            if dark[i]:
                votes[1, x, y, z] += 1


@dataclass(frozen=True)
class Checkpoint:
    """A fit under way."""

    asked: dict[str, Any]  # all that the result follows from: options, light field, version
    settings: Settings  # that were chosen
    trials: list[dict[str, Any]]  # by which
    state: State  # after its last epoch


def part_file(out: Path) -> Path:
    """Where the checkpoint of a field lies."""
    return out.with_name(f".{out.name}.part")


def settings_record(settings: Settings) -> dict[str, Any]:
    """Settings as facts, but for the places of rays, which follow from the blur."""
    record = asdict(settings)
    del record["places"]
    return record


def settings_of(record: dict[str, Any], places: Singles) -> Settings:
    """Settings from their facts."""
    levels = tuple(Level(**one) for one in record["levels"])
    pairs = {name: tuple(record[name]) for name in ("steps", "last_steps")}
    return Settings(**{**record, **pairs, "levels": levels, "places": places})


def write_checkpoint(file: Path, kept: Checkpoint) -> None:
    """Write a checkpoint, replacing the file atomically: a field with the moments of Adam."""
    state = kept.state
    record = {
        "asked": kept.asked,
        "settings": settings_record(kept.settings),
        "trials": kept.trials,
        **{name: getattr(state, name) for name in ("level", "epoch", "step", "loss")},
    }
    made = replace(state.field(), facts=record)
    replace_files(file.parent, {file.name: field_bytes(made, **state.moments._asdict())})


def read_checkpoint(file: Path, asked: dict[str, Any], places: Singles) -> Checkpoint:
    """Read a checkpoint of the same options and light field.

    InputError: it is of others, or damaged.
    """
    try:
        made, arrays = read_arrays(file)
        record = made.facts
        check_same(file, record["asked"], asked)
        moments = Moments(arrays["mean"], arrays["square"])
        if {one.shape for one in moments} != {made.values.shape}:
            raise ValueError("its arrays do not belong together")
        state = State(record["level"], record["epoch"], made.grid, made.values, moments)
        state.step, state.loss = record["step"], record["loss"]
        return Checkpoint(asked, settings_of(record["settings"], places), record["trials"], state)
    except InputError:
        raise
    except Exception as fault:  # zip, numpy and JSON raise many kinds
        raise InputError(f"{file} is damaged ({fault}): {ANEW}") from None


def check_same(file: Path, found: dict[str, Any], asked: dict[str, Any]) -> None:
    """Refuse to go on with what was begun otherwise; InputError: it was, by what is named."""
    was, now = _flat(found), _flat(asked)
    for name, value in now.items():
        if was.get(name) != value:
            others = f"{name} {was.get(name)}, not {value}"
            what = "another capture, not of this one" if name == "light_field" else others
            raise InputError(f"{file} is of {what}: {ANEW}")


def _flat(asked: dict[str, Any]) -> dict[str, Any]:
    return {**asked, **asked.get("options", {}), "options": None}
