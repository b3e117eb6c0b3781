"""Highlights of a machine and their sparse derivatives by its free parameters.

The point of reflection on a sphere is P = c + r n, where the unit normal n bisects the unit vectors
a and b toward light and pinhole: the part of a + b square to n is zero. Differentiated implicitly,
with A = (1 - a a^T) / |L - P|, B = (1 - b b^T) / |O - P|, T = 1 - n n^T and g = n . (a + b),

    (r T (A + B) T + g) dn = T (A dL + B dO - (A + B) (dc + n dr)).

A sphere with a form of height h (tbcad.core.optics.sphere_forms) is there as the sphere that
touches it: r n is the tangential displacement q of the point, and the normal turns by q / r - H q
with the second derivatives H of h, so that g becomes g (1 - r H). A gradient of h that is larger
by e turns the normal by -e, and moves the point by K^-1 g e, with K that matrix over r.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import LensCamera, distorted
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.optics.sphere_forms import (
    TERM_COUNT,
    bends,
    effective_centres,
    heights,
    term_heights,
)
from tbcad.rig.calibration.estimate.parameters import Block, Of, Prior
from tbcad.rig.calibration.estimate.slopes import Slopes, camera_turns, sphere_slopes, turn_slopes
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats, Ints

ITERATIONS = 60
CONVERGED = 1e-14  # radians, of the normal
MAX_STEP = 0.5  # radians
# From the bisector at the centre Newton's steps go astray on one large sphere in 2,000.
START_ITERATIONS = 4
LENS = 9  # focal lengths 2, principal point 2, distortion 5


@dataclass(frozen=True)
class Reflections:
    """Points of reflection of n highlights, with their derivatives, rows by columns."""

    point: Floats  # mm, (n, 3)
    by_centre: Floats  # (n, 3, 3)
    by_radius: Floats  # (n, 3)
    by_light: Floats  # (n, 3, 3)
    by_pinhole: Floats  # (n, 3, 3)
    by_slope: Floats  # by the gradient of a form's height, mm, (n, 3, 3)


def reflections(
    centre: Floats, radius: Floats, light: Floats, pinhole: Floats, bend: Floats | None = None
) -> Reflections:
    """Where spheres (n,) show lights (n, 3) to a pinhole (3,), all in mm.

    They may touch surfaces there whose forms have second derivatives, 1/mm, (n, 3, 3).
    """
    start = reflection_points(centre, radius, light, pinhole, START_ITERATIONS)
    normal = unit(start - centre)
    for _ in range(ITERATIONS):
        _, turned, residual = _law(centre, radius, light, pinhole, normal)
        step: Floats = np.linalg.solve(turned, residual[..., None])[..., 0].astype(np.float64)
        length = norm(step)
        normal = unit(
            normal + step * np.minimum(1, MAX_STEP / np.maximum(length, MAX_STEP))[:, None]
        )
        if length.max(initial=0) < CONVERGED:
            break
    (by_light, by_pinhole), turned, _ = _law(centre, radius, light, pinhole, normal)
    across = np.eye(3) - normal[:, :, None] * normal[:, None]
    point = centre + radius[:, None] * normal
    along = dot(normal, unit(light - point) + unit(pinhole - point))[:, None, None]
    if bend is not None:
        turned = turned - along * radius[:, None, None] * across @ bend @ across
    moved = radius[:, None, None] * np.linalg.solve(turned, across)
    with_point = np.eye(3) - moved @ (by_light + by_pinhole)
    return Reflections(
        point=point,
        by_centre=with_point,
        by_radius=(with_point @ normal[..., None])[..., 0],
        by_light=moved @ by_light,
        by_pinhole=moved @ by_pinhole,
        by_slope=along * moved,
    )


def _law(
    centre: Floats, radius: Floats, light: Floats, pinhole: Floats, normal: Floats
) -> tuple[tuple[Floats, Floats], Floats, Floats]:
    """A and B, the matrix before dn, and by how much the law is missed, (n, 3)."""
    point = centre + radius[:, None] * normal
    bends, total = [], np.zeros_like(point)
    for end in (light, pinhole):
        way = end - point
        length = norm(way)[:, None]
        direction = way / length
        total = total + direction
        bends.append((np.eye(3) - direction[:, :, None] * direction[:, None]) / length[..., None])
    across = np.eye(3) - normal[:, :, None] * normal[:, None]
    along = dot(normal, total)[:, None, None]
    turned = radius[:, None, None] * across @ (bends[0] + bends[1]) @ across + along * np.eye(3)
    return (bends[0], bends[1]), turned, (across @ total[..., None])[..., 0]


def projection(camera: LensCamera, image: Floats) -> tuple[Floats, Floats, Floats]:
    """Pixels (n, 2) of points (n, 3), mm, in the frame of a camera whose pose does not matter.

    With their derivatives by the point (n, 2, 3) and by the lens (n, 2, LENS).
    """
    place = image[:, :2] / image[:, 2:]
    shown = distorted(place, camera.distortion)
    by_place, by_distortion = _distortion_slopes(place, camera.distortion)
    by_point = np.empty((len(image), 2, 3))
    by_point[:, :, :2] = by_place / image[:, 2, None, None]
    by_point[:, :, 2] = -(by_place @ place[..., None])[..., 0] / image[:, 2, None]
    by_lens = np.zeros((len(image), 2, LENS))
    for row in (0, 1):
        by_lens[:, row, row] = shown[:, row]
        by_lens[:, row, 2 + row] = 1
    by_lens[:, :, 4:] = camera.focal[:, None] * by_distortion
    pixel = shown * camera.focal + camera.principal
    return np.asarray(pixel), camera.focal[:, None] * by_point, by_lens


def _distortion_slopes(place: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """Of tbcad.core.optics.camera.distorted by the place (n, 2, 2), by k1 k2 p1 p2 k3 (n, 2, 5)."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = place.T
    s = x * x + y * y
    radial = 1 + s * (k1 + s * (k2 + s * k3))
    slope = 2 * (k1 + s * (2 * k2 + s * 3 * k3))
    cross = x * y * slope + 2 * p1 * x + 2 * p2 * y
    by_place = np.stack(
        [
            np.stack([radial + x * x * slope + 2 * p1 * y + 6 * p2 * x, cross], axis=-1),
            np.stack([cross, radial + y * y * slope + 6 * p1 * y + 2 * p2 * x], axis=-1),
        ],
        axis=1,
    )
    by_coefficients = np.stack(
        [
            np.stack([x * s, x * s**2, 2 * x * y, s + 2 * x * x, x * s**3], axis=-1),
            np.stack([y * s, y * s**2, s + 2 * y * y, 2 * x * y, y * s**3], axis=-1),
        ],
        axis=1,
    )
    return by_place, by_coefficients


