"""The mirrors of both cameras, from the spec: directions, poses, radii, cells, passing light."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tbcad.common.reuse import kept
from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.geometry.vectors import FLIP_X, dot, norm
from tbcad.core.mirrors.radii import (
    RadiusProblem,
    half_angles,
    half_widths,
    paper_curvatures,
    required_angles,
    solve_radii,
)
from tbcad.core.optics.camera import Camera, fitted_camera, fitting_view_angle_deg
from tbcad.core.optics.cells import Cells, cell_areas, cells_of
from tbcad.core.optics.geodesic import geodesic, stretched
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import NotRegularError, bounded_triangulation
from tbcad.core.optics.reflection import miss_distances
from tbcad.core.optics.surfaces import Surfaces, planes
from tbcad.core.optics.windows import (
    cell_sides,
    minima_by_mirror,
    parabola_minima,
    samples_about_minima,
)
from tbcad.core.spec.design import (
    FIT,
    MAX_HFOV,
    CameraSpec,
    MirrorsSpec,
    Spec,
    without_sections,
)
from tbcad.core.spec.errors import SpecError
from tbcad.types import Bools, Floats, Ints, Progress

# Light in use ends at a share of the way from the apex to the edge of the cell, found to 2^-16 of
# it: micrometres on a cell of a hand's width.
BISECTIONS = 16
ROUNDS = 2  # after two rounds the samples are a 32nd of the side apart; a parabola does the rest


def closest_passage(cells: Cells, pinhole: Floats, capture: float) -> tuple[float, int]:
    """Smallest distance (mm) from the origin at which light passes, and its mirror.

    Light is in use where its mirror shows the capture sphere of a radius (mm). If it passes closer,
    the object stands in it. Apices show the origin, and in the picture a mirror's part in use does
    not contain it, so what passes closest is at the edge of that part: where rays graze the capture
    sphere, or at the edge of the cell.
    """
    mirror, arc = cell_sides(cells)

    def passing(point: Floats) -> Floats:
        return passing_distances(pinhole, point)

    def in_use(edge: Floats) -> Floats:
        mirrors = np.broadcast_to(mirror[:, None], edge.shape[:-1])
        return passing(_last_in_use(cells, mirrors, edge, pinhole, capture))

    # An apex is in use: a mirror all of whose cell is farther off than one needs no closer look.
    at_edge = minima_by_mirror(mirror, _minima(cells, arc, passing), cells.mirrors)
    enough = max(passing(cells.mirror_surfaces.apex).min(), at_edge.min())
    close = at_edge[mirror] <= enough
    mirror, arc = mirror[close], arc[close]
    distance = _minima(cells, arc, in_use)
    return float(distance.min()), int(mirror[distance.argmin()])


def passing_distances(pinhole: Floats, point: Floats) -> Floats:
    """Distances (...) from the origin of straight ways from a pinhole to points (..., 3), mm."""
    ray = point - pinhole
    share = np.clip(-(ray @ pinhole) / dot(ray, ray), 0, 1)
    return norm(pinhole + share[..., None] * ray)


def _minima(cells: Cells, arc: Ints, function: Callable[[Floats], Floats]) -> Floats:
    """Smallest value (k,) on each arc (k,) of a function of points (k, s, 3)."""

    def values(t: Floats) -> Floats:
        return function(cells.arcs.at(np.broadcast_to(arc[:, None], t.shape), t))

    return parabola_minima(samples_about_minima(values, len(arc), ROUNDS))


def _last_in_use(
    cells: Cells, mirror: Ints, edge: Floats, pinhole: Floats, capture: float
) -> Floats:
    """Points (..., 3) on mirrors (...) where light in use ends from the apex toward an edge."""
    apex = cells.surfaces.apex[mirror]
    low, high = np.zeros(mirror.shape), np.ones(mirror.shape)
    for _ in range(BISECTIONS):
        share = (low + high) / 2
        point = _seen_at(cells, mirror, apex + share[..., None] * (edge - apex), pinhole)
        normal = cells.surfaces.gradient(mirror, point)
        used = miss_distances(pinhole, point, normal) <= capture
        low, high = np.where(used, share, low), np.where(used, high, share)
    return _seen_at(cells, mirror, apex + low[..., None] * (edge - apex), pinhole)


def _seen_at(cells: Cells, mirror: Ints, chord: Floats, pinhole: Floats) -> Floats:
    """Points (..., 3) on mirrors (...) that a pinhole sees in line with points of their chords."""
    ray = chord - pinhole
    return pinhole + cells.surfaces.first_reach(mirror, pinhole, ray)[..., None] * ray


DIRECTION_DIGITS = 9  # directions that differ by less than rounding have equal heights or azimuths
HFOV_DIGITS = 12
UNSTRETCHED = (1.0, 1.0)
STEPS_PER_MM = 10  # of a size that an error names


def mirror_ids(camera_id: str, mirrors: int) -> list[str]:
    """Names of a camera's mirrors: a0001, a0002 ..."""
    return [f"{camera_id}{i + 1:04d}" for i in range(mirrors)]


