"""Rays through pixels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.mesh.rays import pixel_rows, row_chunks
from tbcad_verify.record.export import read_export

SAMPLE = Path(__file__).parents[3] / "docs" / "sample"


def test_rays_go_through_the_middle_of_pixels_row_by_row() -> None:
    camera = read_export(SAMPLE).cameras["a"]
    first, last = 3, 5
    rays = pixel_rows(camera, first, last)
    assert rays.shape == (3, 2 * camera.width)
    assert camera.forward @ rays == pytest.approx(np.ones(2 * camera.width))
    half = np.tan(camera.hfov / 2)
    across = half * (2 * np.arange(camera.width) + 1 - camera.width) / camera.width
    assert camera.right @ rays == pytest.approx(np.tile(across, 2))
    downward = half * (2 * np.array([first, last - 1]) + 1 - camera.height) / camera.width
    assert np.cross(camera.forward, camera.right) @ rays == pytest.approx(
        np.repeat(downward, camera.width)
    )


def test_chunks_are_all_rows_once() -> None:
    camera = read_export(SAMPLE).cameras["b"]
    rows = [row for low, high in row_chunks(camera) for row in range(low, high)]
    assert rows == list(range(camera.height))
