"""A field as Gaussian splats, in the PLY that viewers of them read.

After B. Kerbl and others, 3D Gaussian Splatting, ACM Trans. Graphics 42(4), 2023, and the file of
their program: places, colours as spherical harmonics, logits of opacity, logarithms of standard
deviations, quaternions. Each dense node becomes a round splat. Such pictures are coarser than the
field's own, between those of `--method depth` and of the field (docs/reconstruct.md), for splats
add up otherwise than density along a ray does: take the mesh or the field where a program can.
"""

import numpy as np

from tbcad.reconstruct.field import Field
from tbcad.reconstruct.marching import MATT
from tbcad.types import Floats

# Of those tried (0.25 to 0.65; 0.6 to 4) the best pictures of three objects.
SIZE = 0.4  # standard deviation, distances of nodes
THICKNESS = 0.8  # way through the density of a node that makes its opacity, distances of nodes
LEAST_OPACITY, MOST_OPACITY = 0.01, 0.99
CONSTANT = 0.28209479177387814  # spherical harmonics of degree 0 and 1
LINEAR = 0.4886025119029199
ROTATION = (1.0, 0.0, 0.0, 0.0)


def splats_file(made: Field) -> bytes:
    """The file of a field, mm and z up; colours of a field of first order have degree 1."""
    opacity = 1 - np.exp(-THICKNESS * made.grid.pitch_mm * made.density())
    kept = opacity > LEAST_OPACITY
    opacity = np.minimum(opacity[kept], MOST_OPACITY)
    count, values = len(opacity), made.values[kept].astype(np.float64)
    harmonics = _harmonics(values[:, MATT:].reshape(count, 3, -1)) if made.order else None
    columns = {
        "x y z": made.grid.points[kept],
        "f_dc_0 f_dc_1 f_dc_2": (values[:, 1:MATT] - 0.5) / CONSTANT,
        **({} if harmonics is None else {" ".join(f"f_rest_{k}" for k in range(9)): harmonics}),
        "opacity": np.log(opacity / (1 - opacity))[:, None],
        "scale_0 scale_1 scale_2": np.full((count, 3), np.log(SIZE * made.grid.pitch_mm)),
        "rot_0 rot_1 rot_2 rot_3": np.broadcast_to(ROTATION, (count, 4)),
    }
    lines = (
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {count}",
        *(f"property float {name}" for names in columns for name in names.split()),
        "end_header",
    )
    rows = np.concatenate(list(columns.values()), axis=1).astype("<f4")
    return ("\n".join(lines) + "\n").encode() + rows.tobytes()


def _harmonics(slopes: Floats) -> Floats:
    """Coefficients (v, 9) of degree 1, by colours, of slopes (v, 3, 3) against x, y, z.

    Directions are those of rays, from the camera to the splat, in both.
    """
    x, y, z = np.moveaxis(slopes, -1, 0)
    return np.stack([-y, z, -x], axis=-1).reshape(len(slopes), 9) / LINEAR