@dataclass(frozen=True)
class MirrorArray:
    """One camera with its m mirrors, as arrays over mirrors in the order of their ids.

    A virtual camera is at u times ellipsoid.camera_distance, a mirror's apex on the line to it.
    """

    camera_id: str  # "a" or "b"
    camera: Camera  # its pinhole, axes and sensor
    ellipsoid: Ellipsoid  # that the mirrors are tangent to; foci are the origin and the pinhole
    u: Floats  # unit vectors from the origin to the virtual cameras, (m, 3)
    theta0: Floats  # half angle seen in the flat mirror, radians, (m,) (section 3.2 of the paper)
    theta1: Floats  # half angle that holds the whole capture sphere, radians, (m,) (eq. 1)
    half_width: Floats  # of the flat mirror, the paper's l, mm, (m,)
    polar: Floats  # angle of u from the ellipsoid's axis, radians, (m,)
    azimuth: Floats  # of u about the axis from the side of the zenith, radians, (m,)
    cells: Cells  # of the reflecting surfaces, with the coat
    modelled_cells: Cells  # of the modelled surfaces, under the coat
    area: Floats  # of the cells, mm^2, (m,)
    coverage: Floats  # coverage diameter by exact rays, mm, (m,) (optics.windows)

    def __len__(self) -> int:
        return len(self.u)

    def __repr__(self) -> str:
        minimum = self.coverage.min()
        return (
            f"<MirrorArray of camera {self.camera_id}: {len(self)} mirrors, "
            f"minimum coverage {minimum:.2f} mm>"
        )

    @property
    def ids(self) -> list[str]:
        """Names of the mirrors: a0001, a0002 ...; b0001 is the mirror image of a0001."""
        return mirror_ids(self.camera_id, len(self))

    @property
    def mirrors(self) -> Surfaces:
        """The reflecting surfaces, with the coat, over m of them."""
        return self.cells.mirror_surfaces

    @property
    def apex_distance(self) -> Floats:
        """Distance rho of each apex from the origin, mm, (m,)."""
        return self.ellipsoid.radial_distance(self.u)

    @property
    def foot(self) -> float:
        """Height z of the foot plane, mm."""
        return float(self.cells.surfaces.apex[self.cells.foot, 2])

    def mirrored(self) -> "MirrorArray":
        """Camera b's mirrors: the mirror image in the plane x = 0."""
        return replace(
            self,
            camera_id="b",
            camera=self.camera.mirrored(),
            ellipsoid=Ellipsoid(self.ellipsoid.pinhole * FLIP_X, self.ellipsoid.semi_minor),
            u=self.u * FLIP_X,
            azimuth=-self.azimuth,
            cells=self.cells.mirrored(),
            modelled_cells=self.modelled_cells.mirrored(),
        )


@dataclass(frozen=True)
class MirrorDesign:
    """The mirrors of both cameras."""

    spec: Spec  # that they follow from, with the angle of view that was chosen
    arrays: tuple[MirrorArray, MirrorArray]  # camera a's mirrors (x >= 0) and camera b's (x <= 0)

    @property
    def a(self) -> MirrorArray:
        """Camera a's mirrors."""
        return self.arrays[0]

    @property
    def b(self) -> MirrorArray:
        """Camera b's mirrors."""
        return self.arrays[1]


