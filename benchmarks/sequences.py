"""Frames a second of an object that turns: python benchmarks/sequences.py captures/knot."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from circumstances import asked, show_and_write
from timing import Figure, Row, at_least, at_most, measured

from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.sequence import create_sequence, turns, write_turning
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.types import Bytes

FRAMES, WANTED, CORES = 8, 5, 2


def sequences(capture: Path, folder: Path, rounds: int) -> list[Row]:
    """Frames that are written as they come from cameras, and simulated ones."""
    with LightField.open(capture) as source:
        scene = prepared_scene(built_in_object(source.capture_mm))
        angles = turns(FRAMES, np.pi / 2)
        camera = next(iter(source.frames.values())).camera
        colours = kept_colours(source, folder)
        rays = sum(len(one) for one in colours.values()) / 1e6
        size = f"{camera.width_px} x {camera.height_px}, {rays:.2f} million rays"
        works = {
            f"frames a second written, {size}": lambda: written(folder, source, colours),
            f"frames a second simulated and written, {size}": lambda: write_turning(
                folder, source, scene, angles, lambda _: None
            ),
        }
        rows = []
        for name, work in works.items():
            found = [rates(work) for _ in range(rounds + 1)][1:]
            views, cpu = (Figure(values) for values in zip(*found, strict=True))
            limit = CORES / WANTED if "simulated" not in name else None
            beside = "- processor time for each, all cores"
            rows.append(
                at_least(name, views, WANTED, "/s") if limit else measured(name, views, "/s")
            )
            rows.append(at_most(beside, cpu, limit, "s") if limit else measured(beside, cpu, "s"))
    return rows


def kept_colours(source: LightField, folder: Path) -> dict[str, Bytes]:
    """Of each camera the colours of the rays that a sequence keeps, (r, 3)."""
    with create_sequence(folder, source, {}) as writer:
        return {
            name: frame.image().reshape(-1, 3)[writer.pixel[name]]
            for name, frame in source.frames.items()
        }


def written(folder: Path, source: LightField, colours: Mapping[str, Bytes]) -> None:
    """Frames that differ, as those of a camera do."""
    with create_sequence(folder, source, {}) as writer:
        for k in range(FRAMES):
            writer.append({name: one + np.uint8(k) for name, one in colours.items()})


def rates(work: Callable[[], object]) -> tuple[float, float]:
    """Frames a second, and processor seconds for each."""
    start, used = time.perf_counter(), time.process_time()
    work()
    taken, cpu = time.perf_counter() - start, time.process_time() - used
    return FRAMES / taken, cpu / FRAMES


if __name__ == "__main__":
    given = asked(__doc__ or "", "sequences", ("captures", {"type": Path, "nargs": "+"}), rounds=3)
    with tempfile.TemporaryDirectory() as name:
        parts = [sequences(one, Path(name), given.rounds) for one in given.captures]
    show_and_write(given.out, given.about, [row for part in parts for row in part])
