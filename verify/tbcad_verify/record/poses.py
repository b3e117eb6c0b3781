"""Recorded mirrors against DESIGN.md section 2, worked out again from the cameras."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad_verify.mesh.surfaces import reflect_directions
from tbcad_verify.mesh.vectors import axis_frame, dot, norm, polar_and_azimuth, unit, wrapped
from tbcad_verify.record.export import Camera, Export
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.record.spec import AUTO, LARGEST_MESH_ERROR_MM, OpticsSpec
from tbcad_verify.types import Floats

POSE_MM = 1e-9
ON_SEAM = 1e-9  # |ux| below which the seam cuts a mirror in two
SAME_DIRECTION = 1e-9  # of unit vectors
NEIGHBOURS = 19  # a vertex and two rings round it; farther planes never bound a flat mirror
UNLIKE_SPEC = 1e-9  # by which a number may be off that of the spec
WELL_FORMED = re.compile(r"[a-z][0-9]{4,}")


@dataclass(frozen=True)
class VirtualCameras:
    """Virtual cameras: one a mirror, but one for the two halves of a mirror on the seam."""

    index: NDArray[np.intp]  # (M,) virtual camera of each mirror
    count: int  # V
    # (M,) true for mirrors that have their other half on the other side of the seam
    halved: NDArray[np.bool_]


def virtual_cameras(mirrors: Mirrors) -> VirtualCameras:
    """Pair mirrors on x = 0 that have the same number and the same direction."""
    u = mirrors.columns("ux", 3)
    first: dict[str, int] = {}
    index = np.arange(len(mirrors))
    halved = np.zeros(len(mirrors), dtype=np.bool_)
    for row in np.flatnonzero(np.abs(u[0]) < ON_SEAM).tolist():
        other = first.setdefault(mirrors.ids[row][1:], row)
        if other != row and np.abs(u[:, row] - u[:, other]).max() < ON_SEAM:
            index[row] = other
            halved[[row, other]] = True
    unique, index = np.unique(index, return_inverse=True)
    return VirtualCameras(index, len(unique), halved)


def malformed(mirrors: Mirrors) -> list[str]:
    """Ids that occur twice, or are not the camera's letter and four digits or more."""
    counts = Counter(mirrors.ids)
    return sorted(
        {
            name
            for name, camera in zip(mirrors.ids, mirrors.camera.tolist(), strict=True)
            if counts[name] > 1 or not WELL_FORMED.fullmatch(name) or name[0] != camera
        }
    )


def pose_errors(export: Export) -> Floats:
    """(M,) largest deviation of each mirror from the design, mm; inf where its camera is unknown.

    Checked, angles as lengths at 1 mm: u and n are unit; p lies along u and on the ellipsoid with
    the spec's semi-minor axis and foci at the origin and the pinhole; n bisects the directions to
    the pinhole and to the aim, which is the origin; c = p - r n. Rule "traced" aims mirrors on the
    seam at a point of the x axis beyond it, within the object.
    """
    mirrors = export.mirrors
    errors = np.full(len(mirrors), np.inf)
    largest = export.target_mm / 2 if export.spec.mirrors.radius_rule == "traced" else 0.0
    for camera in export.cameras.values():
        rows = np.flatnonzero(mirrors.camera == camera.id)
        errors[rows] = _deviations(mirrors, rows, camera, export.semi_minor_mm, largest)
    return errors


def figure_errors(export: Export) -> Floats:
    """(M,) largest deviation of each mirror's figures, mm; inf where its camera is unknown.

    Checked, angles as lengths at 1 mm: polar angle and azimuth about the axis from the origin to
    the pinhole, theta_0 of the flat mirror, its half width l and theta_1 of equation 1.

    Source: DESIGN.md section 2.
    """
    mirrors = export.mirrors
    vertices = directions(export.spec.optics)
    errors = np.full(len(mirrors), np.inf)
    for camera in export.cameras.values():
        rows = np.flatnonzero(mirrors.camera == camera.id)
        one = mirrors.take(rows)
        expected = _figures(export, camera, one.columns("ux", 3), vertices)
        angles = np.radians(one.columns("theta0_deg", 4))
        turns = wrapped(angles - expected[1:])
        errors[rows] = np.abs([one.size_mm - expected[0], *turns]).max(axis=0, initial=0)
    return errors


def missing_directions(export: Export) -> tuple[list[str], int]:
    """Mirrors whose direction is no vertex of the polyhedron, or taken; and vertices not taken.

    Every vertex with z >= 0 needs a mirror of camera a where x >= 0 and one of b where x <= 0.
    """
    misplaced: list[str] = []
    missing = 0
    vertices = directions(export.spec.optics)
    for camera in export.cameras.values():
        side = np.sign(camera.pinhole[0])
        expected = vertices[:, (vertices[2] > -ON_SEAM) & (side * vertices[0] > -ON_SEAM)]
        rows = np.flatnonzero(export.mirrors.camera == camera.id)
        wrong, free = _match_vertices(export.mirrors.columns("ux", 3)[:, rows], expected)
        misplaced += [export.mirrors.ids[row] for row in rows[wrong].tolist()]
        missing += free
    return sorted(misplaced), missing