def design(spec: Spec, progress: Progress = lambda _: None) -> MirrorDesign:
    """Directions, poses, radii and cells of all mirrors (section 3 of the paper); or SpecError."""
    array = _half_a(without_sections(spec, "prototype", "printer"), progress)
    _check_clearance(spec, array)
    hfov = round(float(np.degrees(array.camera.hfov)), HFOV_DIGITS)
    camera = spec.camera.model_copy(update={"hfov_deg": hfov})
    return MirrorDesign(spec.model_copy(update={"camera": camera}), (array, array.mirrored()))


def numbering_order(u: Floats) -> Ints:
    """Order (m,) of directions (m, 3) by mirror number: from the zenith down, then by azimuth."""
    height = np.round(u[:, 2], DIRECTION_DIGITS)
    azimuth = np.round(np.arctan2(u[:, 1], u[:, 0]), DIRECTION_DIGITS)
    return np.lexsort((azimuth, -height))


def numbered_directions(n: int, stretch: tuple[float, float] = UNSTRETCHED) -> tuple[Floats, Ints]:
    """Directions and faces of a geodesic polyhedron of frequency n, stretched along x and y.

    Unit vectors (10 n^2 + 2, 3), those of camera a's mirrors in the order of their ids, and the
    outward triangles over them, (20 n^2, 3).
    """
    vertices, faces = geodesic(n)
    u = stretched(vertices, *stretch)
    in_half_a = _in_half_a(u)
    first = np.flatnonzero(in_half_a)[numbering_order(u[in_half_a])]
    order = np.concatenate([first, np.flatnonzero(~in_half_a)])
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    return u[order], number[faces]


def _in_half_a(u: Floats) -> Bools:
    """Whether a direction is one of camera a's: on its side of the seam, and not below."""
    return np.asarray((u[:, 0] >= 0) & (u[:, 2] >= 0))


@kept("mirrors", heard=True)
def _half_a(spec: Spec, progress: Progress) -> MirrorArray:
    optics = spec.optics
    ellipsoid = Ellipsoid(np.array(optics.camera_mm), optics.semi_minor_mm)
    every, faces = numbered_directions(optics.n, optics.stretch)
    u = every[_in_half_a(every)]
    theta0 = half_angles(ellipsoid, u, every)
    half_width = half_widths(ellipsoid, u, theta0)
    theta1 = required_angles(ellipsoid, u, half_width, optics.capture_diameter_mm / 2)
    problem = RadiusProblem(
        mirrors=Surfaces(
            ellipsoid.apices(u),
            ellipsoid.normals(u),
            paper_curvatures(theta0, theta1, half_width),
        ),
        planes=_bounding_planes(u, half_width),
        triangles=bounded_triangulation(faces, every, _in_half_a(every)),
        pinhole=ellipsoid.pinhole,
        min_curvature=1 / (spec.mirrors.max_radius_widths * half_width),
        diameter=optics.capture_diameter_mm,
        margin=mirror_margins(spec.mirrors, len(u)),
        groove=spec.shell.groove_mm if spec.shell.edges == "pedestal" else None,
    )
    # Radii take long: no frame holds the mirrors if none holds their apices.
    _view_angle_deg(spec.camera, ellipsoid.pinhole, problem.mirrors.apex)
    cells, coverage = solve_radii(spec.mirrors.radius_rule, problem, progress)
    polar, azimuth = ellipsoid.polar_azimuth(u)
    return MirrorArray(
        camera_id="a",
        camera=_camera(spec.camera, ellipsoid.pinhole, cells.corners),
        ellipsoid=ellipsoid,
        u=u,
        theta0=theta0,
        theta1=theta1,
        half_width=half_width,
        polar=polar,
        azimuth=azimuth,
        cells=cells,
        modelled_cells=_cells_under_coat(cells, spec.mirrors.coating_um / 1000),
        area=cell_areas(cells),
        coverage=coverage,
    )


