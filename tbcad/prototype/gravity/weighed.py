"""Sag of an arrangement, and seats that are offset by its mean.

Carrier and bearing head are linear elastic solids, as they are to be built; the shaft is a beam on
two bearings, the uprights are columns. All else is rigid: bearings, screwed joints, plate, feet.
The frame here is the base's at angle zero: x along the axis w, y at azimuth zero.

It is worked out on meshes before there are solids, and once: that the seats are then a millimetre
elsewhere changes it by 0.02 mm (docs/decisions/0044).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from trimesh import Trimesh

from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.vectors import norm
from tbcad.prototype.arrangement import PrototypeModel, rearranged
from tbcad.prototype.base.solid import carrier_mesh
from tbcad.prototype.drive.balance import ball_masses
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.gravity.compliance import (
    N_PER_G,
    Axle,
    Bodies,
    Material,
    column_compliance,
    compliance,
    moved_to,
    sag_of_bodies,
    shaft_compliance,
    turned_to,
)
from tbcad.prototype.gravity.sag import Sag
from tbcad.prototype.printed import component_mesh
from tbcad.types import Floats

STEEL, ALUMINIUM, ALUMINIUM_SHEAR = 210.0, 70.0, 26.0  # moduli, GPa
# Of an extrusion of 20 mm with slots of 6 mm, mm^4: vendors' lists have 6,700 to 8,000; twist
# mostly goes through the bending of both uprights, which stand apart.
SECOND_MOMENT, TWIST_CONSTANT = 7.0e3, 1.5e3
# From a screw's axis to where a part is held by it, and along its axis.
SCREW_MM, REACH_MM = 5.0, 10.0
MPA_PER_GPA = 1e3
CARRIER, HEAD, SHAFT = "carrier", "bearing_head", "shaft"
UPRIGHTS, BEARINGS = ("upright_left", "upright_right"), ("bearing_front", "bearing_rear")
HOLDING = (HEAD, SHAFT, *UPRIGHTS, *BEARINGS)
X = np.array([1.0, 0.0, 0.0])
# Of shifts, mm, and turns, radians, by weight: finer than any model of it is true.
STEPS = np.repeat([1e-6, 1e-9], 3)


@dataclass(frozen=True)
class WeighedBase:
    """A base, its weight and its supports, in the base's frame at angle zero."""

    axes: Floats  # of that frame in the shell's, as rows, (3, 3)
    angle: Floats  # of the base at each stop, radians, (s,)
    bodies: Bodies
    # carrier, bearing head, shaft, bearings and uprights
    solids: dict[str, Trimesh]
    load: tuple[Floats, float]  # centre of gravity of all that turns, mm, (3,), and mass, g
    screws: list[Axle]  # that hold the head on the uprights
    material: Material  # of carrier and head


def against_weight(model: PrototypeModel) -> PrototypeModel:
    """An arrangement with its sag, and with seats that weight brings to where the balls are to be.

    On the mean over the pictures of each ball. With a drive that has no shaft of its own nothing
    sags: no list says how stiff the bearings of a rotary stage are.

    SpecError: there is no room where the seats then are.
    """
    if SHAFT not in {one.name for one in model.frame.purchased}:
        return model
    sag, layout = sag_of(weighed_base(model)), model.layout
    seen = np.zeros(sag.whole.shape[:2])
    np.add.at(seen, (layout.stops.stop, layout.fit.ball), 1.0)
    mean = np.einsum("sk,skx->kx", seen / seen.sum(axis=0), sag.whole)
    placed = rearranged(model, replace(layout, sag=mean @ sag.axes))
    return replace(placed, sag=sag)


def weighed_base(model: PrototypeModel) -> WeighedBase:
    """Of an arrangement with a shaft."""
    layout, printer, balance = model.layout, model.spec.printer, model.balance
    axes, balls = balance.frame, ball_masses(layout)
    bodies = (*model.frame.printed, *model.frame.purchased)
    meshes = {one.name: component_mesh(one) for one in bodies if one.name in HOLDING}
    meshes[CARRIER] = carrier_mesh(model.base, model.split)
    return WeighedBase(
        axes=axes,
        angle=layout.stops.angle,
        bodies=Bodies(balls.centre @ axes.T, layout.balls.body_radius, balls.mass_g),
        solids={
            name: Trimesh(one.vertices @ axes.T, one.triangles, process=False)
            for name, one in meshes.items()
        },
        load=(axes @ balance.centre, balance.mass_g),
        screws=_screws(model.fasteners, axes),
        material=Material(printer.modulus_gpa, printer.density_g_cm3, printer.infill),
    )