def highlights_with_slopes(
    prior: Prior, values: Floats, frame: Ints, sphere: Ints, led: Ints
) -> tuple[Floats, csr_array]:
    """Columns and rows (n, 2) of highlights (n,), and derivatives by values (q,), (2 n, q)."""
    machine = prior.machine(values)
    image = light_images(prior, values, machine, frame, sphere, machine.leds[led])
    of, by = image.slopes.of, image.slopes.by
    slopes = Slopes({**of, Of.LED: led}, {Block.LEDS: image.by_light} | by)
    return image.pixel, slopes.matrix(prior)


@dataclass(frozen=True)
class LightImages:
    """Where spheres show lights."""

    pixel: Floats  # column and row, (n, 2)
    by_light: Floats  # derivatives by the light's place, px/mm, (n, 2, 3)
    slopes: Slopes  # derivatives by all parameters but the LEDs


def light_images(
    prior: Prior, values: Floats, machine: Machine, frame: Ints, sphere: Ints, light: Floats
) -> LightImages:
    """Where spheres (n,) show lights (n, 3) in frames (n,) of the machine of these values."""
    camera = machine.camera
    seen, formed, by_turn = _seen(machine, frame, sphere, light)
    image = (seen.point - camera.pinhole) @ camera.axes.T
    pixel, by_image, by_lens = projection(camera, image)
    by_point = by_image @ camera.axes
    moved = sphere_slopes(prior, values, machine, frame, sphere)
    turned, aimed = (one.T[None] for one in camera_turns(prior, values))
    by_logarithm, (x, y) = np.eye(LENS), camera.focal  # of the focal lengths
    by_logarithm[:2, :2] = [[x, x / 2], [y, -y / 2]]
    lens = by_lens @ by_logarithm
    by = {
        Block.CAMERA_TURN: by_image @ np.cross(turned, image[:, None]).swapaxes(1, 2),
        Block.PINHOLE: by_point @ (seen.by_pinhole - np.eye(3)),
        Block.FOCAL: lens[:, :, :2],
        Block.PRINCIPAL: lens[:, :, 2:4]
        + by_image @ np.cross(aimed, image[:, None]).swapaxes(1, 2),
        Block.DISTORTION: lens[:, :, 4:],
        Block.RADII: by_point @ seen.by_radius[..., None],
        **{block: by_point @ seen.by_centre @ value for block, value in moved.by.items()},
        **{block: by_point @ value for block, value in formed.items()},
    }
    if by_turn is not None:
        for block, turn in turn_slopes(prior, values, machine, frame, sphere).items():
            by[block] = by[block] + by_point @ by_turn @ turn
    if Block.POWER in by:
        growth = prior.radius_by_power(values)[sphere, None, None]
        by[Block.POWER] = by[Block.POWER] + growth * by[Block.RADII]
    return LightImages(pixel, by_point @ seen.by_light, Slopes(moved.of, by))


