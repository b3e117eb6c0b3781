"""The sheet of a shell or its negative: sections, holes, datums, where its mirrors are listed."""

from collections.abc import Iterator

from tbcad.cad.drafting.dimensions import across, upward
from tbcad.cad.drafting.sheet import A3, Sheet, TitleBlock, drawing_room, table
from tbcad.cad.formats.entities import Entity
from tbcad.cad.formats.step import read_named_solid
from tbcad.drawings.export import DrawnExport
from tbcad.drawings.shell_views import HOLE_HEAD, HOLE_WIDTHS_MM, ShellViews, shell_views
from tbcad.drawings.tables import mm
from tbcad.records.design import MandrelRecord

BETWEEN_MM, AROUND_MM, LENGTH_MM = 36.0, 20.0, 10.0  # between views, round them; of dimensions


def draw_shell(export: DrawnExport, name: str) -> list[Sheet]:
    """The sheet of a shell or a negative. InputError: its file is not as it was written."""
    step = f"{name}.step"
    block = TitleBlock(
        title=name.replace("_", " "),
        design=export.title,
        item=name,
        quantity=1,
        material="by process",
        tolerances="of tbcad order",
    )
    left, _, right, _ = drawing_room(A3)
    shape = read_named_solid(export.file(step)).shape
    shown = shell_views({"": shape}, right - left, BETWEEN_MM, AROUND_MM)
    x, y = shown.beside
    drawn = [
        *shown.entities(),
        *table((x + BETWEEN_MM, y), HOLE_WIDTHS_MM, [HOLE_HEAD, *shown.rows]),
        *_lengths(shown),
    ]
    front = shown.views[0]
    words = (*_notes(export, name), *export.source(step))
    return [Sheet.framed((name, name), block, A3, front.scale, front.origin, drawn, words)]


def _notes(export: DrawnExport, name: str) -> tuple[str, ...]:
    spec, camera = export.design.spec, name[-1]
    shell = spec.shell
    for record in export.design.mandrels:
        if record.name == name:
            coat = spec.mirrors.coating_um
            return (
                f"Negative of shell_{camera}. Concave mirrors, of the same names: centres and "
                "radii, the",
                f"latter with the coat of {coat:g} um, in mirrors.csv (camera {camera}).",
                _release(record),
                "x = 0 and z = foot flat; blind holes. Datums: A foot, B seam, C dowel hole.",
            )
    foot, seam = shell.foot_flange, shell.seam_flange
    return (
        f"Wall {shell.wall_mm:g} mm behind the deepest valley of the mirrors. Foot flange "
        f"{foot.thickness_mm:g} x {foot.width_mm:g},",
        f"seam flange {seam.thickness_mm:g} x {seam.width_mm:g} mm, holes through. Holes of "
        f"{foot.dowel_hole_mm:g} mm are H7, for dowels.",
        f"Mirrors, polished and coated: mirrors.csv (camera {camera}), limits by tbcad order.",
        "x, y, z from O, the centre of the capture sphere. Datums: A foot, B seam, C dowel hole.",
    )


def _release(record: MandrelRecord) -> str:
    if record.draft_deg < 0:
        return "Undercut: the shell cannot be drawn off; dissolve the mandrel, or melt it out."
    pull = " ".join(f"{one + 0.0:.3f}" for one in record.pull)
    return f"The shell is drawn along ({pull}), draft {record.draft_deg:.1f} degrees."


def _lengths(shown: ShellViews) -> Iterator[Entity]:
    """Overall sizes: x and z of the section y = 0, y of the foot."""
    low, high = shown.box
    (left, bottom), (right, top) = (shown.views[0].at(corner) for corner in (low, high))
    yield across((left, top), (right, top), top + LENGTH_MM, mm(float(high[0] - low[0])))
    yield upward((right, bottom), (right, top), right + LENGTH_MM, mm(float(high[2] - low[2])))
    (_, bottom), (right, top) = (shown.views[1].at(corner) for corner in (low, high))
    yield upward((right, bottom), (right, top), right + LENGTH_MM, mm(float(high[1] - low[1])))
