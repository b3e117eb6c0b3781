"""A lens solved by OpenCV from photographs of a checkerboard (Zhang 2000)."""

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.calibration.intrinsics.lens import Lens
from tbcad.calibration.intrinsics.opencv import cv
from tbcad.errors import InputError
from tbcad.formats.pictures import visible_files
from tbcad.runs.images import read_image
from tbcad.types import Floats, Progress

MIN_BOARDS = 6
"""Photographs of the board: fewer do not tell focal length, principal point and distortion."""
MIN_SQUARES, MAX_SQUARES = 4, 60
SIZE_MM = (0.1, 1000.0)
EPSILON, STEPS = 1e-6, 100
WINDOW_SHARE, MAX_WINDOW = 0.4, 11
"""Half width of the window in which a corner is refined: of the squares' spacing, and in pixels."""
REFINED_PX = 1e-3
LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)
EDGE_SHARE = 0.75
"""Of the distance from centre to corner of the picture, that the corners of boards should reach."""


@dataclass(frozen=True)
class SolvedLens:
    """A lens with what tells how good it is.

    Attributes:
        lens: solved.
        boards: photographs that were used.
        unused: names of those in which no board was found.
        rms_px: root mean square distance of corners from where the solution shows them.
        sigma: standard deviations of focal lengths, principal point and distortion, (9,).
        reach: how far out corners lie, as a share of the distance from centre to corner.
    """

    lens: Lens
    boards: int
    unused: tuple[str, ...]
    rms_px: float
    sigma: Floats
    reach: float

    def facts(self) -> dict[str, float | int | str]:
        """Further keys of its file."""
        names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
        deviations = {
            f"sigma_{n}": float(f"{s:.6g}") for n, s in zip(names, self.sigma, strict=True)
        }
        return {"boards": self.boards, "rms_px": float(f"{self.rms_px:.6g}"), **deviations}


def parse_squares(text: str) -> tuple[int, int]:
    """Columns and rows of squares of "9x6".

    Raises:
        InputError: it is no such text.
    """
    found = re.fullmatch(r"\s*(\d{1,3})\s*[xX]\s*(\d{1,3})\s*", text)
    columns, rows = (int(found[1]), int(found[2])) if found else (0, 0)
    if not (min(columns, rows) >= MIN_SQUARES and max(columns, rows) <= MAX_SQUARES):
        raise InputError(
            f"--squares {text!r:.40}: allowed is for instance 9x6, {MIN_SQUARES} to {MAX_SQUARES} "
            "squares each way: count the squares of the board"
        )
    return columns, rows


def solve_lens(
    folder: Path, squares: tuple[int, int], size_mm: float, progress: Progress
) -> SolvedLens:
    """Solve a lens from the photographs of a checkerboard in a folder.

    Args:
        folder: with the photographs, all of one camera and size.
        squares: columns and rows of the board.
        size_mm: width of a square.
        progress: called with the name of each photograph.

    Raises:
        InputError: too few boards are found, sizes differ, or the solution makes no sense.
    """
    if not SIZE_MM[0] <= size_mm <= SIZE_MM[1]:
        raise InputError(
            f"--size {size_mm:g}: allowed is {SIZE_MM[0]:g} to {SIZE_MM[1]:g} mm: change it"
        )
    files = _photographs(folder)
    corners, unused, size = [], [], None
    for file in files:
        progress(file.name)
        grey = _grey(file)
        size = _same_size(file, grey, size)
        found = _corners(grey, (squares[0] - 1, squares[1] - 1))
        if found is None:
            unused.append(file.name)
        else:
            corners.append(found)
    if len(corners) < MIN_BOARDS or size is None:
        raise InputError(
            f"{folder}: the whole board of {squares[0]} x {squares[1]} squares was found in "
            f"{len(corners)} of {len(files)} photographs, {MIN_BOARDS} are needed: photograph it "
            "tilted, in all parts of the picture, with a white border; count squares, not corners"
        )
    return _solved(corners, squares, size_mm, size, tuple(unused))


def _photographs(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; name one with photographs of a checkerboard")
    files = visible_files(folder)
    for one, other in pairwise(files):
        if one.stem == other.stem:
            raise InputError(f"{one} and {other.name} are one photograph twice: keep one of them")
    return files


def _grey(file: Path) -> Any:
    """A photograph as grey of 8 bits, (h, w); luma as ITU-R BT.601 weighs it."""
    image = read_image(file)
    share = (image @ LUMA) / np.iinfo(image.dtype).max
    return np.rint(255 * share).astype(np.uint8)


def _same_size(file: Path, grey: Any, size: tuple[int, int] | None) -> tuple[int, int]:
    found = grey.shape[1], grey.shape[0]
    if size is not None and found != size:
        raise InputError(
            f"{file} has {found[0]} x {found[1]} pixels, those before it {size[0]} x {size[1]}: "
            "keep photographs of one size"
        )
    return found


def _corners(grey: Any, inner: tuple[int, int]) -> Any:
    """Corners within the board, (n, 2); None where it is not found whole."""
    cv2 = cv()
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
    seen, corners = cv2.findChessboardCornersSB(grey, inner, flags=flags)
    if not seen:
        return None
    rough = np.asarray(corners, dtype=np.float32).reshape(-1, 1, 2)
    grid = rough.reshape(inner[1], inner[0], 2)
    spacing = min(np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1))
    window = int(np.clip(spacing * WINDOW_SHARE, 2, MAX_WINDOW))
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, STEPS, REFINED_PX
    return cv2.cornerSubPix(grey, rough, (window, window), (-1, -1), stop).reshape(-1, 2)


def _solved(
    corners: list[Any],
    squares: tuple[int, int],
    size_mm: float,
    size: tuple[int, int],
    unused: tuple[str, ...],
) -> SolvedLens:
    cv2 = cv()
    columns, rows = squares[0] - 1, squares[1] - 1
    board = np.zeros((columns * rows, 3), dtype=np.float32)
    board[:, :2] = size_mm * np.mgrid[0:columns, 0:rows].T.reshape(-1, 2)
    boards = [board] * len(corners)
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, STEPS, EPSILON
    try:
        rms, matrix, coefficients, _, _, sigma, _, _ = cv2.calibrateCameraExtended(
            boards, corners, size, None, None, criteria=stop
        )
    except cv2.error as error:
        raise InputError(
            f"OpenCV finds no lens: {str(error).strip().splitlines()[0]:.120}"
        ) from None
    lens = Lens(
        focal=matrix[[0, 1], [0, 1]],
        principal=matrix[:2, 2],
        distortion=np.asarray(coefficients).ravel()[:5],
        width_px=size[0],
        height_px=size[1],
    ).checked("the solved lens")
    half = np.array(size) / 2
    reach = np.linalg.norm(np.concatenate(corners) - half, axis=1).max() / np.linalg.norm(half)
    deviations = np.asarray(sigma).ravel()[:9]
    return SolvedLens(lens, len(corners), unused, float(rms), deviations, float(reach))
