"""Photographs of a rendered run: a sensor's noise, and the folder that a rig with a camera writes.

No code is shared with tbcad.
"""

import hashlib
import json
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tests.clients.rendered_rig import rows

FULL, READ, ROW, PRNU, PEDESTAL = 6000.0, 6.0, 1.5, 0.008, 4.0  # electrons, and of 255
STEP = 1 / 16_000  # of light as it is kept; 1 fills a pixel
DEPENDS_ON = ("design.json", "mirrors.csv", "prototype.json", "balls.csv", "rotation_plan.csv")
BY_WEIGHT = ("stops.csv", "sag.csv")


def steps(light: np.ndarray) -> np.ndarray:
    """Light as whole numbers, as it is kept."""
    return np.clip(np.rint(light / STEP), 0, 65_535).astype(np.uint16)


def recorded(light: np.ndarray, gain: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Numbers (h, w, 3) of a photograph of light (h, w, 3): shot, read and row noise, 8 bits."""
    electrons = random.poisson(FULL * np.maximum(light, 0) * gain[..., None]).astype(float)
    electrons += READ * random.standard_normal(light.shape)
    electrons += ROW * random.standard_normal((len(light), 1, 1))
    return np.clip(np.rint(PEDESTAL + 255 * electrons / FULL), 0, 255).astype(np.uint8)


def develop(build: Path, light: Path, out: Path) -> None:
    """Write the run of a build from the light that `mitsuba_run` rendered."""
    with np.load(light) as kept:
        kinds = {
            name: STEP * kept[name].astype(np.float32) for name in ("leds", "lit") if name in kept
        }
        frames, seed = kept["frames"].tolist(), int(kept["seed"])
    leds = kinds["leds"]
    random = np.random.default_rng([42, seed])
    gain = 1 + PRNU * random.standard_normal(leds.shape[2:])
    phases = ["dark", *(f"led_{led + 1}" for led in range(leds.shape[1]))]
    phases += ["lit"] if "lit" in kinds else []
    (out / "photographs").mkdir(parents=True)
    angles = [float(row["base_angle_deg"]) for row in rows(build / "stops.csv")]
    told = [
        {"object_turn_deg": turn, "stop": stop, "base_angle_deg": angles[stop - 1]}
        for turn, stop in frames
    ]
    for number, frame in enumerate(told):
        dark = np.zeros((*leds.shape[2:], 3))
        light_of = [dark, *(np.repeat(one[..., None], 3, axis=2) for one in leds[number])]
        light_of += [kinds["lit"][number]] if "lit" in kinds else []
        for phase, one in zip(phases, light_of, strict=True):
            _write(out / "photographs", frame, phase, recorded(one, gain, random))
    files = [*DEPENDS_ON, *BY_WEIGHT]
    record = {
        "schema": "tbcad-run/1",
        "export_sha256": {n: hashlib.sha256((build / n).read_bytes()).hexdigest() for n in files},
        "source": "camera",
        "camera": "rendered",
        "width_px": leds.shape[3],
        "height_px": leds.shape[2],
        "phases": phases,
        "frames": told,
        "locked": {},
        "seconds": float(len(frames) * len(phases)),
    }
    (out / "run.json").write_text(json.dumps(record, indent=1))


def _write(folder: Path, frame: dict[str, Any], phase: str, image: np.ndarray) -> None:
    name = f"{'b' if frame['object_turn_deg'] else 'a'}_{frame['stop']:04d}_{phase}"
    file = BytesIO()
    Image.fromarray(image).save(file, "png", compress_level=1)
    (folder / f"{name}.png").write_bytes(file.getvalue())
    sidecar = {
        "schema": "tbcad-exposure/1",
        "frame": frame,
        "phase": phase,
        "file": f"{name}.png",
        "sha256": hashlib.sha256(file.getvalue()).hexdigest(),
        "width_px": image.shape[1],
        "height_px": image.shape[0],
        "exposure_s": 1.0,
        "taken": "2026-01-01T00:00:00Z",
        "settings": {},
    }
    (folder / f"{name}.json").write_text(json.dumps(sidecar, indent=1))
