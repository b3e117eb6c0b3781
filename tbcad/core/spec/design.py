"""The design spec: what a user may choose, in named units, checked before anything is computed.

Every key, its unit, range, default and explanation stand here once; `tbcad init`, `tbcad explain`
and the site tell them. The defaults are the design of the paper, `designs/turtleback.toml`.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BeforeValidator, Field, model_validator

from tbcad.core.spec.prototype import CapMaking, PrototypeSpec
from tbcad.core.spec.section import AUTO, OR_AUTO, Entries, OrWord, Section, as_tuple, whole
from tbcad.core.spec.sizes import OpticsSpec, with_sizes

_Side: TypeAlias = Annotated[float, Field(ge=20, le=2000)]
Bed: TypeAlias = Annotated[
    tuple[_Side, _Side, _Side],
    BeforeValidator(as_tuple),
    Entries(("width", "depth", "height")),
]
_HOLE_EDGE_MM = 1.0  # material that must stay on either side of a hole in a flange
FIT: Any = "fit"  # value of camera.hfov_deg that follows from the mirrors
MAX_HFOV = 170  # degrees
EdgeKind: TypeAlias = Literal["valley", "pedestal"]
RadiusRule: TypeAlias = Literal["traced", "paper", "flat"]
MAX_MARGIN = 20.0
MAX_MESH_ERROR_MM = 0.5  # of what the verification recovers mirrors from
MAX_MIRRORS = 50_000  # of one camera: more than n = 60 has
Margin: TypeAlias = Annotated[float, Field(ge=0, le=MAX_MARGIN)]
# Cured standard resins 1.15 to 1.2 g/cm^3 (data sheets); EN AW-6061 2.70 (EN 573-3).
CAP_DENSITIES: dict[CapMaking, float] = {"printed": 1.18, "turned": 2.70, "none": 0.0}


class PrinterSpec(Section):
    """The printer and its material, for all printed parts of the prototype."""

    bed_mm: Bed = (256.0, 256.0, 256.0)
    """Width, depth and height of what the printer can make."""
    bed_margin_mm: float = Field(3.0, ge=0, le=50)
    """Width of the bed's border that stays free, also below the printer's full height."""
    density_g_cm3: float = Field(1.27, gt=0, le=20)
    """Density of the printed material (PETG 1.27, PLA 1.24, PA12 1.01)."""
    modulus_gpa: float = Field(2.0, gt=0, le=300)
    """Young's modulus of the printed material where it is solid (PETG 2.0, PLA 3.0, PA12 1.7), for
    how far the base sags under its weight."""
    infill: float = Field(0.25, ge=0.05, le=1)
    """Share of material inside the walls."""
    nozzle_mm: float = 0.6
    """Diameter of the nozzle, 0.4 or 0.6: 0.6 prints layers of 0.3 mm and takes 60 % of the hours;
    for the estimates of filament and time."""

    @model_validator(mode="after")
    def _nozzle_has_settings(self) -> Self:
        if self.nozzle_mm not in (0.4, 0.6):
            raise ValueError(f"nozzle_mm is {self.nozzle_mm:g}, but estimates know 0.4 and 0.6")
        return self


class CameraSpec(Section):
    """The sensor and lens of both cameras."""

    width_px: int = Field(2080, ge=16, le=32_768)
    """Columns of the sensor."""
    height_px: int = Field(1552, ge=16, le=32_768)
    """Rows of the sensor."""
    hfov_deg: Annotated[float, OrWord(FIT)] = Field(FIT, ge=1, le=MAX_HFOV)
    """Angle of view across the columns; fit: the smallest whole number of degrees that leaves a
    border of 2 % round the mirrors, 89 for the paper's design; more for a smaller n."""


