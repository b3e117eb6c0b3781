"""prototype.json of a prototype that is built: each section from what it describes."""

from fnmatch import fnmatchcase

import numpy as np

from tbcad.cad.drafting.sheet import Sheet
from tbcad.cad.formats.checked_files import Row
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.arrangement import PrototypeModel
from tbcad.prototype.base.caps import cap_limits, holding
from tbcad.prototype.drive.balance import BaseBalance, stop_sequence, travel_ends
from tbcad.prototype.drive.drive import (
    HOLD_MARGIN,
    MAX_RISE_K,
    MAX_WIND_UP_DEG,
    Drive,
    base_torques,
    drive_loads,
)
from tbcad.prototype.drive.power_off import power_off
from tbcad.prototype.electronics import Wiring, phases
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.files.bom import totals
from tbcad.prototype.frame.camera_gauge import CameraGauge, marks_seen
from tbcad.prototype.frame.camera_mount import CameraMount
from tbcad.prototype.frame.stock import Stock
from tbcad.prototype.homing import HomingLayout
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.light.shroud import ShroudLayout
from tbcad.prototype.light.upper import TOLERANCE_MM, WIRES_MM, UpperLamps
from tbcad.prototype.printed import PrintedPart
from tbcad.prototype.stage.layout import led_poses
from tbcad.prototype.stage.leds import calibration_estimate
from tbcad.records import prototype as records
from tbcad.records.prototype import MATT_BLACK, Prototype
from tbcad.records.prototype_drive import (
    CardPanel,
    Controller,
    DriveRecord,
    Home,
    LampPlace,
    LampsRecord,
    ShroudRecord,
    UpperLampsRecord,
    UpperLed,
)

STEP, GLB, BALLS_FILE = "prototype.step", "prototype.glb", "balls.csv"
PAD_UM = 10.0  # largest error of a ball's centre, found from its pads
# Fasteners that are bought black, so that the camera does not see them shine.
BLACK_KINDS = frozenset({"screws", "setscrews", "washers", "nuts", "tnuts"})
# Purchased bodies; the others, which the camera sees between the balls, are painted or taped.
NOT_BLACKENED = ("bearing_*", "camera", "lamp_[0-9]")


def prototype_record(built: PrototypeModel, bill: list[Row], drawings: list[Sheet]) -> Prototype:
    """Record of the prototype, without its steps of assembly."""
    layout, spec, frame = built.layout, built.spec.prototype, built.frame
    homing, stock, leds = frame.of(HomingLayout), frame.of(Stock), len(built.stage.leds)
    angles = homing.angles
    axis, zero, third = (layout.array.ellipsoid.frame() + 0.0).tolist()
    return Prototype(
        camera="a",
        target_mm=built.spec.optics.capture_diameter_mm,
        picture=spec.picture,
        target_pad_um=PAD_UM,
        frame=records.BaseFrame(axis=axis, zero=zero, third=third),
        swing_deg=_swing(built, spec.motion),
        balls=BALLS_FILE,
        alternatives=layout.alternatives,
        seats=_seats(built),
        holding=holding(built.base, layout, built.parts),
        parts=tuple(map(part_record, built.printed)),
        leds=tuple(
            records.Led(name=name, position_mm=(place + 0.0).tolist(), direction=way.tolist())
            for name, place, way in led_poses(built.stage)
        ),
        calibration=_calibration(built),
        controller=Controller(
            firmware=spec.motion.controller,
            board=frame.of(Wiring).board.name,
            axis=spec.motion.axis,
            phases=phases(leds, spec.motion),
        ),
        caps=cap_limits(built.spec, built.base, layout),
        camera_place=_camera_place(built),
        home=Home(
            switch_deg=angles.switch,
            homed_deg=angles.homed,
            travel_deg=angles.travel,
            pin=homing.pin,
            zero_error_deg=homing.error_deg,
        ),
        bought=tuple(
            records.PurchasedBody(
                name=item.name,
                what=item.what,
                part=item.part,
                turns=item.rotates,
                finish=_body_finish(item.name),
            )
            for item in frame.purchased
        ),
        lamps=_lamps(frame.find(LampLayout), frame.find(UpperLamps)),
        shroud=_shroud(built.shroud),
        fasteners=tuple(map(_fastener, built.fasteners)),
        frame_stock=records.FrameStock(
            plate=stock.plate.name, upright=stock.upright.name, uprights_cut_to_mm=stock.length
        ),
        totals=records.ListTotals(**totals(bill)),
        drawings=tuple(
            records.DrawingFiles(part=one.part, pdf=f"{one.name}.pdf", dxf=f"{one.name}.dxf")
            for one in drawings
        ),
        assembly=records.AssemblyFiles(step=STEP, glb=GLB),
        drive=drive_record(built.balance, built.drive, spec.motion, layout.stops.range),
        power_off=power_off(built.drive, built.balance, travel_ends(layout, spec.motion)),
    )


