"""What the two halves of a mirror on the seam show of the object, with and without their aim."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tbcad.geometry.vectors import unit
from tbcad.mirrors.seam import cut_images, seam_gaps
from tbcad.optics.cells import Cells, cells_of
from tbcad.optics.pedestals.cells import PedestalCells
from tbcad.optics.surfaces import Surfaces
from tbcad.simulate.scene.exported import ExportedDesign
from tbcad.simulate.scene.reflector import Reflector
from tbcad.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SAMPLES = 401


def seam_mirror(export: ExportedDesign) -> int:
    """Camera a's mirror on the seam whose halves would leave the widest gap without their aim."""
    reflector = export.reflectors[0]
    gaps = seam_gaps(
        cells_aimed_at_origin(reflector), reflector.camera.pinhole, export.capture_mm / 2
    )
    return int(gaps.argmax())


def draw_fields(axes: "Sequence[Axes]", export: ExportedDesign, mirror: int) -> None:
    """Draw both fields: halves aimed at the object's centre, and as they are."""
    reflector = export.reflectors[0]
    before, after = cells_aimed_at_origin(reflector), reflector.cells
    for one, cells, title in zip(
        axes,
        (before, after),
        ("aimed at the object's centre", "as built, aimed beyond the seam"),
        strict=True,
    ):
        _draw(one, cells, reflector, mirror, export.capture_mm / 2)
        one.set_title(f"Halves {title}", fontsize=10)


def cells_aimed_at_origin(reflector: Reflector) -> Cells:
    """Cells of the same apices and radii, each ray to an apex sent on to the origin."""
    cells, mirrors = reflector.cells, reflector.mirrors
    normal = unit(unit(reflector.camera.pinhole - mirrors.apex) + unit(-mirrors.apex))
    turned = Surfaces(mirrors.apex, normal, mirrors.curvature)
    if isinstance(cells, PedestalCells):
        return cells.with_mirrors(turned)
    return cells_of(
        turned.joined(cells.surfaces.subset(slice(cells.mirrors, None))), cells.triangles
    )


def _draw(axes: "Axes", cells: Cells, reflector: Reflector, mirror: int, radius: float) -> None:
    along = np.linspace(-radius, radius, SAMPLES)
    edge = edge_of_field(cells, reflector, mirror, along)
    rim = np.sqrt(np.maximum(radius**2 - along**2, 0))
    left, right = np.maximum(-rim, np.minimum(edge, rim)), rim
    axes.fill_betweenx(along, left, right, color="C0", alpha=0.45, lw=0, label="half a")
    axes.fill_betweenx(along, -right, -left, color="C1", alpha=0.45, lw=0, label="half b")
    axes.plot(radius * np.cos(_turn()), radius * np.sin(_turn()), color="k", lw=1)
    inside = rim > 0
    widest, least = 2 * edge[inside].max(), -2 * edge[inside].max()
    said = (
        f"neither sees up to {widest:.2f} mm" if widest > 0 else f"both see {least:.2f} mm or more"
    )
    axes.text(0, -1.12 * radius, said, ha="center", va="top", fontsize=10)
    axes.set_xlim(-1.15 * radius, 1.15 * radius)
    axes.set_ylim(-1.35 * radius, 1.15 * radius)
    axes.set_aspect("equal")
    axes.set_xlabel("x at the object, mm")
    axes.set_ylabel("along the seam, mm")
    axes.legend(loc="upper right", fontsize=8, frameon=False)


def _turn() -> Floats:
    return np.linspace(0, 2 * np.pi, SAMPLES)


def edge_of_field(cells: Cells, reflector: Reflector, mirror: int, along: Floats) -> Floats:
    """Least x that half a shows at places along the seam, mm."""
    number, x, place = cut_images(cells, reflector.camera.pinhole)
    own = number == mirror
    place, x = place[own].ravel(), x[own].ravel()
    order = place.argsort()
    return np.asarray(np.interp(along, place[order], x[order]))
