"""One machine: a camera, spheres that rotate about an axis, and LEDs that rest; its record.

Everything is in the frame of the design (mm, z up, the object's centre at the origin). A machine's
frames are its photographed positions: one for each stop of each run of the base. The object is
turned between both runs; camera, axis and LEDs are not. The shell of one camera is a machine with
one frame, whose spheres are its mirrors. machine.json has its state, calibrated or simulated.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.optics.sphere_forms import (
    FIRST,
    PER_MM,
    TERM_COUNT,
    Forms,
    effective_centres,
)
from tbcad.errors import InputError
from tbcad.records.calibration import (
    CalibratedCamera,
    FormRecord,
    MachineRecord,
    SphereRecord,
)
from tbcad.records.run import Frame
from tbcad.types import Bools, Floats, Ints

RECORD = "machine.json"
TRUTH = "truth.json"  # the machine of a simulated run, in its folder
CAMERA = {
    **{"pinhole": "pinhole_mm", "axes": "axes", "focal": "focal_px"},
    **{"principal": "principal_px", "distortion": "distortion"},
}
"""Arrays of a camera, and their keys in machine.json."""
OF_FRAMES = {
    **{"turn": "turn_rad", "shift": "shift_mm"},
    **{"sag": "sag_mm", "seat_turn": "seat_turn_rad"},
}
"""Arrays of a machine's frames that it may lack, and their keys there."""
ROUNDING = 1e-9  # of unit vectors
MICROMETRE = 1e-3  # mm
AGAIN = "calibrate again"


@dataclass(frozen=True)
class Machine:
    """The state of a machine with k spheres, f frames and l LEDs."""

    camera: LensCamera
    axis: Floats  # unit vector of the axis that the base rotates about, (3,)
    axis_point: Floats  # a point of the axis, mm, (3,)
    angle: Floats  # of the base in each frame, radians, (f,)
    centre: Floats  # of the reflecting spheres at base angle zero, mm, (k, 3)
    radius: Floats  # of the reflecting spheres, mm, (k,)
    leds: Floats  # where each LED shines from, mm, (l, 3)
    # of the base in each frame beside its angle: rotation vector about the origin, radians, and
    # then a shift, mm, (f, 3); None for none
    turn: Floats | None = None
    shift: Floats | None = None
    # of the spheres in each frame by their weight, in the base's frame, mm, (f, k, 3)
    sag: Floats | None = None
    # of their seats then, beside the base's turn, with which forms go: rotation vectors in the
    # base's frame, radians, (f, k, 3); that it moves a cap's sphere is in its sag
    seat_turn: Floats | None = None
    # form errors of the spheres, of which caps have some; None: none
    forms: Forms | None = None

    def centres(self, frame: Ints, sphere: Ints) -> Floats:
        """Centres of spheres (n,) in frames (n,), mm, (n, 3)."""
        return self.on_spheres(self.centre[sphere], frame, sphere)

    def on_spheres(self, points: Floats, frame: Ints, sphere: Ints) -> Floats:
        """Where points (n, 3) of spheres' bodies on the base are in frames (n,), mm, (n, 3)."""
        centre = self.centre[sphere]
        on_base = centre + self.seat_turns(frame, sphere).apply(points - centre)
        if self.sag is not None:
            on_base = on_base + self.sag[frame, sphere]
        return self.placed(on_base, frame)

    def placed(self, on_base: Floats, frame: Ints) -> Floats:
        """Where points of the base (n, 3) are in frames (n,), mm, (n, 3)."""
        turned = rotated(on_base - self.axis_point, self.axis, self.angle[frame])
        placed = np.asarray(self.axis_point + turned)
        if self.turn is not None:
            placed = Rotation.from_rotvec(self.turn[frame]).apply(placed)
        return placed if self.shift is None else placed + self.shift[frame]

    def turned(self, on_base: Floats, frame: Ints) -> Floats:
        """Vectors of the base (n, 3) as they are in frames (n,), (n, 3)."""
        return self.placed(self.axis_point + on_base, frame) - self.placed(
            np.broadcast_to(self.axis_point, on_base.shape), frame
        )

    def forms_in(self, frame: Ints, sphere: Ints) -> Floats:
        """Forms of spheres (n,) in frames (n,), (n, FORM_COLUMNS); they have to be known."""
        assert self.forms is not None
        rows, seats = self.forms.rows()[sphere], self.seat_turns(frame, sphere)
        for start in range(FIRST, PER_MM, 3):
            rows[:, start : start + 3] = self.turned(seats.apply(rows[:, start : start + 3]), frame)
        return rows

    def seat_turns(self, frame: Ints, sphere: Ints) -> Rotation:
        """Of the seats of spheres (n,) on the base in frames (n,)."""
        none = np.zeros((len(frame), 3))
        return Rotation.from_rotvec(
            none if self.seat_turn is None else self.seat_turn[frame, sphere]
        )

    def reflecting_centres(self, frame: Ints, sphere: Ints, light: Floats) -> Floats:
        """Centres (n, 3) of spheres that show lights (n, 3) where those with their forms do, mm."""
        centre = self.centres(frame, sphere)
        if self.forms is None:
            return centre
        form = self.forms_in(frame, sphere)
        return effective_centres(centre, self.radius[sphere], form, light, self.camera.pinhole)

    def of_frames(self, frames: Ints) -> "Machine":
        """The same machine in some of its frames (g,)."""
        every = {name: getattr(self, name) for name in OF_FRAMES}
        some: Any = {name: None if one is None else one[frames] for name, one in every.items()}
        return replace(self, angle=self.angle[frames], **some)

    def moved(self, shift: Floats) -> "Machine":
        """The same machine, moved rigidly by a shift in mm, (3,)."""
        return replace(
            self,
            camera=replace(self.camera, pinhole=self.camera.pinhole + shift),
            axis_point=self.axis_point + shift,
            centre=self.centre + shift,
            leds=self.leds + shift,
        )

    def highlights(self, frame: Ints, sphere: Ints, led: Ints) -> Floats:
        """Columns and rows (n, 2) at which spheres show LEDs in frames, each (n,), from 0."""
        light, camera = self.leds[led], self.camera
        centre = self.reflecting_centres(frame, sphere, light)
        points = reflection_points(centre, self.radius[sphere], light, camera.pinhole)
        return camera.project(points)


