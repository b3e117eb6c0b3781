"""A prototype with errors drawn and placed by own numpy code, for a run that Mitsuba renders.

It reads a build's files as any program may, and shares no code with tbcad. All in the frame of the
design, mm and radians.
"""

import csv
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

PARTS = ("carrier", "head", "shaft", "uprights")  # that bend, in sag.csv
TERMS = 7  # of a cap's form: astigmatism, coma, trefoil (sine and cosine each), spherical
FORMS_UM = {  # by how caps are made, with the error of the sagitta first
    "printed": np.array([10, 2.0, 2.0, 0.7, 0.7, 0.7, 0.7, 0.7]),
    "turned": np.array([0.3, 0.1, 0.1, 0.03, 0.03, 0.05, 0.05, 0.05]),
}
SEAT, SHIFT, LED = 0.07, 0.15, 0.2  # of printed parts, and of an LED in its pocket
LENS = np.array([0.03, 0.006, 7e-4, 7e-4])  # k1, k2, p1, p2
DOME_MM = 1.5


@dataclass(frozen=True)
class Rig:
    """What is photographed: k spheres in f frames, as designed or as built."""

    size: tuple[int, int]  # columns and rows
    pinhole: np.ndarray
    axes: np.ndarray  # rows: along the rows of the picture, down its columns, forward
    focal: np.ndarray  # (2,)
    principal: np.ndarray  # (2,)
    lens: np.ndarray  # k1, k2, p1, p2
    axis: np.ndarray
    point: np.ndarray  # of the axis
    angle: np.ndarray  # (f,)
    turn: np.ndarray  # rotation vectors about the origin, then (f, 3)
    shift: np.ndarray  # (f, 3)
    centre: np.ndarray  # of reflecting spheres at base angle zero, without weight, (k, 3)
    radius: np.ndarray
    body: np.ndarray  # centres of the spheres in the seats, (k, 3)
    body_radius: np.ndarray
    # by weight, in the base's frame: shift and rotation vector of the whole, and how seats move
    # beside that, (f, 6) and (f, k, 3)
    give: np.ndarray
    sag: np.ndarray
    seat_turn: np.ndarray  # rotation vectors of the seats beside that, (f, k, 3)
    half: np.ndarray  # half width of the part of a cap in use, 0 of balls, (k,)
    terms: np.ndarray  # (k, 7)
    across: np.ndarray  # x and y of the forms, (k, 2, 3)
    leds: np.ndarray

    def placed(self, frame: int, points: np.ndarray) -> np.ndarray:
        """Points of the base (k, 3), one of each sphere, where they are in a frame."""
        about = Rotation.from_rotvec(self.angle[frame] * self.axis)
        points = self.body + Rotation.from_rotvec(self.seat_turn[frame]).apply(points - self.body)
        bent = Rotation.from_rotvec(self.give[frame, 3:]).apply(points) + self.give[frame, :3]
        moved = self.point + about.apply(bent + self.sag[frame] - self.point)
        return Rotation.from_rotvec(self.turn[frame]).apply(moved) + self.shift[frame]

    def attitude(self, frame: int) -> Rotation:
        """Of the seats in a frame."""
        about = Rotation.from_rotvec(self.angle[frame] * self.axis)
        give = Rotation.from_rotvec(self.give[frame, 3:])
        seats = Rotation.from_rotvec(self.seat_turn[frame])
        return Rotation.from_rotvec(self.turn[frame]) * about * give * seats


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def numbers(table: list[dict[str, str]], names: str) -> np.ndarray:
    return np.array([[float(row[name] or 0) for name in names.split()] for row in table])


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def frame_axes(normal: np.ndarray) -> np.ndarray:
    """Two axes across each normal (k, 3), (k, 2, 3): the first from the least of its parts."""
    first = unit(np.cross(np.eye(3)[np.abs(normal).argmin(axis=-1)], normal))
    return np.stack([first, np.cross(normal, first)], axis=-2)


