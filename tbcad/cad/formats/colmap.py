"""Sparse models of COLMAP: cameras, images and points, as text and as binary files.

After "Output Format" of COLMAP's documentation (colmap.github.io/format.html): poses are from
world to camera, with x to the right, y down and z forward; quaternions begin with their real part;
the centre of the first pixel is at (0.5, 0.5); binary numbers are little-endian. The files rigs and
frames, new with COLMAP 3.12, may be left out: each camera is then its own rig.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.types import Bytes, Floats

PINHOLE, PINHOLE_ID = "PINHOLE", 1
NO_ERROR = 0.0  # of a point that no feature was matched for
CAMERA = np.dtype(
    [("id", "<i4"), ("model", "<i4"), ("width", "<u8"), ("height", "<u8"), ("params", "<f8", 4)]
)
POSE = np.dtype([("id", "<i4"), ("quaternion", "<f8", 4), ("shift", "<f8", 3), ("camera", "<i4")])
POINT = np.dtype(
    [("id", "<u8"), ("place", "<f8", 3), ("colour", "u1", 3), ("error", "<f8"), ("track", "<u8")]
)
COUNT = np.dtype("<u8")


@dataclass(frozen=True)
class SparseModel:
    """m images, each of its own pinhole camera, and n points without matched features."""

    names: tuple[str, ...]  # of the image files, (m,)
    size_px: tuple[int, int]  # columns and rows of every image
    intrinsics: Floats  # focal lengths in x and y, principal point in x and y, pixels, (m, 4)
    rotation: Floats  # from world to camera, (m, 3, 3)
    centre: Floats  # of the cameras, in the world, (m, 3)
    points: Floats  # (n, 3)
    colours: Bytes  # red, green, blue, (n, 3)

    @property
    def quaternion(self) -> Floats:
        """From world to camera, the real part first and not negative, (m, 4)."""
        turns = Rotation.from_matrix(self.rotation)
        quaternion: Floats = turns.as_quat(canonical=True, scalar_first=True)
        return quaternion

    @property
    def translation(self) -> Floats:
        """From world to camera, (m, 3)."""
        return np.asarray(-np.einsum("mxy,my->mx", self.rotation, self.centre))

    def files(self) -> dict[str, bytes]:
        """Contents of all files by name: the same model as binary and as text."""
        text = {
            "cameras.txt": self._cameras_text(),
            "images.txt": self._images_text(),
            "points3D.txt": self._points_text(),
        }
        return {
            "cameras.bin": self._cameras(),
            "images.bin": self._images(),
            "points3D.bin": self._points(),
            **{name: ("\n".join(lines) + "\n").encode() for name, lines in text.items()},
        }

    def _cameras(self) -> bytes:
        table = np.zeros(len(self.names), dtype=CAMERA)
        table["id"], table["model"] = _ids(len(table)), PINHOLE_ID
        table["width"], table["height"] = self.size_px
        table["params"] = self.intrinsics
        return _count(table) + table.tobytes()

    def _images(self) -> bytes:
        table = np.zeros(len(self.names), dtype=POSE)
        table["id"] = table["camera"] = _ids(len(table))
        table["quaternion"], table["shift"] = self.quaternion, self.translation
        no_features = COUNT.type(0).tobytes()
        rows = (
            row.tobytes() + name.encode() + b"\0" + no_features
            for row, name in zip(table, self.names, strict=True)
        )
        return _count(table) + b"".join(rows)

    def _points(self) -> bytes:
        table = np.zeros(len(self.points), dtype=POINT)
        table["id"], table["error"] = _ids(len(table)), NO_ERROR
        table["place"], table["colour"] = self.points, self.colours
        return _count(table) + table.tobytes()

    def _cameras_text(self) -> Iterator[str]:
        yield "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"
        yield f"# Number of cameras: {len(self.names)}"
        for number, row in enumerate(self.intrinsics.tolist(), 1):
            yield _line(number, PINHOLE, *self.size_px, *row)

    def _images_text(self) -> Iterator[str]:
        yield "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME"
        yield "# POINTS2D[] as (X, Y, POINT3D_ID)"
        yield f"# Number of images: {len(self.names)}, mean observations per image: 0"
        poses = np.concatenate([self.quaternion, self.translation], axis=1).tolist()
        for number, (row, name) in enumerate(zip(poses, self.names, strict=True), 1):
            yield _line(number, *row, number, name)
            yield ""

    def _points_text(self) -> Iterator[str]:
        yield "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)"
        yield f"# Number of points: {len(self.points)}, mean track length: 0"
        rows = zip(self.points.tolist(), self.colours.tolist(), strict=True)
        for number, (place, colour) in enumerate(rows, 1):
            yield _line(number, *place, *colour, NO_ERROR)


def _ids(count: int) -> range:
    return range(1, count + 1)


def _count(table: np.ndarray) -> bytes:
    return COUNT.type(len(table)).tobytes()


def _line(*values: object) -> str:
    return " ".join(map(str, values))