def _body_finish(name: str) -> str | None:
    return None if any(fnmatchcase(name, one) for one in NOT_BLACKENED) else MATT_BLACK


def drive_record(
    balance: BaseBalance, drive: Drive, motion: MotionSpec, swing: tuple[float, float]
) -> DriveRecord:
    """Loads of the drive over a swing (radians), with their limits."""
    torques = base_torques(balance, swing, motion)
    loads = drive_loads(drive, torques)
    return DriveRecord(
        mass_g=balance.mass_g,
        centre_mm=(balance.centre + 0.0).tolist(),
        moment_g_mm=balance.moment,
        azimuth_deg=float(np.degrees(balance.azimuth)),
        inertia_g_mm2=balance.inertia,
        worst_torque_nmm=torques.gravity,
        peak_torque_nmm=torques.peak,
        safety=motion.safety,
        required_torque_nmm=torques.required,
        holding_torque_nmm=drive.holds_nmm,
        drive=drive.name,
        motor=drive.motor.name,
        ratio=drive.ratio,
        steps_per_deg=drive.steps_per_deg(motion.microsteps),
        motor_wind_up_deg=float(np.degrees(loads.motor_wind_up)),
        belt_wind_up_deg=float(np.degrees(loads.belt_wind_up)),
        wind_up_limit_deg=MAX_WIND_UP_DEG,
        belt_centre_mm=drive.centre_mm,
        teeth_in_mesh=loads.teeth_in_mesh,
        belt_pull_n=loads.belt_pull,
        belt_rating_n=loads.belt_rating,
        belt_tension_n=loads.belt_tension,
        belt_tone_hz=loads.belt_tone,
        motor_radial_n=loads.motor_radial,
        motor_radial_limit_n=loads.motor_radial_limit,
        hold_margin=0.0 if loads.self_locking else HOLD_MARGIN,
        hold_current_a=loads.hold_current,
        hold_loss_w=loads.hold_loss,
        motor_rise_k=loads.motor_rise,
        motor_rise_limit_k=MAX_RISE_K,
    )


def _swing(built: PrototypeModel, motion: MotionSpec) -> tuple[float, float]:
    """Base angles that the program drives between: from the switch, or from the start."""
    todo = stop_sequence(built.layout, motion)
    angles = [todo.start, motion.home_deg, *todo.angle.tolist()]
    if motion.homes:
        angles.append(built.frame.of(HomingLayout).angles.switch)
    return min(angles), max(angles)


def _seats(built: PrototypeModel) -> tuple[records.SeatRecord, ...]:
    """Each seat: its axis, away from the light, and its three pads."""
    seats = built.base.seats
    return tuple(
        records.SeatRecord(
            ball=k + 1,
            axis=(seats.axis[k] + 0.0).tolist(),
            normals=(seats.pad_normals[k] + 0.0).tolist(),
            contacts_mm=(seats.contacts[k] + 0.0).tolist(),
            pad_diameter_mm=2 * float(seats.pad[k]),
        )
        for k in range(len(seats))
    )


def part_record(part: PrintedPart, quantity: int = 1) -> records.PrintedPartRecord:
    """A printed part; y = x @ axes + origin is a point on the bed."""
    return records.PrintedPartRecord(
        name=part.name,
        what=part.what,
        step=f"{part.name}.step",
        stl=f"{part.name}.stl",
        threemf=f"{part.name}.3mf",
        role=part.role,
        finish="mirror" if part.role == "cap" else None if part.role == "tool" else MATT_BLACK,
        ball=part.ball + 1 if part.ball >= 0 else None,
        quantity=quantity,
        axes=(part.solid.axes + 0.0).tolist(),
        origin_mm=(part.solid.origin + 0.0).tolist(),
    )