def mirror_margins(spec: MirrorsSpec, mirrors: int) -> Floats:
    """Margin of each of m mirrors of a camera, mm, (m,); SpecError if there are more or fewer."""
    own = np.array(spec.own_margins_mm)
    if len(own) not in (0, mirrors):
        raise SpecError(
            f"mirrors.own_margins_mm has {len(own)} margins, but a camera has {mirrors} mirrors: "
            "leave them out by --set mirrors.own_margins_mm=[], or compute others by --process"
        )
    return own if len(own) else np.full(mirrors, spec.margin_mm)


def _camera(sensor: CameraSpec, pinhole: Floats, corners: Floats) -> Camera:
    hfov = np.radians(_view_angle_deg(sensor, pinhole, corners))
    return fitted_camera(pinhole, corners, sensor.width_px, sensor.height_px, float(hfov))


def _view_angle_deg(sensor: CameraSpec, pinhole: Floats, points: Floats) -> float:
    """The spec's angle of view, or the smallest that holds points (k, 3), mm; or SpecError."""
    if sensor.hfov_deg != FIT:
        return float(sensor.hfov_deg)
    hfov = fitting_view_angle_deg(pinhole, points, sensor.width_px, sensor.height_px)
    if hfov > MAX_HFOV:
        raise SpecError(
            f"no lens takes in all mirrors: camera.hfov_deg would have to be {hfov:.0f}, allowed "
            f"is up to {MAX_HFOV:g}: bring optics.camera_mm farther from the origin, or make "
            "optics.semi_minor_mm smaller"
        )
    return hfov


def _bounding_planes(u: Floats, half_width: Floats) -> Surfaces:
    """The seam x = 0 and the foot plane, so low that the equatorial mirrors stay whole."""
    foot = -float(half_width[u[:, 2] == 0].max())
    return planes(np.array([[0, 0, 0], [0, 0, foot]]), np.array([[1, 0, 0], [0, 0, 1]]))


def _cells_under_coat(cells: Cells, coating: float) -> Cells:
    """Cells of the surfaces that a coat of this thickness (mm) turns into the reflecting ones."""
    if coating == 0:
        return cells
    mirrors = cells.mirror_surfaces
    if np.any(mirrors.curvature * coating >= 1):
        raise SpecError(
            f"mirrors.coating_um {coating * 1000:g} is more than the smallest mirror radius "
            f"{np.nanmin(mirrors.radius):.3g} mm: make the coat thinner"
        )
    if isinstance(cells, PedestalCells):
        try:
            return replace(cells.with_mirrors(mirrors.offset(-coating)), coat=coating)
        except NotRegularError:
            raise SpecError(
                f"mirrors.coating_um {coating * 1000:g} is more than the grooves between pedestals "
                "are deep: make the coat thinner or shell.groove_mm larger"
            ) from None
    modelled = mirrors.offset(-coating).joined(cells.surfaces.subset(slice(cells.mirrors, None)))
    return replace(cells_of(modelled, cells.triangles), coat=coating)


def _check_clearance(spec: Spec, array: MirrorArray) -> None:
    """Refuse a design whose object stands between its mirrors and the camera.

    SpecError names the mirror, and a capture sphere that the light passes. Of a smaller sphere less
    light is in use, so that none passes closer than now.
    """
    diameter = spec.optics.capture_diameter_mm
    distance, mirror = closest_passage(array.cells, array.ellipsoid.pinhole, diameter / 2)
    if distance >= diameter / 2:
        return
    raise SpecError(
        f"the object stands in its own light: on the way from mirror {array.ids[mirror]} to the "
        f"camera light passes {distance:.4g} mm from the object's centre, closer than the capture "
        f"sphere's radius of {diameter / 2:.4g} mm: make optics.capture_diameter_mm "
        f"{math.floor(2 * distance * STEPS_PER_MM) / STEPS_PER_MM:g} or less, make "
        "optics.semi_minor_mm larger, or bring optics.camera_mm farther away"
    )
