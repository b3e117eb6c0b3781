"""Corners of checkerboards and ChArUco boards in photographs, found by OpenCV."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.rig.calibration.intrinsics.lens import cv

MIN_SQUARES, MAX_SQUARES = 4, 60
MIN_CORNERS = 9  # of a board that is partly out of the picture: three rows of three
SIZE_MM = (0.1, 1000.0)
STEPS, REFINED_PX = 100, 1e-3
WINDOW_SHARE, MAX_WINDOW = 0.4, 11
"""Half width of the window in which a corner is refined: of the squares' spacing, and in pixels."""
DICTIONARY = re.compile(r"(?:DICT_)?([4-7]X[4-7])_(50|100|250|1000)", re.IGNORECASE)


@dataclass(frozen=True)
class Board:
    """A board of squares."""

    squares: tuple[int, int]  # columns and rows
    size_mm: float  # width of a square
    # of the markers of a ChArUco board, as OpenCV names it; None: a checkerboard
    dictionary: str | None = None
    marker_mm: float | None = None

    def __post_init__(self) -> None:
        if not SIZE_MM[0] <= self.size_mm <= SIZE_MM[1]:
            raise InputError(
                f"--size {self.size_mm:g}: allowed is {SIZE_MM[0]:g} to {SIZE_MM[1]:g} mm: "
                "change it"
            )
        if (self.dictionary is None) != (self.marker_mm is None):
            raise InputError(
                "--charuco and --marker go together: name the dictionary of a ChArUco board, for "
                "instance 4x4_50, and the width of its markers in mm"
            )
        if self.marker_mm is not None and not 0 < self.marker_mm < self.size_mm:
            raise InputError(
                f"--marker {self.marker_mm:g}: markers are narrower than the squares of "
                f"{self.size_mm:g} mm: measure the black square round a marker's pattern"
            )

    @property
    def words(self) -> str:
        """What it is."""
        kind = "checkerboard" if self.dictionary is None else f"ChArUco board, {self.dictionary}"
        return f"{kind} of {self.squares[0]} x {self.squares[1]} squares"


@dataclass(frozen=True)
class BoardCorners:
    """Corners of a board in one photograph."""

    places: Any  # on the board, mm, float32, (n, 3), z = 0
    pixels: Any  # column and row, float32, (n, 2)

    def but(self, dropped: Any) -> "BoardCorners":
        """Without some, a mask of (n,)."""
        return BoardCorners(self.places[~dropped], self.pixels[~dropped])


def parse_squares(text: str) -> tuple[int, int]:
    """Columns and rows of squares of "9x6", or an InputError."""
    found = re.fullmatch(r"\s*(\d{1,3})\s*[xX]\s*(\d{1,3})\s*", text)
    columns, rows = (int(found[1]), int(found[2])) if found else (0, 0)
    if not (min(columns, rows) >= MIN_SQUARES and max(columns, rows) <= MAX_SQUARES):
        raise InputError(
            f"--squares {text!r:.40}: allowed is for instance 9x6, {MIN_SQUARES} to {MAX_SQUARES} "
            "squares each way: count the squares of the board"
        )
    return columns, rows


def parse_dictionary(text: str) -> str:
    """OpenCV's name of a dictionary of markers, of "4x4_50", or an InputError."""
    found = DICTIONARY.fullmatch(text.strip())
    if not found or found[1][0] != found[1][2]:
        raise InputError(
            f"--charuco {text!r:.40}: allowed are 4x4, 5x5, 6x6 and 7x7 with _50, _100, _250 or "
            "_1000, for instance 4x4_50: the board's maker states it"
        )
    return f"DICT_{found[1].upper()}_{found[2]}"


def find_corners(grey: Any, board: Board) -> BoardCorners | None:
    """Find at least `MIN_CORNERS` corners between four squares in grey, uint8, (h, w), or None."""
    return (_checkerboard if board.dictionary is None else _charuco)(grey, board)


def _charuco(grey: Any, board: Board) -> BoardCorners | None:
    """By the markers, so any part of the board tells which corners are seen.

    OpenCV before 4.6 drew boards with an even number of rows otherwise: both are tried.
    """
    aruco = cv().aruco
    markers = aruco.getPredefinedDictionary(getattr(aruco, str(board.dictionary)))
    pattern = aruco.CharucoBoard(board.squares, board.size_mm, float(board.marker_mm or 0), markers)
    for legacy in (False, True):
        pattern.setLegacyPattern(legacy)
        pixels, ids, _, _ = aruco.CharucoDetector(pattern).detectBoard(grey)
        if ids is not None and len(ids) >= MIN_CORNERS:
            places = np.asarray(pattern.getChessboardCorners(), np.float32)[np.ravel(ids)]
            return BoardCorners(places, np.asarray(pixels, np.float32).reshape(-1, 2))
    return None


def _checkerboard(grey: Any, board: Board) -> BoardCorners | None:
    """Of a whole board, to a fraction of a pixel, but for corners whose window leaves the picture.

    The window holds one corner only: OpenCV's own example takes 11 pixels on each side, which
    reaches the next corner of a small board and moves to it.
    """
    cv2, (columns, rows) = cv(), (board.squares[0] - 1, board.squares[1] - 1)
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
    seen, rough = cv2.findChessboardCornersSB(grey, (columns, rows), flags=flags)
    if not seen:
        return None
    grid = np.reshape(rough, (rows, columns, 2))
    spacing = min(np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1))
    window = int(np.clip(spacing * WINDOW_SHARE, 2, MAX_WINDOW))
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, STEPS, REFINED_PX
    pixels = cv2.cornerSubPix(grey, rough, (window, window), (-1, -1), stop).reshape(-1, 2)
    inside = (pixels > window) & (pixels < np.array(grey.shape[::-1]) - 1 - window)
    places = board.size_mm * np.mgrid[0:columns, 0:rows].T.reshape(-1, 2).astype(np.float32)
    corners = BoardCorners(np.pad(places, ((0, 0), (0, 1))), pixels).but(~inside.all(axis=1))
    return corners if len(corners.pixels) >= MIN_CORNERS else None
