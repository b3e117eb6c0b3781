"""The assembled prototype: groups of named, coloured solids in the frame of the shell."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tbcad.cad.formats.assembly import Colour, ColouredSolid, SolidGroup, display_mesh
from tbcad.cad.kernel.solids import pyramid, sphere
from tbcad.core.geometry.vectors import norm
from tbcad.prototype.arrangement import PrototypeModel
from tbcad.prototype.fasteners import Fastener, fastener_axes, fastener_component
from tbcad.prototype.printing.placing import Role, component_solid

METAL: Colour = (0.55, 0.56, 0.58, 1.0)
FASTENER: Colour = (0.25, 0.26, 0.28, 1.0)
STEEL: Colour = (0.78, 0.80, 0.83, 1.0)
SEEN: Colour = (0.30, 0.60, 0.95, 0.35)
CARD: Colour = (0.05, 0.05, 0.06, 0.12)
LIGHT: Colour = (1.00, 0.85, 0.30, 0.15)
COLOURS: dict[Role, Colour] = {
    "base": (0.36, 0.45, 0.58, 1.0),
    "cap": (0.85, 0.70, 0.40, 1.0),
    "stage": (0.30, 0.30, 0.32, 1.0),
    "frame": (0.85, 0.50, 0.30, 1.0),
}


def assembly_groups(prototype: PrototypeModel) -> tuple[SolidGroup, ...]:
    """All bodies of the assembled prototype, the base at angle zero.

    Coupons are tools and left out. What light passes through is included to be looked at, and
    transparent: the capture sphere, and what the camera sees.
    """
    purchased = (
        ColouredSolid(component.name, component_solid(component), METAL)
        for component in prototype.frame.purchased
    )
    return (
        _printed("base", prototype, ("base", "cap")),
        SolidGroup("balls", tuple(_balls(prototype))),
        _printed("stage", prototype, ("stage",)),
        _printed("frame", prototype, ("frame",)),
        SolidGroup("bought", tuple(purchased)),
        SolidGroup("shroud", tuple(_shroud(prototype))),
        SolidGroup("fasteners", tuple(_fasteners(prototype.fasteners))),
        _views(prototype),
    )


def _printed(name: str, prototype: PrototypeModel, roles: tuple[Role, ...]) -> SolidGroup:
    solids = (
        ColouredSolid(part.name, part.solid.shape, COLOURS[part.role], part.solid.mesh)
        for part in prototype.printed
        if part.role in roles
    )
    return SolidGroup(name, tuple(solids))


def _fasteners(fasteners: Sequence[Fastener]) -> Iterator[ColouredSolid]:
    """Those of one part are copies of one solid, which is built and meshed once."""
    originals: dict[str, ColouredSolid] = {}
    for one in fasteners:
        name = one.part.name
        if name not in originals:
            at_origin = replace(one, place=np.zeros(3), along=np.eye(3)[0])
            solid = component_solid(fastener_component(at_origin))
            originals[name] = ColouredSolid(name, solid, FASTENER, display_mesh(solid))
        yield originals[name].copy(one.name, fastener_axes(one.along), one.place)


def _balls(prototype: PrototypeModel) -> Iterator[ColouredSolid]:
    balls, centre = prototype.layout.balls, prototype.layout.body_centres()
    for k in (~balls.cap).nonzero()[0].tolist():
        yield ColouredSolid(f"ball_{k + 1}", sphere(centre[k], float(balls.body_radius[k])), STEEL)


def _shroud(prototype: PrototypeModel) -> Iterator[ColouredSolid]:
    """The panels without flaps; transparent, so that the rig is seen."""
    for panel in prototype.shroud.panels if prototype.shroud else ():
        yield ColouredSolid(panel.name, component_solid(panel.component), CARD)


def _views(prototype: PrototypeModel) -> SolidGroup:
    """The capture sphere, and what the camera sees up to the sphere's far end."""
    camera = prototype.layout.array.camera
    radius = prototype.spec.optics.capture_diameter_mm / 2
    length = float(norm(camera.pinhole)) + radius
    width = length * np.tan(camera.hfov / 2)
    height = width * camera.height_px / camera.width_px
    middle, up = camera.pinhole + length * camera.forward, np.cross(camera.right, camera.forward)
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = middle + signs @ np.stack([width * camera.right, height * up])
    solids = (
        ColouredSolid("capture_sphere", sphere(np.zeros(3), radius), SEEN),
        ColouredSolid("camera_view", pyramid(camera.pinhole, corners), LIGHT),
    )
    return SolidGroup("views", solids)
