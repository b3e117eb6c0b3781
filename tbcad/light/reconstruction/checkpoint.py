"""A fit that was interrupted: its file beside the field that it was to become."""

import json
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.common.atomic_files import replace_files
from tbcad.errors import InputError
from tbcad.light.reconstruction.gradient import Moments
from tbcad.light.reconstruction.grid import Grid
from tbcad.light.reconstruction.marching import Singles
from tbcad.light.reconstruction.start import Level, Settings, State

SCHEMA = "tbcad-field-part/1"
ANEW = "begin anew with --force"


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
    """Write a checkpoint, replacing the file as a whole."""
    state = kept.state
    record = {
        "schema": SCHEMA,
        "asked": kept.asked,
        "settings": settings_record(kept.settings),
        "trials": kept.trials,
        "level": state.level,
        "epoch": state.epoch,
        "step": state.step,
        "loss": state.loss,
        "nodes": state.grid.n,
        "width_mm": state.grid.width_mm,
    }
    with BytesIO() as buffer:
        np.savez(
            buffer,
            allow_pickle=False,
            record=np.array(json.dumps(record)),
            place=state.grid.place,
            values=state.values,
            mean=state.moments.mean,
            square=state.moments.square,
        )
        replace_files(file.parent, {file.name: buffer.getvalue()})


def read_checkpoint(file: Path, asked: dict[str, Any], places: Singles) -> Checkpoint:
    """Read a checkpoint of the same options and light field.

    Raises:
        InputError: it is of others, or damaged.
    """
    try:
        with np.load(file, allow_pickle=False) as store:
            arrays = {name: store[name] for name in store.files}
        record = json.loads(str(arrays["record"]))
        if record["schema"] != SCHEMA:
            raise ValueError(f"its schema is not {SCHEMA}")
        check_same(file, record["asked"], asked)
        settings = settings_of(record["settings"], places)
        return Checkpoint(asked, settings, record["trials"], _state(record, arrays))
    except InputError:
        raise
    except Exception as fault:  # zip, numpy and JSON raise many kinds
        raise InputError(f"{file} is damaged ({fault}): {ANEW}") from None


def check_same(file: Path, found: dict[str, Any], asked: dict[str, Any]) -> None:
    """Refuse to go on with what was begun otherwise.

    Raises:
        InputError: it was, by what is named.
    """
    was, now = _flat(found), _flat(asked)
    for name, value in now.items():
        if was.get(name) != value:
            what = "another capture" if name == "light_field" else f"{name} {was.get(name)}"
            raise InputError(f"{file} is of {what}, not {_asked_for(name, value)}: {ANEW}")


def _asked_for(name: str, value: Any) -> str:
    return "of this one" if name == "light_field" else str(value)


def _flat(asked: dict[str, Any]) -> dict[str, Any]:
    return {**asked, **asked.get("options", {}), "options": None}


def _state(record: dict[str, Any], arrays: dict[str, Any]) -> State:
    grid = Grid(record["nodes"], record["width_mm"], arrays["place"])
    values, moments = arrays["values"], Moments(arrays["mean"], arrays["square"])
    if {one.shape for one in (values, *moments)} != {(len(grid), values.shape[1])}:
        raise ValueError("its arrays do not belong together")
    state = State(record["level"], record["epoch"], grid, values, moments)
    state.step, state.loss = record["step"], record["loss"]
    return state
