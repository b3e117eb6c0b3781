"""Sag of the carrier: how far balls move besides the motion that a calibration finds.

A calibration finds a motion of the whole base for each stop, and where the balls are on it. What is
left is the change of the carrier's shape from stop to stop. Of that motion a ball's mean over its
pictures is not left to the calibration: seats are placed against it, or coverage is lost.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tbcad_verify.mesh.mesh import Mesh, join_meshes
from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.bodies import MeasuredPrototype, rigid_motions
from tbcad_verify.prototype.bricks import STEP_MM, Bricks, fill_bricks, shapes
from tbcad_verify.prototype.context import OTHER_SAG, PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.report.checks import Check, CheckName, at_most, require
from tbcad_verify.run.kept import kept
from tbcad_verify.types import Floats

FILE = "sag.csv"
CHECKS = {
    **{"sag left": "mm", "sag as written": "%", "balls under weight": "mm"},
    "turns as written": "%",
}
LEFT_MM = 0.1  # half of a pixel of the light field at the object, by which a ray may be off
# Printed moduli are known to a quarter; two models of one part differ by a tenth to a quarter.
OFF_PERCENT = 40.0
# Of a ball from its mirrors' places: 1.4 mm at the most cost the default prototype 0.8 mm of its
# coverage. A modulus is known to a quarter, of that 0.35 mm.
BESIDE_MM = 0.4
RIGID_MM = 1e-6  # of what bends below the carrier, which moves all balls as one
G_MM = 9.80665e-3  # weight of a gram, newtons
SHAFT, ZERO_DISC = "shaft", "zero_disc"


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    parts: list[MeasuredPart],
    measured: MeasuredPrototype,
    drawn: Mapping[str, Shape],
) -> list[Check]:
    """Residual of the carrier's sag after six freedoms at each stop, and that of the file.

    With a drive that has no shaft of its own only that seats are not placed against any. Unknown:
    there is no sag.csv, or not of these stops and balls.
    """
    if SHAFT not in drawn:
        return [_beside(names[2], context, measured, 0.0)]
    table = require(context.prototype.sag, "the build has no sag.csv")
    turn = context.base_rotation(np.radians(context.prototype.stops.angle)).as_matrix()
    down = np.array([0.0, 0.0, -1.0]) @ turn
    whole = np.einsum("kab,sb->ska", _by_weight(context, parts, measured, drawn), down)
    own, turned = whole[..., :3], whole[..., 3:]
    told = require(table.moved(own.shape), OTHER_SAG)
    *told, told_turn = np.einsum("sba,pskb->pska", turn, told)
    told = np.array(told)
    left = np.linalg.norm(_without_motions(own - own.mean(axis=0), measured.body.T), axis=2)
    stop, ball = np.unravel_index(left.argmax(), left.shape)
    off = 100 * float(np.linalg.norm(told[0] - own) / np.linalg.norm(own))
    bent = float(np.abs(_without_motions(told[1:].sum(axis=0), measured.body.T)).max())
    detail = f"root mean square {1000 * np.sqrt((own**2).sum(axis=2).mean()):.0f} um"
    if bent > RIGID_MM:
        off, detail = np.inf, f"head, shaft and uprights bend the base by {1000 * bent:.3g} um"
    return [
        at_most(names[0], float(left.max()), LEFT_MM, f"ball {ball + 1} at stop {stop + 1}"),
        at_most(names[1], off, OFF_PERCENT, detail),
        _beside(names[2], context, measured, _mean(context, own + told[1:].sum(axis=0)).T),
        _turned(names[3], measured.body.T, (told[0], told_turn), (own, turned)),
    ]


def _turned(
    name: CheckName, places: Floats, told: tuple[Floats, Floats], own: tuple[Floats, Floats]
) -> Check:
    """How far turns (S, K, 3) beside the best motion of displacements (S, K, 3) differ."""
    by_file, by_bricks = (turn - motions(moved, places)[:, None, 3:] for moved, turn in (told, own))
    apart = np.linalg.norm(by_file - by_bricks, axis=2)
    stop, ball = np.unravel_index(apart.argmax(), apart.shape)
    off = 100 * float(np.linalg.norm(by_file - by_bricks) / np.linalg.norm(by_bricks))
    detail = f"ball {ball + 1} at stop {stop + 1} by {1000 * apart[stop, ball]:.2g} mrad"
    return at_most(name, off, OFF_PERCENT, detail)


def _mean(context: PrototypeContext, moved: Floats) -> Floats:
    """(K, 3) of displacements (S, K, 3) on the mean over the pictures of each ball."""
    plan = context.prototype.plan
    shown = np.zeros(moved.shape[:2])
    np.add.at(shown, (plan.stop - 1, plan.ball - 1), 1.0)
    shown /= np.maximum(shown.sum(axis=0), 1)
    return np.asarray(np.einsum("sk,skx->kx", shown, moved))


def _beside(
    name: CheckName, context: PrototypeContext, measured: MeasuredPrototype, sag: Floats | float
) -> Check:
    """How far weight brings a ball from its seat beside the place of its mirrors."""
    balls = context.prototype.balls
    place = balls.columns("bx", 3) + balls.sag
    off = np.linalg.norm(measured.seated + sag - place, axis=0)
    most = int(np.nanargmax(off))
    return at_most(name, float(off[most]), BESIDE_MM, f"ball {most + 1}")


def _by_weight(
    context: PrototypeContext,
    parts: list[MeasuredPart],
    measured: MeasuredPrototype,
    drawn: Mapping[str, Shape],
) -> Floats:
    """(K, 6, 3) displacements of the balls at angle zero, mm, then turns of their seats, radians.

    By one g along x, y, z: last axis.
    """
    printer, axis = context.export.spec.printer, context.frame[0]
    carrier = [one for one in of_roles(parts, "base") if one.part.name != ZERO_DISC]
    mesh = join_meshes([one.placed_mesh for one in carrier])
    seats = measured.seated.T, measured.body_radius, context.masses_g
    moved = _moved(mesh, drawn[SHAFT][0], axis, seats, (printer.infill, printer.density_g_cm3))
    return moved / (printer.modulus_gpa * 1e3)


@kept("checks of the sag")
def _moved(
    mesh: Mesh,
    shaft: Floats,
    axis: Floats,
    seats: tuple[Floats, Floats, Floats],
    material: tuple[float, float],
) -> Floats:
    """(K, 6, 3) at a modulus of 1 MPa, held on the shaft, whose corners are (n, 3).

    seats: centres (K, 3), radii (K,) and masses (K,) of the balls; material: infill, density.
    """
    infill, density = material
    bricks = fill_bricks(mesh, infill)
    along = bricks.place @ axis
    out = np.linalg.norm(bricks.place - along[..., None] * axis, axis=2)
    reach = np.linalg.norm(shaft - (shaft @ axis)[:, None] * axis, axis=1).max() + STEP_MM
    held = (bricks.share > 0) & (out < reach) & (along < (shaft @ axis).max() + STEP_MM)
    weight = bricks.spread(bricks.share * STEP_MM**3 * density * 1e-3)
    load, near = weight[:, None, None] * np.eye(3), _near(bricks, *seats[:2])
    for centre, mass, one in zip(seats[0], seats[2], near, strict=True):
        load += mass * _carrying(bricks, centre, one)
    moved = bricks.solve(held, load * G_MM)
    return np.stack([_motion(bricks, moved, *pair) for pair in zip(seats[0], near, strict=True)])


def _near(bricks: Bricks, centres: Floats, radii: Floats) -> list[Floats]:
    """Material that carries each ball, K of (c, q)."""
    return [
        bricks.share * (np.linalg.norm(bricks.place - centre, axis=2) < radius + STEP_MM)
        for centre, radius in zip(centres, radii, strict=True)
    ]


def _carrying(bricks: Bricks, centre: Floats, near: Floats) -> Floats:
    """(n, 3, 3) forces on nodes near a centre that carry a unit weight in it along x, y, z.

    Their moment about the centre is zero: pads press toward it. Spread evenly they would turn the
    seat, by a third of what its turn changes from stop to stop.
    """
    cell, cube = np.nonzero(near)
    motion = rigid_motions(bricks.place[cell, cube] - centre)
    share = np.repeat(near[cell, cube], 3)[:, None] * motion
    force = (share @ np.linalg.inv(motion.T @ share))[:, :3].reshape(-1, 1, 3, 3)
    load = np.zeros((bricks.nodes, 3, 3))
    np.add.at(load, bricks.node[cell], shapes()[cube][:, :, None, None] * force)
    return load


def _motion(bricks: Bricks, moved: Floats, centre: Floats, near: Floats) -> Floats:
    """(6, 3) shift and turn about a centre as material near it is moved, by the best motion."""
    cell, cube = np.nonzero(near)
    there = np.einsum("mi,mikl->mkl", shapes()[cube], moved[bricks.node[cell]])
    motion = rigid_motions(bricks.place[cell, cube] - centre)
    return np.asarray(np.linalg.lstsq(motion, there.reshape(-1, 3), rcond=None)[0])


def _without_motions(moved: Floats, centre: Floats) -> Floats:
    """(S, K, 3) displacements of the balls (K, 3) less the best rigid motion of each stop."""
    fitted = motions(moved, centre) @ rigid_motions(centre).T
    return np.asarray(moved - fitted.reshape(moved.shape))


def motions(moved: Floats, centre: Floats) -> Floats:
    """(S, 6) shifts and turns that fit displacements (S, K, 3) of the balls (K, 3) best."""
    flat = moved.reshape(len(moved), -1)
    return np.asarray(flat @ np.linalg.pinv(rigid_motions(centre)).T)
