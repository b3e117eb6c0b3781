"""The balls of a calibrated machine as exact, named, coloured solids."""

from tbcad.as_built.deviations import Deviations, colours
from tbcad.cad.assembly import ColouredSolid, SolidGroup
from tbcad.cad.solids import common, one_solid, sphere
from tbcad.machine.machine import Machine
from tbcad.simulate.prototype.plan import Plan

SAME_MM = 1e-6  # centres and radii of a ball's front and body; a cap's are apart


def ball_group(machine: Machine, plan: Plan, found: Deviations) -> SolidGroup:
    """All balls at base angle zero; a cap is what its reflecting sphere and its body share."""
    shades = colours(found.distance_um / found.scale_um).tolist()
    bodies = []
    for number, (red, green, blue) in enumerate(shades, 1):
        k = number - 1
        shape = sphere(machine.centre[k], float(machine.radius[k]))
        apart = abs(plan.centre[k] - plan.body_centre[k]).max()
        if max(apart, abs(plan.radius[k] - plan.body_radius[k])) > SAME_MM:
            body = machine.centre[k] + plan.body_centre[k] - plan.centre[k]
            cap = common(shape, sphere(body, float(plan.body_radius[k])))
            shape = one_solid(f"ball_{number}", cap)
        bodies.append(ColouredSolid(f"ball_{number}", shape, (red, green, blue, 1.0)))
    return SolidGroup("balls", tuple(bodies))
