"""Lenses of OpenCV's sample photographs, against OpenCV's own detector of corners."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tbcad.app.api import intrinsics

SAMPLES = Path("/usr/share/doc/opencv-doc/examples/data")
WINDOW = (5, 5)  # which no other corner of these boards comes into
INNER = (9, 6)


def opencv_focal(files: list[Path]) -> np.ndarray:
    """Focal lengths by the classic detector, which shares no code with the one that is used."""
    places = np.pad(np.mgrid[0:9, 0:6].T.reshape(-1, 2), ((0, 0), (0, 1))).astype(np.float32)
    seen = []
    for file in files:
        grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        found, corners = cv2.findChessboardCorners(grey, INNER)
        assert found
        seen.append(cv2.cornerSubPix(grey, corners, WINDOW, (-1, -1), (3, 30, 1e-3)))
    _, matrix, *_ = cv2.calibrateCamera([places] * len(seen), seen, grey.shape[::-1], None, None)
    return np.diag(matrix)[:2]


@pytest.mark.clients
@pytest.mark.skipif(not SAMPLES.is_dir(), reason="opencv-doc is not installed")
@pytest.mark.parametrize("side", ["left", "right"])
def test_opencv_finds_the_same_lens(side: str, tmp_path: Path) -> None:
    files = sorted(SAMPLES.glob(f"{side}[01][0-9].jpg"))
    for file in files:
        (tmp_path / file.name).symlink_to(file)
    solved = intrinsics(tmp_path, squares="10x7", size=25.0, out=tmp_path / "camera.yml")
    assert solved.boards >= len(files) - 1
    assert (np.abs(solved.lens.focal - opencv_focal(files)) < 3 * solved.sigma[:2]).all()
    assert solved.rms_px < 0.2
    assert (solved.sigma[:2] < 1.5).all()