@dataclass(frozen=True)
class Highlights:
    """Measured reflections of LEDs in spheres, over n of them."""

    frame: Ints  # from 0, (n,)
    sphere: Ints  # from 0, (n,)
    led: Ints  # from 0, (n,)
    pixel: Floats  # column and row; whole numbers are pixel centres, (n, 2)
    sigma: Floats  # standard deviation of column and of row, pixels, (n,)

    def __len__(self) -> int:
        return len(self.frame)

    def only(self, which: Bools | Ints) -> "Highlights":
        """Some of them."""
        return Highlights(**{one.name: getattr(self, one.name)[which] for one in fields(self)})


def truth_file(machine: str) -> str:
    """Name of the file with a machine as it was simulated: truth.json, of a shell truth_a.json."""
    return f"truth_{machine}.json" if machine else TRUTH


def write_machine(path: Path, machine: Machine, frames: tuple[Frame, ...]) -> None:
    """Write machine.json, for a machine with these frames."""
    camera = machine.camera
    spheres = zip(machine.centre.tolist(), machine.radius.tolist(), strict=True)
    MachineRecord(
        camera=CalibratedCamera(
            **{key: getattr(camera, name).tolist() for name, key in CAMERA.items()},
            width_px=camera.width_px,
            height_px=camera.height_px,
        ),
        axis=machine.axis.tolist(),
        axis_point_mm=machine.axis_point.tolist(),
        frames=frames,
        angle_deg=np.degrees(machine.angle).tolist(),
        spheres=tuple(SphereRecord(centre_mm=at, radius_mm=radius) for at, radius in spheres),
        leds_mm=machine.leds.tolist(),
        **{key: _listed(getattr(machine, name)) for name, key in OF_FRAMES.items()},
        forms=None if machine.forms is None else tuple(_form_records(machine.forms)),
    ).write(path)


def _form_records(forms: Forms) -> Iterator[FormRecord]:
    for k in np.flatnonzero(forms.half_aperture).tolist():
        yield FormRecord(
            ball=k + 1,
            half_aperture_mm=forms.half_aperture[k],
            axes=forms.axes[k].tolist(),
            terms_um=(forms.terms[k] / MICROMETRE).tolist(),
        )


def _read_forms(path: Path, found: MachineRecord) -> Forms | None:
    if found.forms is None:
        return None
    count = len(found.spheres)
    axes = np.tile(np.eye(3)[:2], (count, 1, 1))
    terms, half = np.zeros((count, TERM_COUNT)), np.zeros(count)
    for one in found.forms:
        k = one.ball - 1
        axes[k], half[k] = one.axes, one.half_aperture_mm
        terms[k] = MICROMETRE * np.array(one.terms_um)
    if np.abs(axes @ axes.swapaxes(1, 2) - np.eye(2)).max() > ROUNDING:
        raise InputError(f"{path}: axes of a form are no unit vectors at right angles: {AGAIN}")
    return Forms(terms, axes, half)


def _listed(values: Floats | None) -> list[Any] | None:
    return None if values is None else values.tolist()


def read_machine(path: Path) -> tuple[Machine, tuple[Frame, ...]]:
    """The machine that a file describes, and its frames; InputError: it says what cannot be."""
    found = MachineRecord.read(path)
    axis, axes = np.array(found.axis), np.array(found.camera.axes)
    if abs(norm(axis) - 1) > ROUNDING or np.abs(axes @ axes.T - np.eye(3)).max() > ROUNDING:
        raise InputError(f"{path}: axes are no unit vectors at right angles: {AGAIN}")
    camera = LensCamera(
        **{name: np.array(getattr(found.camera, key)) for name, key in CAMERA.items()},
        width_px=found.camera.width_px,
        height_px=found.camera.height_px,
    )
    machine = Machine(
        camera=camera,
        axis=axis,
        axis_point=np.array(found.axis_point_mm),
        angle=np.radians(found.angle_deg),
        centre=np.array([sphere.centre_mm for sphere in found.spheres]),
        radius=np.array([sphere.radius_mm for sphere in found.spheres]),
        leds=np.array(found.leds_mm).reshape(-1, 3),
        **{
            name: None if getattr(found, key) is None else np.array(getattr(found, key))
            for name, key in OF_FRAMES.items()
        },
        forms=_read_forms(path, found),
    )
    return machine, found.frames