def contradictions(export: Export) -> list[str]:
    """Names of what the record has otherwise than the spec that it carries."""
    optics, sensor = export.spec.optics, export.spec.camera
    pairs = {
        "target_mm": (export.target_mm, optics.capture_diameter_mm),
        "coating_mm": (export.coating_mm, export.spec.mirrors.coating_um / 1000),
    }
    for camera in export.cameras.values():
        mirrored = camera.pinhole * np.sign([camera.pinhole[0] * optics.camera_mm[0], 1, 1])
        pairs |= {
            f"camera {camera.id} pinhole {k}": (mirrored[k], optics.camera_mm[k]) for k in range(3)
        }
        pairs |= {
            f"camera {camera.id} width": (camera.width, sensor.width_px),
            f"camera {camera.id} height": (camera.height, sensor.height_px),
            f"camera {camera.id} hfov": (np.degrees(camera.hfov), sensor.hfov_deg),
        }
    wrong = [name for name, (one, two) in pairs.items() if abs(one - two) > UNLIKE_SPEC]
    if export.spec.mesh.largest_mm > LARGEST_MESH_ERROR_MM:
        wrong.append(f"a mesh error of more than {LARGEST_MESH_ERROR_MM:g} mm in the spec")
    wrong += _beyond_the_limits(export)
    shells = export.parts if export.spec.shell.negative else ()
    if sorted(one.camera for one in export.mandrels) != sorted(one.camera for one in shells):
        wrong.append("the mandrels of shell.negative")
    asked = export.spec.shell.lamps.leds
    if export.parts and asked != AUTO and bool(asked) != bool(export.lamps):
        wrong.append("the lamps of shell.lamps.leds")
    return sorted(wrong)


def _beyond_the_limits(export: Export) -> Iterator[str]:
    """Limits of the spec that the prototype's record exceeds."""
    if (prototype := export.prototype) is None:
        return
    spec, (low, high) = export.spec.prototype, prototype.swing
    if high - low > spec.max_swing_deg:
        yield f"a swing of {high - low:.1f} deg above prototype.max_swing_deg"
    if prototype.balls.cap.any() and spec.caps == "none":
        yield "caps without prototype.caps"
    bought = prototype.balls.diameter_mm[~prototype.balls.cap].max(initial=0)
    if bought > spec.largest_ball_mm:
        yield f"a ball of {bought:g} mm above prototype.largest_ball_mm"
    if len(prototype.balls) != spec.k:
        yield f"{len(prototype.balls)} balls, not prototype.k"


def directions(optics: OpticsSpec) -> Floats:
    """(3, 10 n^2 + 2) directions that virtual cameras may have.

    Those of the geodesic polyhedron, their x and y times what the spec says, again as unit vectors.
    """
    return unit(geodesic(optics.n) * np.array([[*optics.stretch, 1.0]]).T)


def geodesic(n: int) -> Floats:
    """(3, 10 n^2 + 2) unit vertices of the geodesic polyhedron.

    Source: DESIGN.md section 2: the icosahedron with vertices (0, +-1, +-phi) and cyclic
    permutations, split by the prime factors of n in ascending order, each time onto the sphere.
    """
    faces = _icosahedron()
    for prime in _primes(n):
        faces = _split(faces, prime)
    points = faces.reshape(-1, 3)
    _, first = np.unique(np.round(points, 9) + 0.0, axis=0, return_index=True)
    return np.ascontiguousarray(points[np.sort(first)].T)


def _deviations(
    mirrors: Mirrors, rows: NDArray[np.intp], camera: Camera, b: float, largest_aim: float
) -> Floats:
    u, p, n, c = (mirrors.columns(key, 3)[:, rows] for key in ("ux", "px", "nx", "cx"))
    radius = mirrors.columns("radius_mm")[0, rows]
    pinhole = camera.pinhole[:, None]
    double_a = 2 * np.sqrt(b**2 + (camera.pinhole @ camera.pinhole) / 4)
    aim = _aims(u, p, n, camera, largest_aim)
    deviations = np.max(
        [
            np.abs(norm(u) - 1),
            np.abs(norm(n) - 1),
            norm(p - dot(p, u) * u),
            np.abs(norm(p) + norm(pinhole - p) - double_a),
            norm(unit(unit(pinhole - p) + unit(aim - p)) - n),
            np.where(mirrors.flat[rows], 0, norm(c - (p - radius * n))),
        ],
        axis=0,
    )
    return np.asarray(deviations)