def sag_of(base: WeighedBase) -> Sag:
    """The sag of the balls of a base."""
    carrier, shaft = base.solids[CARRIER], base.solids[SHAFT]
    held = Axle(X * carrier.bounds[0, 0], X * shaft.bounds[1, 0], _shaft_radius(base.solids))
    moved = sag_of_bodies(carrier, base.bodies, held, base.material)
    sag = Sag(base.angle, base.bodies.centre, base.axes, {}, np.empty(0))
    of_carrier = _rounded(np.einsum("kag,sg->ska", moved, sag.gravity))
    of = {CARRIER: of_carrier[..., :3]}
    turns = base.angle, -base.axes[:, 2]
    for name, flexible in _holding(base, held.start).items():
        of[name] = moved_by(flexible, held.start, base.bodies.centre, base.load, turns)
    return replace(sag, of=of, seat_turn=of_carrier[..., 3:])


def _shaft_radius(solids: dict[str, Trimesh]) -> float:
    return float(np.ptp(solids[SHAFT].bounds[:, 1]) / 2)


def _holding(base: WeighedBase, hub: Floats) -> dict[str, Floats]:
    """Compliances at the hub of head, shaft and uprights, (6, 6) each, in the base's frame."""
    solids = base.solids
    middle = {name: solids[name].bounds[:, 0].mean() for name in BEARINGS}
    front, rear = (X * middle[name] for name in BEARINGS)
    inertia = math.pi / 4 * _shaft_radius(solids) ** 4
    shaft = shaft_compliance(hub[0] - front[0], front[0] - rear[0], STEEL * MPA_PER_GPA * inertia)
    loaded = [_round(solids[name]) for name in BEARINGS]
    head = compliance(solids[HEAD], front, base.screws, loaded, base.material)
    return {
        "head": moved_to(head, hub - front),
        "shaft": shaft,
        "uprights": _uprights(solids, base.axes, hub),
    }


def _round(bearing: Trimesh) -> Axle:
    """Outside of a bearing, which its seat is round."""
    low, high = bearing.bounds
    return Axle(X * low[0], X * high[0], float(high[1]))


def _screws(fasteners: Iterable[Fastener], axes: Floats) -> list[Axle]:
    """Round the screws that hold the head on the uprights."""
    held = [one for one in fasteners if HEAD in one.through]
    held = [one for one in held if not set(UPRIGHTS).isdisjoint(one.through)]
    places = [(axes @ one.place, axes @ one.along) for one in held]
    return [Axle(at - REACH_MM * along, at + REACH_MM * along, SCREW_MM) for at, along in places]


def _uprights(solids: dict[str, Trimesh], axes: Floats, hub: Floats) -> Floats:
    """Compliance of both uprights at the hub, (6, 6): columns that the head makes one."""
    corners = np.stack([(solids[name].vertices @ axes).min(axis=0) for name in UPRIGHTS])
    ends = np.stack([(solids[name].vertices @ axes).max(axis=0) for name in UPRIGHTS])
    middle = np.concatenate([corners, ends]).mean(axis=0)
    foot, apart = corners[0, 2], norm(corners[1] - corners[0])
    height = float((solids[HEAD].vertices @ axes)[:, 2].min()) - foot
    bending = 2 * ALUMINIUM * MPA_PER_GPA * SECOND_MOMENT
    twisting = 2 * ALUMINIUM_SHEAR * MPA_PER_GPA * TWIST_CONSTANT
    # A turn about z bends both uprights the other way.
    twisting += bending * 3 / height**2 * (apart / 2) ** 2
    top = np.array([*middle[:2], foot + height])
    column = turned_to(column_compliance(height, bending, twisting), axes)
    return moved_to(column, hub - axes @ top)


def moved_by(
    flexible: Floats,
    hub: Floats,
    centre: Floats,
    load: tuple[Floats, float],
    turns: tuple[Floats, Floats],
) -> Floats:
    """Displacements of places (k, 3) on the base as what holds its hub bends, mm, (s, k, 3).

    By a compliance (6, 6) at the hub, place and mass (g) of the load, the angles of the base (s,)
    and the direction of gravity, (3,).
    """
    angle, down = turns
    arm = rotated_about_x(np.broadcast_to(load[0], (len(angle), 3)), angle) - hub
    force = np.broadcast_to(load[1] * N_PER_G * down, arm.shape)
    motion = _rounded(np.concatenate([force, np.cross(arm, force)], axis=1) @ flexible)
    place = rotated_about_x(np.broadcast_to(centre, (len(angle), *centre.shape)), angle[:, None])
    moved = motion[:, None, :3] + np.cross(motion[:, None, 3:], place - hub)
    return rotated_about_x(moved, -angle[:, None])


def _rounded(motions: Floats) -> Floats:
    """Shifts and turns (..., 6) in steps: last digits of linear algebra follow from its threads."""
    return np.asarray(np.rint(motions / STEPS) * STEPS)
