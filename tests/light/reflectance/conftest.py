"""A small capture with a reflectance field, and surroundings that are partly bright."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tbcad.app.cli import run

LAMPS = "x_mm,y_mm,z_mm\n200,0,120\n-150,120,90\n20,-40,240\n"


@pytest.fixture(scope="session")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("lamps") / "lamps.csv"
    path.write_text(LAMPS, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def captured(record: Path, table: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the three lamps of the table."""
    out = tmp_path_factory.mktemp("captures") / "few"
    assert run(["capture", str(record), "--lights", str(table), "--out", str(out)]) == 0
    return out


def sky(height: int = 32) -> np.ndarray:
    """Red, green, blue by direction: a dim sky, a warm lamp on one side, a cold one opposite."""
    picture = np.full((height, 2 * height, 3), 0.2)
    picture[height // 6 : height // 3, height // 2 : height // 2 + 5] = (6.0, 4.0, 1.0)
    picture[height // 4 : height // 3, -8:-4] = (0.5, 1.0, 5.0)
    return picture


@pytest.fixture(scope="session")
def hdr(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sky") / "sky.hdr"
    assert cv2.imwrite(str(path), sky()[..., ::-1].astype(np.float32))
    return path