def _aims(u: Floats, p: Floats, n: Floats, camera: Camera, largest: float) -> Floats:
    """(3, M) points at which mirrors with apices p and normals n may be aimed, mm.

    The origin; for mirrors on the seam the point of the x axis nearest to which the ray over the
    apex comes, as far as it lies on the other camera's side of the seam and up to `largest` away.
    """
    aim, seam = np.zeros_like(p), np.abs(u[0]) < ON_SEAM
    point, away = p[:, seam], -np.sign(camera.pinhole[0])
    ray = reflect_directions(point - camera.pinhole[:, None], n[:, seam])
    squared = dot(ray[1:], ray[1:])
    along = -dot(point[1:], ray[1:]) / np.where(squared > 0, squared, np.inf)
    aim[0, seam] = away * np.clip(away * (point[0] + along * ray[0]), 0.0, largest)
    return aim


def _match_vertices(u: Floats, vertices: Floats) -> tuple[NDArray[np.intp], int]:
    """Directions (3, M) that are no vertex (3, V) of their own, and how many vertices are left."""
    distance, vertex = cKDTree(vertices.T).query(u.T)
    counts = np.bincount(vertex, minlength=vertices.shape[1])
    wrong = (distance > SAME_DIRECTION) | (counts[vertex] > 1)
    return np.flatnonzero(wrong), int((counts == 0).sum())


def _icosahedron() -> Floats:
    phi = (1 + 5**0.5) / 2
    corner = np.array([[0, s, t * phi] for s in (1, -1) for t in (1, -1)])
    points = np.concatenate([np.roll(corner, k, axis=1) for k in range(3)])
    near = np.linalg.norm(points[:, None] - points[None], axis=2) < 2.1
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i)
        for k in range(j)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    return np.asarray(points[np.array(faces)] / np.sqrt(1 + phi**2))


def _primes(n: int) -> list[int]:
    factors, divisor = [], 2
    while n > 1:
        while n % divisor == 0:
            factors.append(divisor)
            n //= divisor
        divisor += 1
    return factors


def _split(faces: Floats, p: int) -> Floats:
    """Each triangle (corner, axis) into p^2, and every vertex onto the sphere."""
    up = [((i, j), (i + 1, j), (i, j + 1)) for i in range(p) for j in range(p - i)]
    down = [((i + 1, j), (i + 1, j + 1), (i, j + 1)) for i in range(p) for j in range(p - i - 1)]
    grid = np.array(up + down, dtype=np.float64)
    weights = np.concatenate([p - grid.sum(axis=2, keepdims=True), grid], axis=2) / p
    points = np.einsum("tcw,fwx->ftcx", weights, faces).reshape(-1, 3, 3)
    return np.asarray(points / np.linalg.norm(points, axis=2, keepdims=True))


def _figures(export: Export, camera: Camera, u: Floats, vertices: Floats) -> Floats:
    """(5, M) half widths, mm, theta_0, theta_1, polar angles and azimuths, rad."""
    b = export.semi_minor_mm
    rho = _radial_distance(camera, b, u)
    theta0 = _half_angles(camera, b, u, vertices)
    width = (_camera_distance(camera, b) - rho) * np.tan(theta0)
    theta1 = np.arctan2(export.target_mm / 2 - width, rho)
    polar, azimuth = polar_and_azimuth(axis_frame(camera.pinhole), u)
    return np.stack([width, theta0, theta1, polar, azimuth])


def _half_angles(camera: Camera, b: float, u: Floats, vertices: Floats) -> Floats:
    """(M,) half angle, at the virtual camera, of the largest cone inside each flat mirror.

    Mirrors are bounded by the tangent planes of the ellipsoid at all vertices. The plane through a
    virtual camera and the line where two tangent planes meet is in the pencil of the two.
    """
    count = min(NEIGHBOURS, vertices.shape[1])
    vertex, *others = np.asarray(cKDTree(vertices.T).query(u.T, k=count)[1]).T
    rho = _radial_distance(camera, b, vertices)
    normal = unit(unit(camera.pinhole[:, None] - rho * vertices) - vertices)
    virtual = _camera_distance(camera, b) * u
    sines = []
    own_height = dot(normal[:, vertex], virtual - rho[vertex] * vertices[:, vertex])
    for other in others:
        height = dot(normal[:, other], virtual - rho[other] * vertices[:, other])
        plane = unit(height * normal[:, vertex] - own_height * normal[:, other])
        sines.append(np.abs(dot(plane, u)))
    return np.asarray(np.arcsin(np.min(sines, axis=0)))


def _camera_distance(camera: Camera, b: float) -> float:
    """Of every virtual camera from the origin, mm: twice the semi-major axis."""
    return float(np.hypot(2 * b, np.linalg.norm(camera.pinhole)))


def _radial_distance(camera: Camera, b: float, u: Floats) -> Floats:
    """(N,) of the ellipsoid from the origin along u (3, N), mm."""
    focal = float(np.linalg.norm(camera.pinhole)) / 2
    return np.asarray(b**2 / (np.hypot(b, focal) - camera.pinhole @ u / 2))
