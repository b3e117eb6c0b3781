"""Filament and hours of a print, by sections of its mesh: what a slicer counts, without its paths.

A print is cut into groups of layers as thick as its solid skin, one section standing for each.
Areas give the filament. They give the lengths of lines as well, since lines lie a spacing apart;
the number of lines in a region is its area over spacing and mean chord, pi area / perimeter
(Cauchy; Santalo 1976, Integral Geometry and Geometric Probability, I.3). Lines that end cost the
time to brake and to start again. Speeds and all else are read from the slicer's own settings.
"""

from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold, Mesh64

from tbcad.cad.kernel.mesh import Mesh
from tbcad.types import Floats

NOTHING = CrossSection()
SMALL_LOOP_MM = 2 * np.pi * 6.5  # loops that are no longer have a speed of their own (slicer's)
HOPS = 3  # travels for each contour of a layer: walls, solid layers and infill begin anew
HOP_S = 0.5  # of it: 0.05 retracted, 0.1 lifted, the rest for 10 mm from rest to rest, seconds
THIN = 1.2  # of a line's width: half of what is too narrow on a slope to get solid layers
SUPPORT_MARGIN_MM = 2.4  # of supports round what they hold: 1.5 and most of half a grid's step
FOOT_MM, FOOT_DENSITY = 3.0, 0.9  # how far the first layer of supports reaches out, and its density
NOISE_MM = 0.005  # corners of a section that are no farther from a side do not count
THIN_HANG_MM = 0.02  # an overhang of less is the noise of sections
BRIDGED = 0.9  # share of an overhang that is between its anchors where it is a bridge
FLAT = 0.5  # share of a flat overhang that is wider than a step of a slope
MIN_BEAD = 0.85  # of the nozzle's diameter: width of the narrowest line (slicer's)
OVERLAP = 0.25  # of infill with walls, of a line's width
HOUR_S = 3600.0


@dataclass(frozen=True)
class PrintSettings:
    """Settings of a slicer by name, mm and seconds."""

    values: dict[str, float]

    def __getitem__(self, name: str) -> float:
        return self.values[name]

    @property
    def layer(self) -> float:
        """Height of a layer, mm."""
        return self["layer_height"]

    def spacing(self, width: float) -> float:
        """From one line to the next, mm: lines have round sides, and these overlap."""
        return width - self.layer * (1 - np.pi / 4)

    @property
    def line(self) -> float:
        """The same for walls, solid layers and infill."""
        return self.spacing(self["extrusion_width"])

    @property
    def depth(self) -> float:
        """Thickness of the walls, mm."""
        return self["extrusion_width"] / 2 + (self["perimeters"] - 0.5) * self.line

    def speed(self, name: str) -> float:
        """A speed, mm/s, as the filament's flow permits it."""
        flow = self["filament_max_volumetric_speed"] / (self.layer * self.line)
        return min(self[f"{name}_speed"], flow)


@cache
def print_settings(nozzle_mm: float) -> PrintSettings:
    """The settings for a nozzle of 0.4 or 0.6 mm."""
    text = files(__package__).joinpath(f"slicer/nozzle_{nozzle_mm:g}.ini").read_text("utf-8")
    pairs = [line.split(" = ") for line in text.splitlines() if not line.startswith("#")]
    return PrintSettings({key: float(word.rstrip("%")) for key, word in pairs if _is_number(word)})


def _is_number(word: str) -> bool:
    return word.rstrip("%").replace(".", "", 1).isdigit()


@dataclass(frozen=True)
class _Group:
    """A section of the layers that it stands for, and those of the groups below and above."""

    section: CrossSection
    core: CrossSection  # of it, within the walls
    around: tuple[CrossSection, CrossSection]  # cores below and above
    support: CrossSection
    interface: CrossSection  # of supports, dense
    bottom: bool  # whether it lies on the bed


