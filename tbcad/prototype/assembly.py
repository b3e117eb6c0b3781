"""The rig as it stands: groups of named, coloured solids in the frame of the shell."""

import numpy as np

from tbcad.cad.assembly import Colour, ColouredSolid, SolidGroup
from tbcad.cad.primitives import pyramid, sphere
from tbcad.geometry.vectors import norm
from tbcad.prototype.frame import frame_solids as frames
from tbcad.prototype.machine import Machine
from tbcad.prototype.printing.parts import Role

METAL: Colour = (0.55, 0.56, 0.58, 1.0)
STEEL: Colour = (0.78, 0.80, 0.83, 1.0)
SEEN: Colour = (0.30, 0.60, 0.95, 0.35)
LIGHT: Colour = (1.00, 0.85, 0.30, 0.15)
COLOURS: dict[Role, Colour] = {
    "base": (0.36, 0.45, 0.58, 1.0),
    "cap": (0.85, 0.70, 0.40, 1.0),
    "stage": (0.30, 0.30, 0.32, 1.0),
    "frame": (0.85, 0.50, 0.30, 1.0),
}


def rig(built: Machine) -> tuple[SolidGroup, ...]:
    """All bodies of the prototype where they stand with the base at angle zero.

    Coupons are tools, and not in it. What light passes through is there to be looked at, and
    transparent: the capture sphere, and what the camera sees.
    """
    return (
        _printed("base", built, ("base", "cap")),
        _balls(built),
        _printed("stage", built, ("stage",)),
        _printed("frame", built, ("frame",)),
        _bought(built),
        _views(built),
    )


def _printed(name: str, built: Machine, roles: tuple[str, ...]) -> SolidGroup:
    return SolidGroup(
        name,
        tuple(
            ColouredSolid(piece.name, piece.part.shape, COLOURS[piece.role])
            for piece in built.pieces
            if piece.role in roles
        ),
    )


def _bought(built: Machine) -> SolidGroup:
    bodies = (ColouredSolid(name, shape, METAL) for name, shape in frames.bought(built.frame))
    return SolidGroup("bought", tuple(bodies))


def _balls(built: Machine) -> SolidGroup:
    balls, centre = built.made.balls, built.made.body_centres()
    bought = (~balls.cap).nonzero()[0].tolist()
    return SolidGroup(
        "balls",
        tuple(
            ColouredSolid(f"ball_{k + 1}", sphere(centre[k], float(balls.body_radius[k])), STEEL)
            for k in bought
        ),
    )


def _views(built: Machine) -> SolidGroup:
    """The capture sphere, and what the camera sees as far as beyond it."""
    view, radius = built.made.half.camera, built.target / 2
    length = float(norm(view.pinhole)) + radius
    wide = length * np.tan(view.hfov / 2)
    high = wide * view.height_px / view.width_px
    middle, up = view.pinhole + length * view.forward, np.cross(view.right, view.forward)
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = middle + signs @ np.stack([wide * view.right, high * up])
    return SolidGroup(
        "views",
        (
            ColouredSolid("capture_sphere", sphere(np.zeros(3), radius), SEEN),
            ColouredSolid("camera_view", pyramid(view.pinhole, corners), LIGHT),
        ),
    )
