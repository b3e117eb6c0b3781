"""A ball as a field, made by hand."""

import json
import re
from pathlib import Path

import numpy as np

from tbcad.light.reconstruction.field import (
    FACT,
    Field,
    Grid,
    field_file,
    light_field_fingerprint,
    write_field,
)
from tbcad.light.simulate.capture.light_field import LightField

NODES, CAPTURE_MM = 25, 60.0
RADIUS_MM, COLOUR = 15.0, (0.8, 0.4, 0.2)
STEEP = 4.0  # change of the density's number, 1/mm, in a millimetre


def ball() -> Field:
    """An opaque ball of one colour about the origin; nothing says of which light field it is."""
    every = np.linspace(-CAPTURE_MM / 2, CAPTURE_MM / 2, NODES)
    away = np.sqrt(sum(np.square(np.meshgrid(every, every, every))))
    grid = Grid.about(away < RADIUS_MM + CAPTURE_MM / NODES, CAPTURE_MM)
    inside = STEEP * (RADIUS_MM - np.linalg.norm(grid.points, axis=1))
    colour = np.broadcast_to(COLOUR, (len(grid), 3))
    values = np.column_stack([np.maximum(inside, -3.0), colour])
    return Field(grid, values.astype(np.float32))


def data_of(page: str) -> dict[str, object]:
    """What the scripts of a page read."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page)
    assert found
    record: dict[str, object] = json.loads(found[1])
    return record


def write_ball(source: LightField, folder: Path, frame: int | None = None) -> Path:
    """Write the ball as the field of a light field."""
    file = field_file(folder, frame)
    made = ball()
    write_field(file, Field(made.grid, made.values, {FACT: light_field_fingerprint(source)}))
    return file
