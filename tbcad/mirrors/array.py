"""The mirrors of both cameras: poses, radii, cells, and the record the files are written from."""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.geometry.ellipsoid import Ellipsoid
from tbcad.geometry.vectors import FLIP_X
from tbcad.mirrors.radii import RadiusProblem, solve_radii
from tbcad.optics import flat
from tbcad.optics.camera import Camera, fitted_camera
from tbcad.optics.cells import Cells, cell_areas, cells_of
from tbcad.optics.geodesic import geodesic
from tbcad.optics.power_diagram import bounded_triangulation
from tbcad.optics.surfaces import Surfaces, planes
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.types import Floats, Ints, Progress


@dataclass(frozen=True)
class MirrorArray:
    """One camera with its m mirrors, as arrays over mirrors in the order of their ids.

    Attributes:
        camera_id: "a" or "b".
        camera: its pinhole, axes and sensor.
        ellipsoid: of this camera.
        u: directions of the virtual cameras, (m, 3).
        theta0: half angle a flat mirror would see, radians, (m,).
        theta1: half angle wanted by eq. 1, radians, (m,).
        half_width: l, mm, (m,).
        polar: polar angle about w, radians, (m,).
        azimuth: azimuth about w, radians, (m,).
        cells: of the reflecting surfaces, coat included.
        modelled_cells: of the modelled surfaces, under the coat.
        area: of the cells, mm^2, (m,).
        coverage: exact coverage diameter, mm, (m,).
    """

    camera_id: str
    camera: Camera
    ellipsoid: Ellipsoid
    u: Floats
    theta0: Floats
    theta1: Floats
    half_width: Floats
    polar: Floats
    azimuth: Floats
    cells: Cells
    modelled_cells: Cells
    area: Floats
    coverage: Floats

    def __len__(self) -> int:
        return len(self.u)

    def __repr__(self) -> str:
        """Return camera, number of mirrors and minimum coverage."""
        minimum = self.coverage.min()
        return (
            f"<MirrorArray of camera {self.camera_id}: {len(self)} mirrors, "
            f"minimum coverage {minimum:.2f} mm>"
        )

    @property
    def ids(self) -> list[str]:
        """Names of the mirrors: a0001, a0002 ...; b's mirror of the same number mirrors it."""
        return [f"{self.camera_id}{i + 1:04d}" for i in range(len(self))]

    @property
    def mirrors(self) -> Surfaces:
        """The reflecting surfaces, coat included."""
        every = self.cells.surfaces
        m = len(self)
        return Surfaces(every.apex[:m], every.normal[:m], every.curvature[:m])

    @property
    def foot(self) -> float:
        """Height z of the foot plane, mm."""
        return float(self.cells.surfaces.apex[self.cells.boundary.foot, 2])

    def mirrored(self) -> "MirrorArray":
        """The other camera's half."""
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
    """The spec and the two halves that follow from it."""

    spec: Spec
    halves: tuple[MirrorArray, MirrorArray]


def design(spec: Spec, progress: Progress = lambda _: None) -> MirrorDesign:
    """Poses, radii and cells of all mirrors.

    Raises:
        SpecError: when the spec's mirrors cannot be made; it names them.
    """
    half = _half_a(spec, progress)
    return MirrorDesign(spec, (half, half.mirrored()))


def numbering_order(u: Floats) -> Ints:
    """Order of the mirrors' numbers: from the zenith down, then by azimuth about z."""
    height = np.round(u[:, 2], 9)
    turn = np.round(np.arctan2(u[:, 1], u[:, 0]), 9)
    return np.lexsort((turn, -height))


def numbered_directions(n: int) -> tuple[Floats, Ints]:
    """All geodesic directions, camera a's first in the order of their ids, and all faces."""
    u, faces = geodesic(n)
    mine = (u[:, 0] >= 0) & (u[:, 2] >= 0)
    first = np.flatnonzero(mine)[numbering_order(u[mine])]
    order = np.concatenate([first, np.flatnonzero(~mine)])
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return u[order], place[faces]


def _half_a(spec: Spec, progress: Progress) -> MirrorArray:
    optics = spec.optics
    ellipsoid = Ellipsoid(np.array(optics.camera_mm), optics.semi_minor_mm)
    every, faces = numbered_directions(optics.n)
    kept = (every[:, 0] >= 0) & (every[:, 2] >= 0)
    u = every[kept]
    theta0 = flat.half_angles(ellipsoid, u, every)
    half_width = flat.half_widths(ellipsoid, u, theta0)
    theta1 = flat.required_angles(ellipsoid, u, half_width, optics.capture_diameter_mm / 2)
    # The equatorial mirrors stay whole: the foot plane lies the greatest half width below them.
    foot = -float(half_width[u[:, 2] == 0].max())
    triangles, boundary = bounded_triangulation(faces, every, kept)
    task = RadiusProblem(
        mirrors=Surfaces(
            ellipsoid.apices(u),
            ellipsoid.normals(u),
            flat.paper_curvatures(theta0, theta1, half_width),
        ),
        planes=planes(np.array([[0, 0, 0], [0, 0, foot]]), np.array([[1, 0, 0], [0, 0, 1]])),
        boundary=boundary,
        triangles=triangles,
        pinhole=ellipsoid.pinhole,
        least=1 / (spec.mirrors.max_radius_widths * half_width),
        target=optics.capture_diameter_mm + spec.mirrors.margin_mm,
    )
    cells, covered = solve_radii(spec.mirrors.radius_rule, task, progress)
    polar, azimuth = ellipsoid.polar_azimuth(u)
    camera = spec.camera
    return MirrorArray(
        camera_id="a",
        camera=fitted_camera(
            ellipsoid.pinhole,
            cells.corners,
            camera.width_px,
            camera.height_px,
            float(np.radians(camera.hfov_deg)),
        ),
        ellipsoid=ellipsoid,
        u=u,
        theta0=theta0,
        theta1=theta1,
        half_width=half_width,
        polar=polar,
        azimuth=azimuth,
        cells=cells,
        modelled_cells=_under_coat(cells, spec.mirrors.coating_um / 1000),
        area=cell_areas(cells),
        coverage=covered,
    )


def _under_coat(cells: Cells, coating: float) -> Cells:
    """Cells of the surfaces that a coat of this thickness (mm) turns into the reflecting ones."""
    if coating == 0:
        return cells
    m = cells.mirrors
    every = cells.surfaces
    mirrors = Surfaces(every.apex[:m], every.normal[:m], every.curvature[:m])
    if np.any(mirrors.curvature * coating >= 1):
        raise SpecError(
            f"mirrors.coating_um {coating * 1000:g} is more than the least mirror radius "
            f"{np.nanmin(mirrors.radius):.3g} mm: make the coat thinner"
        )
    bounds = Surfaces(every.apex[m:], every.normal[m:], every.curvature[m:])
    body = mirrors.offset(-coating).joined(bounds)
    return cells_of(body, cells.boundary, cells.triangles)