class MirrorsSpec(Section):
    """How the mirrors are curved."""

    radius_rule: RadiusRule = "traced"
    """How mirrors get their radii. traced: by exact ray tracing, as large as possible for
    seeing the whole capture sphere; paper: by eqs. 1 and 2 of the paper, which are paraxial and
    see about 51 mm of 60; flat: planar mirrors."""
    margin_mm: float = Field(0.6, ge=0, le=MAX_MARGIN)
    """Coverage that rule traced adds to the capture diameter, for errors of manufacture and
    mounting."""
    own_margins_mm: Annotated[tuple[Margin, ...], BeforeValidator(as_tuple)] = Field(
        (), max_length=MAX_MIRRORS
    )
    """The same for each mirror, in the order of one camera's, none below margin_mm; empty: every
    mirror has margin_mm. tbcad build --process computes them."""
    max_radius_widths: float = Field(30.0, ge=5, le=1000)
    """Largest radius in half widths l of the mirror; one that needs less curvature than this
    gets this radius, nearly flat, and sees more than it must."""
    coating_um: float = Field(0.0, ge=0, le=500)
    """Thickness of the reflecting coat; the modelled sphere is smaller by it, so that the
    coated one has the right radius."""

    @model_validator(mode="after")
    def _own_margins_fit(self) -> Self:
        least = min(self.own_margins_mm, default=self.margin_mm)
        if least < self.margin_mm:
            raise ValueError(
                f"own_margins_mm has a margin of {least:g}, less than margin_mm "
                f"{self.margin_mm:g}, which every mirror has at least: make margin_mm smaller or "
                "leave own_margins_mm out"
            )
        return self


class FlangeSpec(Section):
    """A flange with its bolt and dowel holes."""

    width_mm: float = Field(12.0, ge=4, le=100)
    """How far the flange stands out."""
    thickness_mm: float = Field(5.0, ge=1, le=50)
    """Thickness of the plate."""
    bolt_hole_mm: float = Field(4.3, ge=1, le=30)
    """Diameter of the bolts' clearance holes: 4.3 for M4. It leaves 1 mm of the width on either
    side."""
    bolts: int = Field(6, ge=2, le=60)
    """Number of bolt holes."""
    dowel_hole_mm: float = Field(4.0, ge=1, le=30)
    """Diameter of the dowel pins' holes, with the same 1 mm on either side."""
    dowels: int = Field(2, ge=0, le=10)
    """Number of dowel holes."""

    @model_validator(mode="after")
    def _holes_fit(self) -> Self:
        largest = self.width_mm - 2 * _HOLE_EDGE_MM
        for key in ("bolt_hole_mm", "dowel_hole_mm"):
            if (hole := getattr(self, key)) > largest:
                raise ValueError(
                    f"{key} {hole:g} does not fit in width_mm {self.width_mm:g}, which leaves room "
                    f"for {largest:g}: make the hole smaller or the flange wider"
                )
        return self


class FootFlangeSpec(FlangeSpec):
    """The flange that carries the shell on its base plate."""

    bolts: int = Field(5, ge=2, le=60)
    """Number of bolt holes."""


class ShellLampsSpec(Section):
    """A ring of LEDs on each camera's lens: the mirrors throw their light onto the object."""

    leds: Annotated[int, OR_AUTO] = Field(AUTO, ge=0, le=8)
    """LEDs on each ring; 0: no lamps; auto: 6, or 0 where rings have no room, would light unevenly,
    or would dazzle: in capture spheres of less than 40 mm."""
    lens_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=20, le=200)
    """Diameter of the lens's barrel that a ring is clamped on; auto: that of the prototype's camera
    (prototype.frame.camera), or 60 where none is known."""
    front_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=-100, le=100)
    """Distance of the ring's face before the pinhole; auto: that of the lens's front, and so near
    that the camera does not see the ring."""


class ShellSpec(Section):
    """The body behind the mirrors, and the edges between them."""

    wall_mm: float = Field(3.0, ge=0.4, le=50)
    """Material behind the deepest valley or groove between mirrors."""
    edges: EdgeKind = "valley"
    """Where mirrors end. valley: where neighbouring spheres meet, without step or groove, but
    an edge moves where either of its two mirrors is off; pedestal: each mirror stands on a
    pedestal with straight walls, and a groove parts it from its neighbours: errors cost less
    than a third, the grooves some of the pixels."""
    groove_mm: float = Field(0.1, ge=0.02, le=5)
    """Width of the grooves between pedestals at the mirrors' corners; they are four times as
    deep. Without pedestals unused."""
    negative: bool = False
    """Whether to write the negative of each shell's mirrors too: mandrel_a and mandrel_b, solids
    with concave mirrors on which a shell is electroformed."""
    seam_flange: FlangeSpec = FlangeSpec()
    """Joins the two halves at x = 0."""
    foot_flange: FootFlangeSpec = FootFlangeSpec()
    """Joins a half to the base plate."""
    lamps: ShellLampsSpec = ShellLampsSpec()
    """Lights the object through the mirrors."""