def designed(build: Path, frames: list[tuple[int, int]]) -> tuple[Rig, np.ndarray, np.ndarray]:
    """The rig of a build in frames (turn of the object, stop), what weight does there by each of
    PARTS and to seats (radians), (5, f, k, 3), and the turn by which motor and belt give, (f,)."""
    design = json.loads((build / "design.json").read_text())["cameras"][0]
    record = json.loads((build / "prototype.json").read_text())
    balls, stops, weight = (rows(build / f"{one}.csv") for one in ("balls", "stops", "sag"))
    size = design["width_px"], design["height_px"]
    forward, right = np.array(design["forward"]), np.array(design["right"])
    focal = size[0] / 2 / np.tan(np.radians(design["hfov_deg"]) / 2)
    base = np.array([record["frame"][one] for one in ("axis", "zero", "third")])
    stop = np.array([stop - 1 for _, stop in frames])
    angle = np.radians(numbers(stops, "base_angle_deg")[:, 0])
    names = [*(f"{part}_{{}}_mm" for part in PARTS), "carrier_turn_{}_rad"]
    bent = np.stack([numbers(weight, " ".join(map(name.format, "xyz"))) for name in names])
    bent = bent.reshape(len(names), len(stops), len(balls), 3)
    for one, turned in enumerate(angle):  # the table is in the frame of the design
        back = Rotation.from_rotvec(-turned * base[0]).as_matrix()
        bent[:, one] = bent[:, one] @ back.T
    half = np.zeros(len(balls))
    for cap in record["caps"]:
        half[cap["ball"] - 1] = cap["aperture_mm"] / 2
    radius = numbers(balls, "radius_mm")[:, 0]
    still = np.zeros((len(frames), 3))
    rig = Rig(
        size=size,
        pinhole=np.array(design["pinhole_mm"]),
        axes=np.stack([right, np.cross(forward, right), forward]),
        focal=np.full(2, focal),
        principal=(np.array(size) - 1) / 2,
        lens=np.zeros(4),
        axis=base[0],
        point=np.zeros(3),
        angle=angle[stop],
        turn=still,
        shift=still,
        centre=numbers(balls, "cx cy cz") - numbers(balls, "sag_x_mm sag_y_mm sag_z_mm"),
        radius=radius,
        body=numbers(balls, "bx by bz"),
        body_radius=numbers(balls, "body_radius_mm")[:, 0],
        give=np.zeros((len(frames), 6)),
        sag=np.zeros((len(frames), len(balls), 3)),
        seat_turn=np.zeros((len(frames), len(balls), 3)),
        half=half,
        terms=np.zeros((len(balls), TERMS)),
        across=frame_axes(numbers(balls, "nx ny nz")),
        leds=np.array([led["position_mm"] for led in record["leds"]]),
    )
    return rig, bent[:, stop], np.radians(numbers(stops, "wind_up_deg")[stop, 0])


def built(build: Path, frames: list[tuple[int, int]], seed: int) -> Rig:
    """The same with errors: figures of fused filament as docs/calibration.md states them."""
    rig, bent, wind_up = designed(build, frames)
    random = np.random.default_rng([40, seed])
    normal = random.standard_normal
    count, every = len(rig.radius), len(frames)
    zero_error = json.loads((build / "prototype.json").read_text())["home"]["zero_error_deg"]
    across = frame_axes(rig.axis[None])[0]
    cap = rig.half > 0
    outward = np.cross(rig.across[:, 0], rig.across[:, 1])
    made = json.loads((build / "design.json").read_text())["spec"]["prototype"]["caps"]
    power, *forms = 1e-3 * FORMS_UM[made]
    # Caps: power about the apex, height over the seat, tilt in the seat, form.
    designed_sagitta = rig.radius - np.sqrt(rig.radius**2 - rig.half**2)
    sagitta = np.where(cap, designed_sagitta + power * normal(count), 1.0)
    sagitta = np.maximum(sagitta, 0.05 * designed_sagitta)
    powered = np.where(cap, (rig.half**2 + sagitta**2) / (2 * sagitta), rig.radius)
    centre = rig.centre - (powered - rig.radius)[:, None] * outward
    tilts = random.uniform(-5.5e-3, 5.5e-3, (count, 2)) * cap[:, None]
    tilted = Rotation.from_rotvec(np.einsum("ka,kax->kx", tilts, rig.across))
    centre = rig.body + tilted.apply(centre - rig.body)
    high = np.where(cap, 0.05, 0.00029) * normal(count)
    # The carrier: grown, and moved on its shaft by a shift that all seats share.
    growth, common = 1 - 1.5e-3 + 1.5e-3 * normal(), SHIFT * normal(3)
    moved = common + (growth - 1) * rig.body + SEAT * normal((count, 3))
    tilt = Rotation.from_rotvec(1.8e-3 * normal(2) @ across)
    share = 1 + 0.25 * normal(len(PARTS))  # each part bends by its own
    give, sag = motion_and_rest(rig.body, np.tensordot(share, bent[:-1], 1))
    of_carrier = motion_and_rest(rig.body, bent[0])[0]
    seat_turn = share[0] * (bent[-1] - of_carrier[:, None, 3:])
    turn = 2.8e-4 * normal((every, 2)) @ across
    run_out = 0.01 * normal((every, 2)) @ across
    offset = np.radians(random.uniform(-zero_error, zero_error, 2))
    run = np.array([int(turned > 0) for turned, _ in frames])
    angle = rig.angle + (1 + 0.2 * normal()) * wind_up + offset[run]
    # Another lens: barrel, off its sensor's middle, aimed so that the picture is in place.
    aside = 0.01 * rig.size[0] * normal(2)
    back = (aside[0] * rig.axes[1] - aside[1] * rig.axes[0]) / rig.focal[0]
    aim = Rotation.from_rotvec(2.4e-3 * normal(3)) * Rotation.from_rotvec(back)
    return replace(
        rig,
        pinhole=rig.pinhole + 0.14 * normal(3),
        axes=aim.apply(rig.axes),
        focal=rig.focal * (1 + 0.01 * normal()) * (1 + np.array([5e-4, -5e-4]) * normal()),
        principal=rig.principal + aside,
        lens=LENS * np.clip(normal(4), -1.5, 1.5),
        axis=tilt.apply(rig.axis),
        point=SHIFT * normal(2) @ across,
        angle=angle + np.radians(0.08) * normal(every),
        turn=turn,
        shift=run_out,
        centre=tilt.apply(centre + moved),
        radius=powered + high,
        body=tilt.apply(rig.body + moved),
        body_radius=rig.body_radius + np.where(cap, 0.0, high),
        give=give,
        sag=sag,
        seat_turn=seat_turn,
        terms=forms * normal((count, TERMS)) * cap[:, None],
        across=np.stack([(tilt * tilted).apply(rig.across[:, i]) for i in (0, 1)], axis=1),
        leds=rig.leds + SHIFT * normal(3) + LED * normal(rig.leds.shape),
    )


