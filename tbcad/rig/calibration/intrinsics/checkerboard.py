"""A lens solved by OpenCV from photographs of a board (Zhang 2000)."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from tbcad.cad.formats.pictures import visible_files
from tbcad.errors import InputError
from tbcad.rig.calibration.intrinsics.boards import (
    MIN_CORNERS,
    Board,
    BoardCorners,
    find_corners,
)
from tbcad.rig.calibration.intrinsics.lens import CalibratedLens, cv
from tbcad.rig.runs import read_image
from tbcad.types import Floats, Progress

MIN_BOARDS = 6
"""Photographs of the board: fewer do not tell focal length, principal point and distortion."""
EPSILON, STEPS = 1e-6, 100
LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)  # ITU-R BT.601
EDGE_SHARE = 0.75
"""Of the distance from centre to corner of the picture, that the corners of boards should reach."""
OUTLIER = 6.0
"""Times the median distance from where the solution shows corners: one that is farther is none.

By a normal distribution in the plane one corner in 10^11 is that far.
"""
ROUNDS = 3  # of leaving out corners
NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")


@dataclass(frozen=True)
class SolvedLens:
    """A lens with what tells how good it is."""

    lens: CalibratedLens
    boards: int  # photographs that were used
    unused: tuple[str, ...]  # names of those in which no board was found
    corners: int
    outliers: int  # corners left out, which are far from where the solution shows them
    rms_px: float  # root mean square distance of corners from where the solution shows them
    # standard deviations of `NAMES`, (9,), by leaving out one photograph after the other
    sigma: Floats
    reach: float  # how far out corners lie, as a share of the distance from centre to corner

    def facts(self) -> dict[str, float | int]:
        """Further keys of its file."""
        sigmas = {f"sigma_{n}": float(f"{s:.6g}") for n, s in zip(NAMES, self.sigma, strict=True)}
        counts = {"boards": self.boards, "corners": self.corners, "outliers": self.outliers}
        return {**counts, "rms_px": float(f"{self.rms_px:.6g}"), **sigmas}


def solve_lens(folder: Path, board: Board, progress: Progress) -> SolvedLens:
    """Solve a lens from a folder of photographs of a board, whole or in part, by one camera."""
    cv()  # before any photograph is read
    files, seen, size = _photographs(folder), dict[str, BoardCorners](), None
    for file in files:
        progress(file.name)
        image = read_image(file)
        found = image.shape[1], image.shape[0]
        if (size := size or found) != found:
            raise InputError(
                f"{file} has {found[0]} x {found[1]} pixels, those before it {size[0]} x "
                f"{size[1]}: keep photographs of one size"
            )
        share = (image @ LUMA) / np.iinfo(image.dtype).max
        grey = np.rint(255 * share).astype(np.uint8)
        corners = find_corners(grey, board)
        if corners is not None:
            seen[file.name] = corners
    if size is None or len(seen) < MIN_BOARDS:
        raise InputError(
            f"{folder}: a {board.words} was found in {len(seen)} of {len(files)} photographs, "
            f"{MIN_BOARDS} are needed: photograph it tilted, in all parts of the picture, with a "
            "white border; count squares, not corners"
        )
    unused = tuple(file.name for file in files if file.name not in seen)
    return solve_corners([*seen.values()], size, unused)


def _photographs(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; name one with photographs of a board")
    files = visible_files(folder)
    for one, other in pairwise(files):
        if one.stem == other.stem:
            raise InputError(f"{one} and {other.name} are one photograph twice: keep one of them")
    return files


@dataclass(frozen=True)
class _Solution:
    """Solution by OpenCV: the values of `NAMES`, and turn and shift of each board."""

    values: Floats
    poses: list[tuple[Floats, Floats]]

    def distances(self, boards: list[BoardCorners]) -> list[Floats]:
        """Of corners from where the solution shows them, pixels, (n,) for each board."""
        matrix, coefficients = _matrix(self.values), self.values[4:]
        shown = [
            cv().projectPoints(board.places, *pose, matrix, coefficients)[0].reshape(-1, 2)
            for board, pose in zip(boards, self.poses, strict=True)
        ]
        return [
            np.linalg.norm(one - board.pixels, axis=1)
            for one, board in zip(shown, boards, strict=True)
        ]


def solve_corners(
    seen: list[BoardCorners], size: tuple[int, int], unused: tuple[str, ...] = ()
) -> SolvedLens:
    """Solve a lens from corners in photographs of a size; InputError: they are of no lens."""
    boards = without_outliers(seen, size)
    solution = _solution(boards, size)
    lens = CalibratedLens(
        focal=solution.values[:2],
        principal=solution.values[2:4],
        distortion=solution.values[4:],
        width_px=size[0],
        height_px=size[1],
    ).checked("the solved lens")
    pixels = np.concatenate([board.pixels for board in boards])
    off = np.concatenate(solution.distances(boards))
    half = np.array(size) / 2
    return SolvedLens(
        lens=lens,
        boards=len(boards),
        unused=unused,
        corners=len(pixels),
        outliers=sum(len(board.pixels) for board in seen) - len(pixels),
        rms_px=float(np.sqrt(np.mean(off**2))),
        sigma=_sigma(boards, size, solution.values),
        reach=float(np.linalg.norm(pixels - half, axis=1).max() / np.linalg.norm(half)),
    )


def without_outliers(seen: list[BoardCorners], size: tuple[int, int]) -> list[BoardCorners]:
    """Corners near where the solution shows them, of boards that keep enough of them.

    In rounds: a corner that is none pulls its board's pose, so that others seem far at first.
    """
    boards = seen
    for _ in range(ROUNDS):
        solution = _solution(boards, size)
        limit = OUTLIER * np.median(np.concatenate(solution.distances(boards)))
        near = [
            board.but(off > limit)
            for board, off in zip(seen, solution.distances(seen), strict=True)
        ]
        seen, boards = _enough(seen, near), _enough(near, near)
    return boards


def _enough(boards: list[BoardCorners], near: list[BoardCorners]) -> list[BoardCorners]:
    kept = [b for b, one in zip(boards, near, strict=True) if len(one.pixels) >= MIN_CORNERS]
    if len(kept) < MIN_BOARDS:
        raise InputError(
            f"the corners of {len(near) - len(kept)} of {len(near)} boards are not where any "
            "lens shows them: is --squares the board's, and the board flat?"
        )
    return kept


def _sigma(boards: list[BoardCorners], size: tuple[int, int], values: Floats) -> Floats:
    """Standard deviations by the jackknife over photographs (Efron 1981), (9,).

    Corners of one photograph share errors: the board's bend, focus, light. OpenCV's own figures
    take each corner as independent.
    """
    n = len(boards)
    others = np.array(
        [_solution(boards[:k] + boards[k + 1 :], size, values).values for k in range(n)]
    )
    squares = (others - others.mean(axis=0)) ** 2
    return np.asarray(np.sqrt((n - 1) / n * squares.sum(axis=0)))


def _matrix(values: Floats) -> Floats:
    fx, fy, cx, cy = values[:4]
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def _solution(
    boards: list[BoardCorners], size: tuple[int, int], start: Floats | None = None
) -> _Solution:
    cv2 = cv()
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, STEPS, EPSILON
    matrix = None if start is None else _matrix(start)
    coefficients = None if start is None else start[4:].copy()
    flags = 0 if start is None else cv2.CALIB_USE_INTRINSIC_GUESS
    places, pixels = [board.places for board in boards], [board.pixels for board in boards]
    try:
        _, matrix, coefficients, turns, shifts = cv2.calibrateCamera(
            places, pixels, size, matrix, coefficients, flags=flags, criteria=stop
        )
    except cv2.error as error:
        raise InputError(
            f"OpenCV finds no lens: {str(error).strip().splitlines()[0]:.120}"
        ) from None
    values = np.concatenate([matrix[[0, 1], [0, 1]], matrix[:2, 2], np.ravel(coefficients)[:5]])
    return _Solution(values, list(zip(turns, shifts, strict=True)))