class MeshSpec(Section):
    """How fine the STL and 3MF are."""

    ray_error_mm: float = Field(0.05, ge=0.01, le=1)
    """How far a ray off a facet at a mirror's rim may miss, at the capture sphere, the ray off
    the exact sphere: a facet reflects like a flat mirror."""
    chord_error_mm: float = Field(0.015, ge=0.0002, le=1)
    """Distance of a mirror's facets from its sphere; the stricter of this and ray_error_mm
    counts."""
    structure_error_mm: float = Field(0.02, ge=0.002, le=5)
    """Distance of all other facets (back, flanges, holes) from the exact surface."""

    @model_validator(mode="after")
    def _fine_enough(self) -> Self:
        for key in ("chord_error_mm", "structure_error_mm"):
            if (error := getattr(self, key)) > MAX_MESH_ERROR_MM:
                raise ValueError(
                    f"{key} {error:g} is too coarse to tell mirrors from their mesh: make it "
                    f"{MAX_MESH_ERROR_MM:g} or less"
                )
        return self


class StepSpec(Section):
    """How the STEP is written."""

    pcurves: bool = False
    """Write the curves in the surfaces' parameters too, which some old programs need: files
    grow about eightfold."""


class Spec(Section):
    """A whole design: every key with its value, checked and frozen."""

    name: str = Field("turtleback", pattern="^[A-Za-z0-9][A-Za-z0-9 ._-]{0,79}$")
    """Name of the design, for file headers and reports."""
    schema_version: Annotated[Literal[2], BeforeValidator(whole)] = Field(2, alias="schema")
    """Version of this table's keys."""
    optics: OpticsSpec = OpticsSpec()
    camera: CameraSpec = CameraSpec()
    mirrors: MirrorsSpec = MirrorsSpec()
    shell: ShellSpec = ShellSpec()
    mesh: MeshSpec = MeshSpec()
    step: StepSpec = StepSpec()
    printer: PrinterSpec = PrinterSpec()
    prototype: PrototypeSpec = PrototypeSpec()

    @property
    def cap_density_g_cm3(self) -> float:
        """Density of what caps are made of."""
        return CAP_DENSITIES[self.prototype.caps]

    def __repr__(self) -> str:
        return f"<Spec {self.name!r}: n = {self.optics.n}>"

    __str__ = __repr__

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        _check_capture_sphere(self.optics)
        # Not an assignment: the design is frozen from here on.
        self.__dict__["prototype"] = with_sizes(self.prototype, self.optics)
        if self.mesh.structure_error_mm > self.shell.wall_mm / 2:
            raise ValueError(
                f"mesh.structure_error_mm {self.mesh.structure_error_mm:g} is more than half of "
                f"shell.wall_mm {self.shell.wall_mm:g}: make it {self.shell.wall_mm / 2:g} or less"
            )
        return self


def spec_with(spec: Spec, **sections: dict[str, object]) -> Spec:
    """The spec with other values of some keys, by section; they are not checked.

    Margins of single mirrors belong to the mirrors of the spec: another n, size or margin has none.
    """
    mirrors = sections.get("mirrors", {})
    if "optics" in sections or "margin_mm" in mirrors:
        sections["mirrors"] = {"own_margins_mm": ()} | mirrors
    changed = {name: getattr(spec, name).model_copy(update=keys) for name, keys in sections.items()}
    return spec.model_copy(update=changed)


def without_sections(spec: Spec, *names: str) -> Spec:
    """The spec without some sections, for work that may not follow from them: None in their place.

    Work that reads one fails, instead of being taken for independent of it.
    """
    return spec.model_copy(update=dict.fromkeys(names))


def _check_capture_sphere(optics: OpticsSpec) -> None:
    radius, to_pinhole = optics.capture_diameter_mm / 2, math.hypot(*optics.camera_mm)
    if radius >= to_pinhole:
        raise ValueError(
            f"optics.camera_mm is inside the capture sphere: bring it more than {radius:g} mm "
            "from the origin or make optics.capture_diameter_mm smaller"
        )
    c = to_pinhole / 2
    nearest = math.hypot(optics.semi_minor_mm, c) - c  # of the ellipsoid to its focus
    if radius >= nearest:
        raise ValueError(
            f"the capture sphere of {radius:.4g} mm radius does not fit inside the ellipsoid, "
            f"which comes to {nearest:.4g} mm of the origin: make optics.semi_minor_mm more than "
            f"{math.sqrt(radius**2 + 2 * radius * c):.4g} or optics.capture_diameter_mm less than "
            f"{2 * nearest:.4g}"
        )