def motion_and_rest(place: np.ndarray, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (f, k, 3) of bodies at places (k, 3) as shift and turn (f, 6), and the rest.

    What head, shaft and uprights do is a motion of the whole base, and caps turn with it.
    """
    motion = np.zeros((len(place), 3, 6))
    motion[:, :, :3] = np.eye(3)
    motion[:, :, 3:] = np.cross(np.eye(3), place[:, None]).swapaxes(1, 2)
    flat = motion.reshape(-1, 6)
    give = np.linalg.lstsq(flat, moved.reshape(len(moved), -1).T, rcond=None)[0].T
    turned = [Rotation.from_rotvec(one[3:]).apply(place) + one[:3] - place for one in give]
    return give, moved - np.array(turned)


def directions(rig: Rig, pixels: np.ndarray) -> np.ndarray:
    """Unit directions (n, 3) through columns and rows (n, 2), by OpenCV's model of a lens."""
    place = (pixels - rig.principal) / rig.focal
    k1, k2, p1, p2 = rig.lens
    found = place
    for _ in range(40):
        x, y = found.T
        square = x * x + y * y
        radial = 1 + square * (k1 + square * k2)
        beside = [2 * p1 * x * y + p2 * (square + 2 * x * x)]
        beside.append(p1 * (square + 2 * y * y) + 2 * p2 * x * y)
        found = (place - np.stack(beside, axis=1)) / radial[:, None]
    return unit(np.column_stack([found, np.ones(len(found))]) @ rig.axes)


def projected(rig: Rig, points: np.ndarray) -> np.ndarray:
    """Columns and rows (n, 2) of points (n, 3)."""
    x, y, z = ((points - rig.pinhole) @ rig.axes.T).T
    x, y = x / z, y / z
    k1, k2, p1, p2 = rig.lens
    square = x * x + y * y
    radial = 1 + square * (k1 + square * k2)
    moved = x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x)
    down = y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y
    return np.stack([moved, down], axis=1) * rig.focal + rig.principal


def form_slopes(rig: Rig, ball: np.ndarray, offset: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Gradients (n, 3) of the forms of caps (n,) at offsets (n, 3), by axes (n, 2, 3)."""
    half = np.where(rig.half[ball] > 0, rig.half[ball], 1.0)
    x, y = np.einsum("nax,nx->an", axes, offset) / half
    six, eight, five = np.sqrt([6.0, 8.0, 5.0])
    zero, square = 0 * x, x * x + y * y
    by_x = (six * 2 * y, six * 2 * x, eight * 6 * x * y, eight * (9 * x * x + 3 * y * y - 2))
    by_x += (eight * 6 * x * y, eight * 3 * (x * x - y * y), five * (24 * square - 12) * x)
    by_y = (six * 2 * x, -six * 2 * y, eight * (3 * x * x + 9 * y * y - 2), eight * 6 * x * y)
    by_y += (eight * 3 * (x * x - y * y), -eight * 6 * x * y, five * (24 * square - 12) * y)
    terms = rig.terms[ball].T / half
    slope = np.stack([(terms * np.array(by)).sum(axis=0) for by in (by_x, by_y)]) + zero
    return np.einsum("an,nax->nx", slope, axes)
