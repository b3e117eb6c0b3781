"""A lens recovered from rendered photographs of a checkerboard."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from tbcad.api import solve_intrinsics
from tbcad.calibration.intrinsics.files import read_lens
from tbcad.errors import InputError
from tbcad.optics.lens_camera import LensCamera

SQUARES, SIZE_MM = (9, 6), 5.0
WIDTH, HEIGHT, SAMPLES = 640, 480, 2
FOCAL, PRINCIPAL = np.array([620.0, 622.0]), np.array([322.5, 236.0])
DISTORTION = np.array([-0.08, 0.02, 5e-4, -3e-4, 0.0])
SIGMAS, BOARDS = 4.0, 8


def _camera(turn: tuple[float, float, float], place: tuple[float, float, float]) -> LensCamera:
    """A camera before a board in the plane z = 0 whose middle is the origin."""
    axes = Rotation.from_euler("xyz", turn, degrees=True).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    return LensCamera(np.array(place), axes, FOCAL, PRINCIPAL, DISTORTION, WIDTH, HEIGHT)


@cache
def _lens_rays() -> np.ndarray:
    """Of every sample in the camera's frame; the lens is the same in all photographs."""
    step = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    column, row = np.arange(WIDTH)[:, None] + step, np.arange(HEIGHT)[:, None] + step
    grid = np.stack(np.meshgrid(column.ravel(), row.ravel()), axis=-1)
    still = LensCamera(np.zeros(3), np.eye(3), FOCAL, PRINCIPAL, DISTORTION, WIDTH, HEIGHT)
    return still.directions(grid)


def _rendered(camera: LensCamera, noise: float, seed: int) -> np.ndarray:
    """Black and white squares with a white border, SAMPLES^2 rays a pixel, noise in grey levels."""
    ray = _lens_rays() @ camera.axes
    point = camera.pinhole - (camera.pinhole[2] / ray[..., 2:]) * ray
    square = np.floor(point[..., :2] / SIZE_MM + np.array(SQUARES) / 2)
    inside = ((square >= 0) & (square < SQUARES)).all(axis=-1)
    light = np.where(inside & (square.sum(axis=-1) % 2 == 0), 30.0, 220.0)
    pixels = light.reshape(HEIGHT, SAMPLES, WIDTH, SAMPLES).mean(axis=(1, 3))
    noisy = pixels + noise * np.random.default_rng(seed).standard_normal(pixels.shape)
    return np.clip(np.round(noisy), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def boards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("boards")
    rng = np.random.default_rng(5)
    for number in range(BOARDS):
        turn = tuple(rng.uniform(-25, 25, size=3))
        height = rng.uniform(60, 75)
        aim = _camera(turn, (0, 0, height)).axes[2] * height
        place = -aim + np.array([*rng.uniform(-6, 6, size=2), 0])
        picture = _rendered(_camera(turn, tuple(place)), 2.0, number)
        Image.fromarray(picture).save(folder / f"board_{number}.png")
    Image.fromarray(np.full((HEIGHT, WIDTH), 128, np.uint8)).save(folder / "empty.png")
    return folder


def test_the_lens_is_found_with_its_uncertainty(boards: Path, tmp_path: Path) -> None:
    file = tmp_path / "camera.yml"
    solved = solve_intrinsics(boards, SQUARES, SIZE_MM, out=file)
    assert solved.boards >= 6
    assert "empty.png" in solved.unused
    assert solved.rms_px < 0.2
    off = np.concatenate([solved.lens.focal - FOCAL, solved.lens.principal - PRINCIPAL])
    assert (np.abs(off) < SIGMAS * solved.sigma[:4]).all()
    assert solved.sigma[:2].max() < 2
    again = read_lens(file)
    assert again.focal == pytest.approx(solved.lens.focal, abs=0)


def test_no_board_is_found(tmp_path: Path) -> None:
    Image.fromarray(np.full((HEIGHT, WIDTH), 128, np.uint8)).save(tmp_path / "empty.png")
    with pytest.raises(InputError, match=r"9 x 6 squares was found in 0 of 1 photographs"):
        solve_intrinsics(tmp_path, SQUARES, SIZE_MM)