def _seen(
    machine: Machine, frame: Ints, sphere: Ints, light: Floats
) -> tuple[Reflections, dict[Block, Floats], Floats | None]:
    """Points where spheres show lights, and their derivatives by what only caps have, (n, 3, c).

    And by rotations of the forms alone about their spheres' centres, (n, 3, 3); None: no forms.
    """
    centre, radius, pinhole = (
        machine.centres(frame, sphere),
        machine.radius[sphere],
        machine.camera.pinhole,
    )
    if machine.forms is None:
        return reflections(centre, radius, light, pinhole), {}, None
    some, touching = machine.forms.half_aperture[sphere] > 0, centre.copy()
    form, bend = machine.forms_in(frame[some], sphere[some]), np.zeros((len(centre), 3, 3))
    size, own = radius[some], light[some]
    touching[some] = effective_centres(centre[some], size, form, own, pinhole)
    offset = reflection_points(touching[some], size, own, pinhole) - centre[some]
    bend[some] = bends(form, offset)
    seen = reflections(touching, radius, light, pinhole, bend)
    # A larger radius takes a direction from the centre farther across the form.
    outward, by_radius = unit(offset)[..., None], seen.by_radius.copy()
    along = seen.by_centre[some] @ outward
    farther = heights(form, offset)[1][:, None] @ outward * along
    by_radius[some] = (along + farther + seen.by_slope[some] @ bend[some] @ outward)[..., 0]
    height, gradient = term_heights(form, offset)
    by_form = np.zeros((len(centre), 3, TERM_COUNT))
    by_form[some] = along * height[:, None] + seen.by_slope[some] @ gradient.swapaxes(1, 2)
    # At a fixed offset o a rotation w changes the height by -grad . (w x o), and the gradient g by
    # w x g - H (w x o).
    slope, by_turn = heights(form, offset)[1], np.zeros((len(centre), 3, 3))
    lever = np.cross(offset[:, None], np.eye(3)).swapaxes(1, 2)  # columns o x e
    swung = np.cross(slope[:, None], np.eye(3)).swapaxes(1, 2)
    by_turn[some] = along @ (slope[:, None] @ lever)
    by_turn[some] += seen.by_slope[some] @ (bend[some] @ lever - swung)
    return replace(seen, by_radius=by_radius), {Block.FORM: by_form}, by_turn
