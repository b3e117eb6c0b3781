"""Corners of checkerboards and ChArUco boards in photographs, found by OpenCV."""

import re
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.rig.calibration.intrinsics.lens import cv

MIN_SQUARES, MAX_SQUARES = 4, 60
MIN_ROWS = 3
MIN_CORNERS = MIN_ROWS**2  # of a board that is partly out of the picture: three rows of three
SIZE_MM = (0.1, 1000.0)
STEPS, REFINED_PX = 100, 1e-3
WINDOW_SHARE, MAX_WINDOW = 0.4, 11
"""Half width of the window in which a corner is refined: of the squares' spacing, and in pixels."""
PARTS = ((5, 5), (5, 3), (3, 5), (4, 4), (4, 3), (3, 4), (3, 3))
"""Corners, columns x rows, of the parts from which OpenCV is asked to go on to larger ones."""
FLAT_SHARE = 0.05
"""Of the squares' spacing, by which corners may be off a flat board seen without distortion."""
CONTRAST = 0.25  # between any squares that touch, of the median
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
        """Name of the board."""
        kind = "checkerboard" if self.dictionary is None else f"ChArUco board, {self.dictionary}"
        return f"{kind} of {self.squares[0]} x {self.squares[1]} squares"


@dataclass(frozen=True)
class BoardCorners:
    """Corners of a board in one photograph."""

    # on the board, mm, float32, (n, 3), z = 0. Of a checkerboard that is partly out of the picture,
    # counted from its first corner that is seen.
    places: Any
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
    if board.dictionary is not None:
        return _charuco(grey, board)
    whole = _whole(grey, board.squares)
    grid = _part(grey, board.squares) if whole is None else whole
    return None if grid is None else _refined(grey, grid, board.size_mm)


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


def _flags() -> int:
    cv2 = cv()
    return int(cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE)


def _whole(grey: Any, squares: tuple[int, int]) -> Any:
    """A whole checkerboard's corners, roughly, (rows, columns, 2); None where it is not found."""
    columns, rows = squares[0] - 1, squares[1] - 1
    seen, corners = cv().findChessboardCornersSB(grey, (columns, rows), flags=_flags())
    grid = np.reshape(corners, (rows, columns, 2)) if seen else None
    return grid if grid is not None and _alternates(grey, grid) else None


def _part(grey: Any, squares: tuple[int, int]) -> Any:
    """The largest part of a checkerboard that is surely one; None where there is none.

    OpenCV goes on from a part to rows and columns that are none: each outermost one is left out
    in turn.
    """
    flags = _flags() | cv().CALIB_CB_LARGER
    best, size = None, 0
    for part in PARTS:
        seen, corners, meta = cv().findChessboardCornersSBWithMeta(grey, part, flags)
        grids = _trimmed(np.reshape(corners, (*meta.shape, 2))) if seen else []
        for grid in grids:
            if grid.size > size and _fits(grid, squares) and _is_flat(grid):
                best, size = (grid, grid.size) if _alternates(grey, grid) else (best, size)
    return best


def _trimmed(grid: Any) -> list[Any]:
    """A grid without none, one or both of its outermost rows and columns."""
    ends = list(product((0, 1), (0, -1)))
    rows, columns = grid.shape[:2]
    return [
        grid[top : rows + bottom, left : columns + right]
        for top, bottom in ends
        for left, right in ends
        if min(rows + bottom - top, columns + right - left) >= MIN_ROWS
    ]


def _fits(grid: Any, squares: tuple[int, int]) -> bool:
    inner = sorted((squares[0] - 1, squares[1] - 1))
    return all(np.array(sorted(grid.shape[:2])) <= inner)


def _spacing(grid: Any) -> float:
    return float(min(np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1)))


def _places(grid: Any) -> Any:
    rows, columns = grid.shape[:2]
    return np.mgrid[0:columns, 0:rows].T.reshape(-1, 2).astype(np.float32)


def _is_flat(grid: Any) -> bool:
    """Whether corners are where a flat board has them."""
    cv2 = cv()
    turned, _ = cv2.findHomography(_places(grid), grid.reshape(-1, 2))
    if turned is None:
        return False
    shown = cv2.perspectiveTransform(_places(grid)[None], turned)[0]
    off = np.linalg.norm(shown - grid.reshape(-1, 2), axis=1)
    return bool(off.max() < FLAT_SHARE * _spacing(grid))


def _alternates(grey: Any, grid: Any) -> bool:
    """Whether the squares round all corners are dark and light in turn.

    Of the outermost a quarter is enough: printed boards may end within them.
    """
    for axis in (0, 1):
        rows = np.moveaxis(grid, axis, 0)
        rows = np.concatenate(
            [[1.5 * rows[0] - rows[1] / 2], rows, [1.5 * rows[-1] - rows[-2] / 2]]
        )
        grid = np.moveaxis(rows, 0, axis)
    middle = (grid[1:, 1:] + grid[:-1, 1:] + grid[1:, :-1] + grid[:-1, :-1]) / 4
    column, row = np.rint(middle).astype(int).transpose(2, 0, 1)
    height, width = grey.shape
    light = grey[row.clip(0, height - 1), column.clip(0, width - 1)].astype(float)
    sign = np.where(np.indices(light.shape).sum(axis=0) % 2 == 0, 1.0, -1.0)
    step = [(light[1:] - light[:-1]) * sign[1:], (light[:, 1:] - light[:, :-1]) * sign[:, 1:]]
    signed = np.concatenate([one.ravel() for one in step])
    return bool((signed * np.sign(np.median(signed)) > CONTRAST * np.abs(np.median(signed))).all())


def _refined(grey: Any, grid: Any, size_mm: float) -> BoardCorners | None:
    """Corners to a fraction of a pixel, but for those whose window leaves the picture.

    The window holds one corner only: OpenCV's own example takes 11 pixels on each side, which
    reaches the next corner of a small board and moves to it.
    """
    cv2 = cv()
    window = int(np.clip(_spacing(grid) * WINDOW_SHARE, 2, MAX_WINDOW))
    rough = np.ascontiguousarray(grid, np.float32).reshape(-1, 1, 2)
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, STEPS, REFINED_PX
    pixels = cv2.cornerSubPix(grey, rough, (window, window), (-1, -1), stop).reshape(-1, 2)
    inside = (pixels > window) & (pixels < np.array(grey.shape[::-1]) - 1 - window)
    places = np.pad(size_mm * _places(grid), ((0, 0), (0, 1)))
    corners = BoardCorners(places, pixels).but(~inside.all(axis=1))
    return corners if len(corners.pixels) >= MIN_CORNERS else None
