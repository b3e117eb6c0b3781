"""What a build would give, within seconds and before there is any solid.

Figures of mirrors and balls are those of the build. Masses of printed parts, printing and money are
estimates: see the constants.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import volume
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import MeshSpec, Spec
from tbcad.core.spec.errors import SpecError
from tbcad.output.parts import PARTS, PROTOTYPE, SHELL
from tbcad.prototype.arrangement import PrototypeModel, arrange
from tbcad.prototype.drive.balance import ball_masses, cap_volume
from tbcad.prototype.files.bom import PRINT_MATERIAL, ball_rows, by_currency
from tbcad.prototype.purchased.parts import load_prices
from tbcad.shell.halves import camera_a_mesh, check_mirrors, design_mandrel
from tbcad.types import Progress

# Hours of printing for a cubic centimetre of solid volume, and filament, supports included, as a
# share of it: what PrusaSlicer 2.5 says of the paper's prototype with the settings of the parts
# list's estimates (tbcad.prototype.slicing), by the nozzle's diameter.
HOURS_PER_CM3, FILLED = {0.4: 0.080, 0.6: 0.043}, 0.84
# Coarser than a design may ask for.
COARSE = MeshSpec().model_copy(
    update={"ray_error_mm": 10.0, "chord_error_mm": 1.0, "structure_error_mm": 0.5}
)
MM3_PER_CM3 = 1000.0


@dataclass(frozen=True)
class PrintEstimate:
    """An estimate of what is printed."""

    volume_cm3: float  # of the solids
    mass_g: float  # of the filament
    hours: float  # on an FDM printer
    # of the filament by the spec's list of prices, by currency; empty without one
    price: dict[str, float]


@dataclass(frozen=True)
class PrototypeOverview:
    """A prototype before its solids."""

    balls: int  # bought, number
    caps: int  # to be made, number
    stops: int  # number
    swing_deg: float  # of the base
    minimum_coverage_mm: float  # diameter that every mirror's ball shows
    kept_share: float  # of the shell's pixels
    ball_mass_g: float  # of the bought balls
    ball_price: dict[str, float]  # of the bought balls, by currency
    turning_mass_g: float  # of all that turns with the base
    motor: str  # part of the drive
    prints: PrintEstimate  # carrier, caps, stage and frame, without the coupon


@dataclass(frozen=True)
class Overview:
    """What a build would give."""

    spec: Spec  # the design's, with a value for every key that is chosen
    mirrors: int  # number, of both cameras
    virtual_cameras: int  # number; mirrors halved by the seam make one together
    radius_mm: tuple[float, float] | None  # minimum and maximum; None with planar mirrors
    minimum_coverage_mm: float  # diameter that every mirror shows
    view_angle_deg: float  # of the cameras' lenses, across the columns
    shell_prints: PrintEstimate | None  # both halves; None without shells
    prototype: PrototypeOverview | None  # None without one
    note: str  # why the prototype is left out; empty when it is not


def overview(
    design: MirrorDesign,
    parts: Sequence[str] = PARTS,
    progress: Progress = lambda _: None,
    *,
    optional_prototype: bool = False,
) -> Overview:
    """Return what a build of a design would give; arguments and errors as of `write_export`."""
    array, note, arrangement = design.arrays[0], "", None
    if PROTOTYPE in parts:
        progress("prototype: balls, their places, stops")
        try:
            arrangement = arrange(design)
        except SpecError as error:
            if not optional_prototype:
                raise
            note = f"no prototype: {error}"
    radius = array.mirrors.radius
    planar = bool(np.isnan(radius).any())
    return Overview(
        spec=arrangement.spec if arrangement else design.spec,
        mirrors=2 * len(array),
        virtual_cameras=2 * len(array) - int((array.u[:, 0] == 0).sum()),
        radius_mm=None if planar else (float(radius.min()), float(radius.max())),
        minimum_coverage_mm=float(array.coverage.min()),
        view_angle_deg=design.spec.camera.hfov_deg,
        shell_prints=_shells(design) if SHELL in parts else None,
        prototype=_prototype(arrangement) if arrangement else None,
        note=note,
    )


def _shells(design: MirrorDesign) -> PrintEstimate:
    if design.spec.shell.negative:
        design_mandrel(design)  # refuses holes that do not fit
    check_mirrors(design)
    spec = design.spec.model_copy(update={"mesh": COARSE})
    mesh = camera_a_mesh(MirrorDesign(spec, design.arrays))
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    return _print_estimate(2 * float(np.einsum("tx,tx->", a, np.cross(b, c))) / 6, design.spec)


def _prototype(arrangement: PrototypeModel) -> PrototypeOverview:
    layout, balls = arrangement.layout, arrangement.layout.balls
    return PrototypeOverview(
        balls=int((~balls.cap).sum()),
        caps=int(balls.cap.sum()),
        stops=len(layout.stops.angle),
        swing_deg=float(np.degrees(layout.placement.swing)),
        minimum_coverage_mm=float(layout.fit.coverage.min()),
        kept_share=layout.fit.kept_share,
        ball_mass_g=layout.mass_g,
        ball_price=by_currency(ball_rows(layout, load_prices(arrangement.spec.prototype.prices))),
        turning_mass_g=arrangement.balance.mass_g,
        motor=arrangement.drive.motor.name,
        prints=_print_estimate(_printed_volume(arrangement), arrangement.spec),
    )


def _printed_volume(arrangement: PrototypeModel) -> float:
    """Volume of carrier, caps, stage and frame, mm^3."""
    spec, layout = arrangement.spec, arrangement.layout
    turning = arrangement.balance.mass_g - float(ball_masses(layout).mass_g.sum())
    caps = float(cap_volume(layout.balls).sum()) if spec.prototype.caps == "printed" else 0.0
    static = (*arrangement.stage.components, *arrangement.frame.printed)
    # As if the bodies of a component did not overlap.
    solid = (sum(map(volume, one.added)) - sum(map(volume, one.removed)) for one in static)
    carrier = turning / spec.printer.density_g_cm3 * MM3_PER_CM3
    return carrier + caps + sum(max(one, 0.0) for one in solid)


def _print_estimate(volume_mm3: float, spec: Spec) -> PrintEstimate:
    volume_cm3 = volume_mm3 / MM3_PER_CM3
    mass = volume_cm3 * FILLED * spec.printer.density_g_cm3
    price = load_prices(spec.prototype.prices).of(PRINT_MATERIAL, mass)
    money = {price.currency: price.amount} if price else {}
    hours = volume_cm3 * HOURS_PER_CM3[spec.printer.nozzle_mm]
    return PrintEstimate(volume_cm3, mass, hours, money)
