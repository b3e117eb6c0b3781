"""Edges and seam of the mirrors close up: the facets of a build, and what follows from them.

Run as a program, `python -m tbcad.report.close_ups DIR edges|seam FILE`: see `shell_pictures`.
"""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyvista

from tbcad.common.figure_files import figure_file
from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import mirror_ids
from tbcad.core.optics.cells import Cells, cells_of
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.optics.windows import cut_images, seam_gaps
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, read_export
from tbcad.report.shell_pictures import EdgeSection, coloured, section_of
from tbcad.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SAMPLES = 401
INCHES = (13.0, 5.2)
VIEW_PX = (900, 720)
SHOWN_MM, SHOWN_APEXES = 9.0, 1.6  # about a mirror: this, or so many distances of its neighbours
ASIDE = 0.9  # of the sight from the camera, so that light rakes over the edges
ELEVATION_Z = 0.7  # z of the direction of the mirror whose edges are shown
FILL = 0.45  # brightness of the light from straight above
STRETCH = 4.0  # of heights in the section of three mirrors
INSET_MM = 0.9  # half width of the edge in its own scale


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
    drawn = {
        "aimed at the object's centre": cells_aimed_at_origin(reflector),
        "as built, aimed beyond the seam": reflector.cells,
    }
    for one, (title, cells) in zip(axes, drawn.items(), strict=True):
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
    turn = np.linspace(0, 2 * np.pi, SAMPLES)
    axes.plot(radius * np.cos(turn), radius * np.sin(turn), color="k", lw=1)
    inside = rim > 0
    widest, least = 2 * edge[inside].max(), -2 * edge[inside].max()
    said = (
        f"neither sees up to {widest:.2f} mm" if widest > 0 else f"both see {least:.2f} mm or more"
    )
    axes.text(0, -1.12 * radius, said, ha="center", va="top", fontsize=10)
    limits = {"xlim": (-1.15 * radius, 1.15 * radius), "ylim": (-1.35 * radius, 1.15 * radius)}
    axes.set(**limits, xlabel="x at the object, mm", ylabel="along the seam, mm", aspect="equal")
    axes.legend(loc="upper right", fontsize=8, frameon=False)


def edge_of_field(cells: Cells, reflector: Reflector, mirror: int, along: Floats) -> Floats:
    """Least x that half a shows at places along the seam, mm."""
    number, x, place = cut_images(cells, reflector.camera.pinhole)
    own = number == mirror
    place, x = place[own].ravel(), x[own].ravel()
    order = place.argsort()
    return np.asarray(np.interp(along, place[order], x[order]))


def draw(folder: Path, subject: str, picture: Path) -> None:
    """Draw a subject of a build, "edges" or "seam", to a PNG file."""
    export = read_export(folder)
    panels = SUBJECTS[subject](export)
    picture.write_bytes(figure_file(panels, INCHES))


def _edges(export: ExportedDesign) -> "Callable[[Figure], None]":
    reflector = export.reflectors[0]
    ahead = np.sqrt(1 - ELEVATION_Z**2), 0, ELEVATION_Z
    section = section_of(export, int((reflector.u @ ahead).argmax()))
    view = _shaded(export.folder, "a", reflector, section.mirrors[1])
    title = "Valleys: spheres meet"
    if export.spec.shell.edges != "valley":
        title = f"Pedestals: grooves of {export.spec.shell.groove_mm:g} mm part the mirrors"

    def panels(figure: "Figure") -> None:
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.25))
        _show(left, view, title)
        _draw_section(right, section, mirror_ids("a", len(reflector)))

    return panels


def _seam(export: ExportedDesign) -> "Callable[[Figure], None]":
    reflector = export.reflectors[0]
    mirror = seam_mirror(export)
    view = _shaded(export.folder, "ab", reflector, mirror)

    def panels(figure: "Figure") -> None:
        left, *fields = figure.subplots(1, 3, width_ratios=(1.1, 1, 1))
        name = mirror_ids("", len(reflector))[mirror]
        _show(left, view, f"Both halves of mirror {name}, from the object")
        left.axvline(VIEW_PX[0] / 2, color="white", ls=":", lw=1.2)
        left.text(VIEW_PX[0] / 2 + 8, VIEW_PX[1] - 12, "seam", color="white", fontsize=9)
        draw_fields(fields, export, mirror)

    return panels