def print_estimate(mesh: Mesh, infill: float, nozzle_mm: float) -> tuple[float, float]:
    """Filament (mm^3), supports included, and hours, to print a mesh that stands on the bed."""
    use = print_settings(nozzle_mm)
    low, high = (float(end) for end in (mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()))
    layers = max(round((high - low) / use.layer), 1)
    count = -int(-layers // use["top_solid_layers"])
    each = layers / count
    body = Manifold(Mesh64(mesh.vertices, mesh.triangles.astype(np.uint64)))
    middles = np.floor((np.arange(count) + 0.5) * each) + 0.5
    sections = [body.slice(low + at * use.layer).simplify(NOISE_MM) for at in middles]
    groups = _groups(sections, use, each)
    printed = np.array([_print_group(group, use, infill, each) for group in groups])
    volume, seconds = printed.sum(axis=0) * each
    return float(volume), float(seconds / HOUR_S)


def _groups(sections: list[CrossSection], use: PrintSettings, each: float) -> list[_Group]:
    cores = [_offset(one, -use.depth) for one in sections]
    supports = _supports(sections, use, each)
    below, above = [NOTHING, *cores[:-1]], [*cores[1:], NOTHING]
    return [
        _Group(*parts, index == 0)
        for index, parts in enumerate(
            zip(sections, cores, zip(below, above, strict=True), *supports, strict=True)
        )
    ]


def _supports(
    sections: list[CrossSection], use: PrintSettings, each: float
) -> tuple[list[CrossSection], list[CrossSection]]:
    """Supports, on the build plate only, and their interfaces below what they hold."""
    reach = each * use.layer / np.tan(np.radians(use["support_material_threshold"]))
    gap = use["support_material_xy_spacing"] / 100 * use["extrusion_width"]
    below = [NOTHING]
    for section in sections[:-1]:
        below.append(below[-1] + section)
    supports, interfaces, column = [NOTHING], [NOTHING], NOTHING
    for upper, lower, shadow in list(zip(sections[1:], sections, below[1:], strict=False))[::-1]:
        hang = _unbridged(_opened(upper - _offset(lower, reach), THIN_HANG_MM), lower, reach)
        held = _offset(_offset(hang, reach) ^ (upper - lower), SUPPORT_MARGIN_MM) - shadow
        column = (column + held) - _offset(lower, gap)
        supports.append(column)
        interfaces.append(held)
    return supports[::-1], interfaces[::-1]


def _unbridged(hang: CrossSection, lower: CrossSection, reach: float) -> CrossSection:
    """An overhang without bridges: pieces that lie between their anchors on the section below."""
    for piece in hang.decompose():
        anchors = _offset(piece, 2 * reach) ^ lower
        flat = _opened(piece, reach).area() > FLAT * piece.area()  # not a step of a slope
        if flat and (piece ^ anchors.hull()).area() > BRIDGED * piece.area():
            hang -= piece
    return hang


def _print_group(
    group: _Group, use: PrintSettings, infill: float, each: float
) -> tuple[float, float]:
    """Filament (mm^3) and seconds of a layer of a group, in the mean."""
    rings = [np.asarray(ring) for ring in group.section.to_polygons()]
    area, core = group.section.area(), group.core.area()
    thick = 0.0 if core > 0 else 2 * area / max(_length(group.section), 1e-9)
    walls = _walls(rings, (area - core) / max(use.line, _bead(thick, use)), use)
    inside, seconds = _inside(group, core, use, infill, each)
    held, supporting = _supported(group, use, each)
    hops = HOPS * len(rings) + group.support.num_contour()
    seconds += walls + supporting + hops * HOP_S
    if group.bottom:
        slowly = area / use.line / use["first_layer_speed"]
        seconds += max(slowly - seconds, 0.0) / each
    filled = area - core + inside + held
    slowest = filled / max(use.line, _bead(thick, use)) / use["min_print_speed"]
    shortest = min(use["slowdown_below_layer_time"], slowest)
    return use.layer * filled, max(seconds, shortest)


def _bead(thick: float, use: PrintSettings) -> float:
    """Distance of the lines in a thin wall: as many as are not too narrow, mm."""
    return thick / max(thick // (MIN_BEAD * use["nozzle_diameter"]), 1.0)


def _walls(rings: list[Floats], length: float, use: PrintSettings) -> float:
    """Seconds for the walls of a layer, of lines of a length in all."""
    if not rings:
        return 0.0
    edges = [np.roll(ring, -1, axis=0) - ring for ring in rings]
    around = np.array([np.hypot(*edge.T).sum() for edge in edges])
    turns = np.sign([_area(ring) for ring in rings])
    inward = use.line * (np.arange(use["perimeters"]) + 0.5)
    loops = np.maximum(around[:, None] - 2 * np.pi * turns[:, None] * inward, 0.0)
    outer = min(float(loops[:, 0].sum()), length)
    inner = length - outer
    small = min(float(np.where(loops < SMALL_LOOP_MM, loops, 0.0)[:, 1:].sum()), inner)
    fast, slow = use.speed("perimeter"), use.speed("external_perimeter")
    seconds = outer / slow + (inner - small) / fast + small / use.speed("small_perimeter")
    corners = [_corners(edges, speed, use) for speed in (slow, fast)]
    return seconds + corners[0] + corners[1] * (inner / outer if outer > 1 else 0.0)


def _corners(edges: list[Floats], speed: float, use: PrintSettings) -> float:
    """Seconds that one line round a layer loses to brake in its corners and to start again."""
    lost = 0.0
    for edge in edges:
        along = edge / np.maximum(np.hypot(*edge.T), 1e-9)[:, None]
        turn = np.abs(along - np.roll(along, 1, axis=0)).max(axis=1)
        corner = np.minimum(speed, use["machine_max_jerk_x"] / np.maximum(turn, 1e-9))
        lost += float(((speed - corner) ** 2).sum()) / (use["perimeter_acceleration"] * speed)
    return lost


def _inside(
    group: _Group, core: float, use: PrintSettings, infill: float, each: float
) -> tuple[float, float]:
    """Fill of a layer within its walls, mm^2, and its seconds: solid layers and infill."""
    if core <= 0:
        return 0.0, 0.0
    share, thin = use["top_solid_layers"] / each, THIN * use["extrusion_width"]
    covered, hidden = group.core ^ group.around[1], group.core ^ group.around[0]
    skin = _opened(group.core - (covered ^ hidden), thin)
    solid = min(core, share * skin.area())
    up = min(solid, share * _opened(group.core - covered, thin).area())
    sparse, edge, border = core - solid, _length(group.core), _length(skin)
    first = 1 / use["top_solid_layers"]
    over_air = 0.0 if group.bottom else first * (solid - up)
    bridges = min(first * up * (sparse > 0 or not group.bottom) + over_air, solid - first * up)
    seconds = _lines(sparse * infill, edge * infill, use.speed("infill"), use, use.line / infill)
    for area, speed in (
        (first * up, "top_solid_infill"),
        (bridges, "bridge"),
        (solid - first * up - bridges, "solid_infill"),
    ):
        around = border * area / solid if solid else 0.0
        seconds += _lines(area, around, use.speed(speed), use, use.line)
    overlap = 1 + OVERLAP * use["extrusion_width"] * edge / core
    return (solid + infill * sparse) * overlap, seconds


def _supported(group: _Group, use: PrintSettings, each: float) -> tuple[float, float]:
    """Support of a layer in the mean, mm^2, and its seconds."""
    whole = group.support.area()
    if whole <= 0:
        return 0.0, 0.0
    line = use.spacing(use["support_material_extrusion_width"])
    layers = min(1.0, use["support_material_interface_layers"] / each)
    dense = min(whole, group.interface.area() * layers)
    pitch, close = use["support_material_spacing"], use["support_material_interface_spacing"]
    speed, seconds, held = use["support_material_speed"], 0.0, 0.0
    border = _length(group.support)
    slower = use["support_material_interface_speed"] / 100 * speed
    for part, pace, step in ((whole - dense, speed, pitch), (dense, slower, close)):
        density, around = line / (line + step), border * part / whole
        held += part * density
        seconds += _lines(part * density, around * density, pace, use, line + step, line)
    if group.bottom:
        foot = (FOOT_DENSITY * _offset(group.support, FOOT_MM).area() - held) / each
        held += foot
        seconds += foot / line / use["first_layer_speed"]
    return held, seconds


def _lines(
    area: float, border: float, speed: float, use: PrintSettings, step: float, line: float = 0.0
) -> float:
    """Seconds for parallel lines a step apart that cover an area (mm^2) with this border (mm)."""
    if min(area, border) <= 1e-9:
        return 0.0
    brake, jerk = use["infill_acceleration"], use["machine_max_jerk_x"]
    chord = np.pi * area / border
    turn = 2 * (np.sqrt(jerk**2 + brake * step) - jerk) / brake  # along the border to the next
    slow = chord / speed + (speed - jerk) ** 2 / (brake * speed)
    along = slow if chord > speed**2 / brake else 2 * np.sqrt(chord / brake)
    return float(area / (line or use.line) / chord * (turn + along))


def _offset(section: CrossSection, distance: float) -> CrossSection:
    return section.offset(distance, JoinType.Miter, 2.0)


def _opened(section: CrossSection, distance: float) -> CrossSection:
    """A section without what is thinner than twice a distance."""
    return _offset(_offset(section, -distance), distance)


def _length(section: CrossSection) -> float:
    rings = (np.asarray(ring) for ring in section.to_polygons())
    return float(sum(np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).sum() for ring in rings))


def _area(ring: Floats) -> float:
    x, y = ring.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2
