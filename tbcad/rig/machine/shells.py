"""Both cameras of a shell with their mirrors, as machines: one frame each, and nothing that turns.

The prototype photographs for camera b with the object turned by 180 degrees about z. A shell's
camera b is taken likewise: its machine is in a frame that is turned so, in which the object is
turned. So photographs, calibrations and merges of shells and prototypes are made the same way.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.core.optics.pedestals.cells import GrooveWalls
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import HALF_TURN, Plan, read_plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.calibration import NAME, CalibrationRecord
from tbcad.records.run import Frame, Geometry
from tbcad.rig.machine.designed import (
    TURNS,
    BuiltPrototype,
    built_camera,
    designed_shell,
    draw_other_errors,
)
from tbcad.rig.machine.machine import Machine
from tbcad.tolerancing.montecarlo.draws import draw
from tbcad.tolerancing.montecarlo.edge_model import edge_models, warp_maps_of
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.montecarlo.sharpness import built_walls
from tbcad.types import Floats

CAMERAS = ("a", "b")
NOT_SERVED = -1  # in place of a ball's number: mirrors of the other camera
VECTORS = ("centre", "shell_shift", "shell_tilt", "camera_shift", "camera_tilt")
"""Of ShellDraws, in the frame of the design."""


def shell_frame(half: int) -> Frame:
    """The one frame of camera a's machine, 0, or camera b's, 1."""
    return Frame(object_turn_deg=0 if half == 0 else 180, stop=1, base_angle_deg=0.0)


def designed_half(export: ExportedDesign, half: int) -> Machine:
    """One camera of a shell, 0 for a, 1 for b, and the stage's LEDs; InputError: planar mirrors."""
    reflector, flip = export.reflectors[half], _flip(half)
    if (reflector.mirrors.curvature <= 0).any():
        raise InputError(
            f"{export.folder} has planar mirrors, which LEDs do not calibrate: build it with "
            "curved ones"
        )
    machine = designed_shell(reflector, np.array(export.spec.prototype.stage.leds_mm))
    camera = machine.camera
    return replace(
        machine,
        camera=replace(camera, pinhole=camera.pinhole * flip, axes=camera.axes * flip),
        centre=machine.centre * flip,
        leds=machine.leds * flip,
    )


def shell_plan(export: ExportedDesign, half: int) -> Plan:
    """The mirrors of one camera as balls that serve their own places at the one stop."""
    mirrors, flip = export.reflectors[half].mirrors, _flip(half)
    machine, count = designed_half(export, half), len(export.reflectors[half])
    ball = np.full((len(TURNS), count), NOT_SERVED)
    ball[half] = np.arange(count)
    return Plan(
        frame=np.eye(3)[::-1] * np.array([[1.0], [1.0], [-1.0]]),
        apex=mirrors.apex * flip,
        normal=mirrors.normal * flip,
        radius=machine.radius,
        body_centre=machine.centre,
        body_radius=machine.radius,
        moved=True,
        angle=machine.angle,
        ball=ball,
        stop=np.zeros_like(ball),
        parted=len(export.reflectors[half].walls) > 0,
    )


def half_of(frames: tuple[Frame, ...]) -> int:
    """Which camera of a shell took some frames: 0 for a, 1 for b."""
    return TURNS.index(frames[0].object_turn_deg)


def plan_of(export: ExportedDesign, geometry: Geometry, frames: tuple[Frame, ...]) -> Plan:
    """The plan of the one machine that took some frames of a run."""
    if geometry == "prototype":
        return read_plan(export)
    return shell_plan(export, half_of(frames))


def tied(machines: list[tuple[Machine, tuple[Frame, ...]]]) -> list[Machine]:
    """Machines, each moved as a whole to where its LEDs are those of the first.

    Photographs alone do not tell where a machine is; but both cameras of a shell see the same LEDs.
    One prototype stays where it is.
    """
    first, *others = machines
    anchor = _led_middle(*first) if others else 0.0  # a prototype's record may be without LEDs
    return [
        first[0],
        *(
            machine.moved((anchor - _led_middle(machine, frames)) * _flip(half_of(frames)))
            for machine, frames in others
        ),
    ]


def _led_middle(machine: Machine, frames: tuple[Frame, ...]) -> Floats:
    """Middle of the LEDs in the frame of the design, mm, (3,)."""
    return np.asarray(machine.leds.mean(axis=0) * _flip(half_of(frames)))


def random_half(export: ExportedDesign, half: int, errors: Errors, seed: int) -> BuiltPrototype:
    """One camera of the first simulated build, the same that `tbcad tolerance` simulates.

    The mean of the scales along the axes is used for all three, and form errors are left out: a
    sphere stays a sphere.
    """
    designed, grooves = designed_half(export, half), export.reflectors[half].walls
    maps = warp_maps_of(edge_models(export.reflectors), errors)
    drawn = draw(errors, seed, [0], len(designed.radius), maps, len(grooves))
    turned = {name: getattr(drawn[half], name) * _flip(half) for name in VECTORS}
    draws = replace(drawn[half], **turned)
    leds = draw_other_errors(len(designed.leds), seed).leds * _flip(half)
    other = replace(draw_other_errors(len(designed.leds), seed, half), leds=leds)
    scale, tilt = float(draws.scale.mean()), Rotation.from_rotvec(draws.shell_tilt[0])
    machine = replace(
        designed,
        camera=built_camera(designed.camera, draws, other),
        centre=tilt.apply(scale * (designed.centre + draws.centre[0])) + draws.shell_shift[0],
        radius=scale * (designed.radius + draws.radius[0]),
        leds=designed.leds + other.leds,
    )
    walls = built_walls(grooves.flipped(_flip(half)), draws, 0, draws.wall[0])
    walls = walls.joined(built_walls(_seam_and_foot(export, half), draws, 0))
    return BuiltPrototype(machine, machine.centre, machine.radius, walls)


def perfect_half(export: ExportedDesign, half: int) -> BuiltPrototype:
    """One camera of a build's shell, built without errors: see `designed_half`."""
    machine = designed_half(export, half)
    grooves = export.reflectors[half].walls.flipped(_flip(half))
    walls = grooves.joined(_seam_and_foot(export, half))
    return BuiltPrototype(machine, machine.centre, machine.radius, walls)


def _seam_and_foot(export: ExportedDesign, half: int) -> GrooveWalls:
    """Both planes, as walls that end each mirror, in the frame of the machine."""
    reflector = export.reflectors[half]
    point = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, reflector.foot]])
    normal = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # machine b is turned to camera a's side
    mirror = np.repeat(np.arange(len(reflector)), 2)
    return GrooveWalls.of_planes(
        mirror, np.tile(point, (len(reflector), 1)), np.tile(normal, (len(reflector), 1))
    )


def _flip(half: int) -> Floats:
    return HALF_TURN if half else np.ones(3)


def export_of(calibration: Path) -> Path:
    """The build that a calibration's record names; InputError: it names none."""
    files = [one / NAME for one in (calibration, *(calibration / name for name in CAMERAS))]
    try:
        return Path(CalibrationRecord.read(next(filter(Path.is_file, files), files[0])).exports)
    except InputError:
        raise InputError(f"{calibration} does not name its build: name it with --exports") from None