def _show(axes: "Axes", view: Floats, title: str) -> None:
    axes.imshow(view)
    axes.set_axis_off()
    axes.set_title(title, fontsize=10)


def _shaded(folder: Path, cameras: str, reflector: Reflector, mirror: int) -> Floats:
    """Facets about a mirror, (h, w, 3); both halves from the object, one half from the side."""
    apex, normal = reflector.mirrors.apex[mirror], reflector.mirrors.normal[mirror]
    distance = np.sort(np.linalg.norm(reflector.mirrors.apex - apex, axis=1))[1]
    reach = min(SHOWN_MM, SHOWN_APEXES * distance)
    raking = unit(np.cross(normal, [1.0, 0.0, 0.0] if len(cameras) > 1 else [0.0, 1.0, 0.0]))
    # In the seam's plane, which is a straight line then; or from the side, for relief.
    sight = unit(normal * [0, 1, 1]) if len(cameras) > 1 else unit(normal - ASIDE * raking)
    plotter = pyvista.Plotter(off_screen=True, window_size=VIEW_PX, lighting="none")
    plotter.set_background("white")
    for camera in cameras:
        shell = coloured(folder, camera)
        near = np.linalg.norm(shell.cell_centers().points - apex, axis=1) < 3 * reach
        plotter.add_mesh(shell.extract_cells(near), scalars="colour", rgb=True, specular=0.2)
    for place, intensity in ((normal + 2.2 * raking, 1.0), (normal, FILL)):
        light = pyvista.Light(position=apex + 100 * place, focal_point=apex, intensity=intensity)
        plotter.add_light(light)
    up = raking if len(cameras) > 1 else unit(np.cross([0.0, 1.0, 0.0], sight))
    plotter.camera_position = [tuple(apex + 100 * sight), tuple(apex), tuple(up)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = reach
    plotter.reset_camera_clipping_range()
    pixels = np.asarray(plotter.screenshot(None, return_img=True))
    plotter.close()
    return pixels


def _draw_section(axes: "Axes", section: EdgeSection, ids: list[str]) -> None:
    low = section.points[:, 1].min()
    _draw_outline(axes, section.points, low - 0.3)
    for mirror, place in zip(section.mirrors, section.apexes, strict=True):
        axes.annotate(ids[mirror], place, (0, 6), textcoords="offset points", ha="center")
    for edge, side in zip(section.edges, ("right", "left"), strict=True):
        axes.annotate(
            f"{edge.depth:.2f} mm below the crests\n{edge.words}",
            tuple(edge.bottom),
            (25 if side == "right" else -25, -30),
            textcoords="offset points",
            ha=side,
            va="top",
            fontsize=9,
            arrowprops={"arrowstyle": "-", "lw": 0.7},
        )
    axes.set(xlabel="along the section, mm", ylabel=f"height, mm ({STRETCH:g} times stretched)")
    axes.set(aspect=STRETCH, ylim=(low - 1.1, section.points[:, 1].max() + 1.9))
    axes.set_title("Section of three mirrors through the camera's pinhole", fontsize=10)
    _draw_inset(axes, section)


def _draw_outline(axes: "Axes", points: Floats, low: float) -> None:
    """The outline, and the solid below it down to a height; walls may lean over."""
    axes.plot(*points.T, color="C0", lw=1.5)
    below = np.array([[points[-1, 0], low], [points[0, 0], low]])
    axes.fill(*np.concatenate([points, below]).T, color="0.9", lw=0)


def _draw_inset(axes: "Axes", section: EdgeSection) -> None:
    x, y = section.edges[1].bottom
    inset = axes.inset_axes((0.3, 0.66, 0.4, 0.32))
    _draw_outline(inset, section.points, y - 2)
    inset.set(xlim=(x - INSET_MM, x + INSET_MM), ylim=(y - 0.15, y + 0.85), aspect="equal")
    inset.tick_params(labelsize=7)
    inset.set_title("the right edge, not stretched", fontsize=8)


SUBJECTS = {"edges": _edges, "seam": _seam}

if __name__ == "__main__":
    draw(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
