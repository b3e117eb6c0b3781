"""One half of the machine as designed, as the fast model needs it, and where errors put it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.errors import InputError
from tbcad.geometry.vectors import dot, unit
from tbcad.optics.camera import Camera
from tbcad.simulate.scene.reflector import Reflector
from tbcad.tolerance.montecarlo.draws import Draws
from tbcad.tolerance.montecarlo.neighbour_pairs import Near, near
from tbcad.types import Bools, Floats

# No symmetry plane of a design holds this direction, so that no corner lies on a screen's axis;
# for mirrors on the seam it points away from the seam, where both halves' outlines are open.
ASKEW = np.array([1.0, 0.1234, 0.0567])


@dataclass(frozen=True)
class EdgeModel:
    """One camera's half as designed: m mirrors and two planes.

    Attributes:
        view: the camera.
        table: apex, normal, curvature of the mirrors, the seam and the foot, (m + 2, 7).
        near: which of them may meet.
        halved: mirrors that the seam halves, (m,).
        screen: two axes and normal u of the plane through the object that each faces, (m, 3, 3).
    """

    view: Camera
    table: Floats
    near: Near
    halved: Bools
    screen: Floats

    def __len__(self) -> int:
        """Number of mirrors."""
        return len(self.halved)


def nominal(at: Reflector) -> EdgeModel:
    """What the fast model needs of one camera with its mirrors."""
    every = at.cells.surfaces
    table = np.column_stack([every.apex, every.normal, every.curvature])
    first = unit(ASKEW - dot(at.u, ASKEW)[:, None] * at.u)
    screen = np.stack([first, np.cross(at.u, first), at.u], axis=1)
    return EdgeModel(at.camera, table, near(at.cells), every.apex[: len(at), 0] == 0, screen)


def nominals(cameras: tuple[Reflector, Reflector]) -> tuple[EdgeModel, EdgeModel]:
    """The same of both cameras."""
    a, b = cameras
    return nominal(a), nominal(b)


def tables(half: EdgeModel, draws: Draws) -> Floats:
    """The surfaces of s machines before their shells are scaled and moved, (s, m + 2, 7).

    A radius too large by d moves the apex out by d; this also holds for planar mirrors, which a
    thicker coat moves too. Their tilt is no error of its own kind.

    Raises:
        InputError: an error takes all of a mirror's radius.
    """
    table, m = np.repeat(half.table[None], len(draws), axis=0), len(half)
    normal, curvature = half.table[:m, 3:6], half.table[:m, 6]
    if np.any(draws.radius * curvature <= -1):
        raise InputError(
            f"sphere_radius_um and coating_um leave nothing of a mirror: allowed is less than its "
            f"radius, {1000 / curvature.max():.0f} um the least: make the errors smaller"
        )
    table[:, :m, :3] += draws.centre + draws.radius[:, :, None] * normal
    table[:, :m, 6] = curvature / (1 + draws.radius * curvature)
    return table


def axes(view: Camera) -> Floats:
    """Right, down and forward of a camera, (3, 3)."""
    return np.stack([view.right, np.cross(view.forward, view.right), view.forward])


def places(half: EdgeModel, draws: Draws) -> Floats:
    """What tbcad.tolerance.edges needs of each machine beside its surfaces, (s, 6, 3).

    Camera and object are moved into the frame of the shell instead of the shell out to them.
    """
    shell = Rotation.from_rotvec(draws.shell_tilt)
    camera = Rotation.from_rotvec(draws.camera_tilt)
    turned = [shell.apply(camera.apply(axis), inverse=True) for axis in axes(half.view)]
    pinhole = half.view.pinhole + draws.camera_shift
    moved = [shell.apply(point - draws.shell_shift, inverse=True) for point in (pinhole, 0.0)]
    return np.stack([*moved, draws.scale, *turned], axis=1)