def _calibration(built: PrototypeModel) -> records.CentreEstimate | None:
    """Expected accuracy of the balls' centres by the LEDs; None without LEDs."""
    if not len(built.stage.leds):
        return None
    capture, stage = built.spec.optics.capture_diameter_mm / 2, built.spec.prototype.stage
    return calibration_estimate(stage, built.layout.array, built.stage.leds, capture).record()


def _camera_place(built: PrototypeModel) -> records.CameraPlace | None:
    """The mount's travel, the gauge's marks, its pictures and errors; None without a camera."""
    gauge, mount = built.frame.find(CameraGauge), built.frame.find(CameraMount)
    if gauge is None or mount is None:
        return None
    sizes, camera = gauge.sizes, built.layout.array.camera
    return records.CameraPlace(
        gauge=gauge.tools[0].name,
        marks_mm=(gauge.marks + 0.0).tolist(),
        lengths_mm=records.GaugeLengths(
            hub_to_near=sizes.near - sizes.hub,
            hub_to_far=sizes.far - sizes.hub,
            near_width=2 * sizes.near_half,
            far_width=2 * sizes.far_half,
            hub_to_pinhole=float(norm(camera.pinhole)) - sizes.hub,
        ),
        pictures=marks_seen(gauge, built.base, camera),
        error=records.PlaceError(**gauge.errors),
        travel=mount.travel,
    )


def _lamps(lamps: LampLayout | None, upper: UpperLamps | None) -> LampsRecord | None:
    if lamps is None:
        return None
    places, inward = (lamps.places + 0.0).tolist(), (lamps.inward + 0.0).tolist()
    return LampsRecord(
        strip=lamps.strip.name,
        strips=lamps.strips,
        length_mm=lamps.length,
        width_mm=lamps.width,
        level=lamps.level,
        places=tuple(
            LampPlace(name=body.name, position_mm=place, direction=direction)
            for body, place, direction in zip(lamps.bodies, places, inward, strict=True)
        ),
        lumen_each=lamps.lumen,
        watt=lamps.watt,
        current_ma=lamps.current_ma,
        upper=_upper(upper) if upper else None,
    )


def _upper(upper: UpperLamps) -> UpperLampsRecord:
    leds = zip(upper.places, upper.heads, upper.rods, strict=True)
    return UpperLampsRecord(
        part=upper.led.name,
        leds=tuple(
            UpperLed(
                names=(f"upper_board_{k}", f"upper_rod_{k}"),
                position_mm=(place + 0.0).tolist(),
                direction=(-unit(place) + 0.0).tolist(),
                head_mm=(head + 0.0).tolist(),
                rod_mm=(rod + 0.0).tolist(),
            )
            for k, (place, head, rod) in enumerate(leds, 1)
        ),
        candela_each=upper.candela,
        current_ma=upper.circuit.current_ma,
        head_diameter_mm=upper.led["diameter_mm"],
        rod_diameter_mm=upper.rod["outer_mm"] + WIRES_MM,
        tolerance_mm=TOLERANCE_MM,
    )


def _shroud(shroud: ShroudLayout | None) -> ShroudRecord | None:
    if shroud is None:
        return None
    return ShroudRecord(
        sheet=shroud.sheet.name,
        sheets=shroud.sheets,
        finish=MATT_BLACK,
        panels=tuple(
            CardPanel(
                name=panel.name,
                what=panel.component.what,
                dxf=f"{panel.name}.dxf",
                size_mm=panel.size,
            )
            for panel in shroud.panels
        ),
    )


def _fastener(one: Fastener) -> records.FastenerRecord:
    return records.FastenerRecord(
        name=one.name,
        part=one.part.name,
        position_mm=(one.place + 0.0).tolist(),
        along=(one.along + 0.0).tolist(),
        through=one.through,
        turns=one.rotates,
        finish=MATT_BLACK if one.part.kind in BLACK_KINDS else None,
    )
