"""Lamps on the lenses of a shell's cameras: what they light through the mirrors, and who sees them.

Light is followed forward: bundles of equal solid angle leave each LED and meet the shells' facets,
are reflected on the fitted spheres, and are counted where they fall on a sphere of two thirds of
the capture sphere. Glare is followed backward: every so many pixels, by one mirror and by two, to
what shines. Nothing else stands in the light: the object is that sphere, or is not there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.rays import build_scene, first_hits, pixel_rows
from tbcad_verify.mesh.surfaces import (
    Surfaces,
    nearest_to_origin,
    prepare_for_rays,
    reflect,
    reflect_directions,
)
from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.record.export import Camera, ShellLamps
from tbcad_verify.record.spec import AUTO, ShellLampsSpec
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    check_names,
    guarded_each,
    informative,
    no_faults,
)
from tbcad_verify.shell.optics import OpticalSetup, SensorScene
from tbcad_verify.types import Bools, Floats

# Of each LED: lumen at the current of the list, and width of what shines, mm.
LEDS = {"STAR-3535": (40.0, 3.5)}
REFLECTED = 0.85  # of aluminised mirrors, somewhat tarnished
OBJECT = 2 / 3  # of the capture sphere
BUNDLES = 150_000  # of each LED
BELTS, SECTORS = 12, 12  # patches of equal area on the object, in height and round it
RATIO = 4.0
# From so far below the horizon on do virtual cameras see a surface at 60 degrees from its normal.
LOWEST = -np.sin(np.radians(60.0))
ROWS = 194  # of pixels are followed for glare, of a picture that has more
GLARE = 0.5  # % of the pixels in use
PLACE_MM = 0.1  # of an LED from the ring's face, across and along
PLAY_MM = 1.0  # of the lens in the ring, on the diameter
CLEAR_MM = 3.0  # round an LED's axis nothing of the ring is nearer
LIFT_MM = 1e-3
CHECKS = {
    "lamp ring": "faults",
    "light ratio": "brightest to darkest",
    "light of the shell": "lx",
    "glare of lamps": "% of pixels",
}


def checks(lamps: ShellLamps, ring: Mesh, setup: OpticalSetup) -> list[Check]:
    """The lamps of a shell, each check unknown by itself. Unknown: no LED that is known."""
    if lamps.led not in LEDS:
        raise Unknown(f"{lamps.led} is no LED that is known")
    names = check_names(CHECKS, lamps.ring.stl)
    return guarded_each(names, (_ring, _ratio, _light, _glare), ShellLight(lamps, ring, setup))


@dataclass
class ShellLight:
    """Lamps, ring and mirrors that the checks measure on; the light is followed once."""

    lamps: ShellLamps  # as recorded
    ring: Mesh  # of the ring in its own frame
    setup: OpticalSetup  # mirrors as found
    _lux: Floats | None = None

    @property
    def lux(self) -> Floats:
        """(BELTS, SECTORS) light on patches of the object, the lowest first."""
        if self._lux is None:
            self._lux = object_light(self.lamps, self.setup)
        return self._lux

    @property
    def seen(self) -> Floats:
        """That on patches that some virtual camera sees at 60 degrees or less."""
        height = (np.arange(BELTS) + 0.5) * 2 / BELTS - 1
        return np.asarray(self.lux[height >= LOWEST])


def _ring(name: CheckName, light: ShellLight) -> Check:
    """The ring leaves every LED free, holds it, and is out of its camera's view."""
    export = light.setup.export
    faults = asked_faults(export.spec.shell.lamps, light.lamps, light.ring)
    for camera in light.setup.cameras:
        faults += ring_faults(light.lamps, light.ring, camera)
    return no_faults(name, faults)


def asked_faults(asked: ShellLampsSpec, lamps: ShellLamps, ring: Mesh) -> list[str]:
    """In what the rings are not what the design asks for, where it has no "auto"."""
    each = [sum(one.camera == key for one in lamps.places) for key in ("a", "b")]
    play = 2 * float(np.hypot(*ring.points[:, :2].T).min())
    faults = []
    if asked.leds not in (AUTO, *each) or each[0] != each[1]:
        faults.append(f"{each[0]} and {each[1]} LEDs, the spec asks for {asked.leds}")
    if asked.lens_mm != AUTO and not 0 <= play - asked.lens_mm <= PLAY_MM:
        faults.append(f"a bore of {play:.2f} mm for a lens of {asked.lens_mm:g}")
    if asked.front_mm not in (AUTO, lamps.front_mm):
        faults.append(f"{lamps.front_mm:g} mm before the pinholes, not {asked.front_mm:g}")
    return faults


def ring_faults(lamps: ShellLamps, ring: Mesh, camera: Camera) -> list[str]:
    """Faults of the ring on one camera."""
    axes = np.stack([camera.right, -camera.down, -camera.forward])
    middle = camera.pinhole + lamps.front_mm * camera.forward
    mine = [one for one in lamps.places if one.camera == camera.id]
    faults = [f"no LEDs at camera {camera.id}"] * (not mine)
    scene = build_scene(ring)
    angle = np.arange(8) * np.pi / 4
    circle = CLEAR_MM * np.array([np.cos(angle), np.sin(angle), 0 * angle])
    behind = np.array([[0.0], [0.0], [1.0]])
    for k, one in enumerate(mine, 1):
        place = axes @ (one.position - middle)
        start = np.column_stack([place, place[:, None] + circle]) - 50 * behind
        way = np.broadcast_to(behind, start.shape)
        beside = (
            place[:, None] * (1 + 6 / np.linalg.norm(place)) - 50 * behind
        )  # the face, 6 mm outward
        if (first_hits(scene, start, way) >= 0).any():
            faults.append(f"LED {k} of camera {camera.id} is behind the ring")
        if first_hits(scene, beside, behind)[0] < 0 or abs(place[2]) > PLACE_MM:
            faults.append(f"LED {k} of camera {camera.id} is in no window of the ring")
        if np.abs(one.direction - camera.forward).max() > 1e-6:
            faults.append(f"LED {k} of camera {camera.id} does not face forward")
    points = middle + ring.points @ axes - camera.pinhole
    ahead = points @ camera.forward
    across, down = (np.abs(points @ way) for way in (camera.right, camera.down))
    pitch = camera.pitch / 2
    inside = (across < pitch * camera.width * ahead) & (down < pitch * camera.height * ahead)
    return faults + [f"camera {camera.id} sees the ring"] * bool(inside.any())


def object_light(lamps: ShellLamps, setup: OpticalSetup) -> Floats:
    """(BELTS, SECTORS) illuminance of patches of equal area of the object, lux."""
    radius = OBJECT * setup.radius
    lumen = np.zeros(BELTS * SECTORS)
    for one in lamps.places:
        place, flux, way = one.position, *bundles(LEDS[lamps.led][0], one.direction)
        straight = on_sphere(np.broadcast_to(place[:, None], way.shape), way, radius)
        lumen += _counted(straight, flux)
        start, out, power = _reflected(setup, place, way, flux, np.isnan(straight[0]))
        lumen += _counted(on_sphere(start, out, radius), power)
    area = 4e-6 * np.pi * radius**2 / lumen.size
    return np.asarray(lumen.reshape(BELTS, SECTORS) / area)


def bundles(lumen: float, axis: Floats) -> tuple[Floats, Floats]:
    """Flux (N,) and unit directions (3, N) of what a Lambertian LED sends, lumen.

    Of equal solid angle, on a spiral over the hemisphere.
    """
    k = np.arange(BUNDLES) + 0.5
    cosine, turn = k / BUNDLES, np.pi * (1 + np.sqrt(5)) * k
    sine = np.sqrt(1 - cosine**2)
    across = unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin()])[:, None])
    other = np.cross(axis, across[:, 0])[:, None]
    way = axis[:, None] * cosine + sine * (across * np.cos(turn) + other * np.sin(turn))
    return 2 * lumen * cosine / BUNDLES, way


def _reflected(
    setup: OpticalSetup, place: Floats, way: Floats, flux: Floats, free: Bools
) -> tuple[Floats, Floats, Floats]:
    """Starts (3, N), directions (3, N) and flux (N,) of bundles after the mirror they meet."""
    facet = first_hits(setup.scene, place[:, None], way)
    label = np.append(setup.recovery.segments.label, -1)[facet]
    mirror = np.where(label >= 0, setup.owner()[label], -1)
    some = np.flatnonzero((mirror >= 0) & free)
    lines = reflect(prepare_for_rays(place, setup.mirrors), mirror[some], way[:, some])
    return lines.point, unit(lines.toward), REFLECTED * flux[some]


def on_sphere(start: Floats, way: Floats, radius: float) -> Floats:
    """(3, N) where rays first meet a sphere about the origin; NaN where they do not."""
    along = -dot(start, way)
    square = radius**2 - dot(start, start) + along**2
    with np.errstate(invalid="ignore"):
        length = along - np.sqrt(square)
        return np.asarray(np.where(length > 0, start + length * way, np.nan))


def _counted(points: Floats, flux: Floats) -> Floats:
    """Flux by patch of the object, of bundles that fall on it at points (3, N)."""
    hit = np.isfinite(points[0])
    x, y, z = unit(points[:, hit])
    belt = np.minimum(((z + 1) / 2 * BELTS).astype(np.int64), BELTS - 1)
    turn = np.arctan2(y, x) / (2 * np.pi) % 1
    sector = np.minimum((turn * SECTORS).astype(np.int64), SECTORS - 1)
    count = np.bincount(belt * SECTORS + sector, flux[hit], BELTS * SECTORS)
    return count.astype(np.float64)


def _ratio(name: CheckName, light: ShellLight) -> Check:
    """No surface that is seen gets much less than another."""
    low, high = float(light.seen.min()), float(light.seen.max())
    detail = f"{low:.0f} to {high:.0f} lx on surfaces that face all ways that are seen"
    return at_most(name, high / low if low > 0 else np.inf, RATIO, detail)


def _light(name: CheckName, light: ShellLight) -> Check:
    return informative(name, float(light.seen.mean()), "on the object's surfaces, on average")


def _glare(name: CheckName, light: ShellLight) -> Check:
    """Pixels that would show the object, and show a lamp where it is not there."""
    cameras = light.setup.cameras[:1] if light.setup.symmetric else light.setup.cameras
    counts = np.array([glare(light.lamps, light.setup.sensor_scene(one)) for one in cameras])
    useful, bright = counts.sum(axis=0)
    detail = "see an LED past the object; on the object none can"
    return at_most(name, 100 * bright / max(useful, 1), GLARE, detail)


def glare(lamps: ShellLamps, sensor: SensorScene) -> tuple[int, int]:
    """Pixels in use of one camera, on some rows, and those that show an LED."""
    setup, useful, bright = sensor.setup, 0, 0
    every = max(sensor.camera.height // ROWS, 1)
    for row in range(every // 2, sensor.camera.height, every):
        rays = pixel_rows(sensor.camera, row, row + 1)
        facet = first_hits(sensor.own, sensor.camera.pinhole[:, None], rays)
        on = np.flatnonzero(sensor.owner[facet] >= 0)
        lines = reflect(sensor.seen, sensor.owner[facet[on]], rays[:, on])
        used = norm(nearest_to_origin(lines)) <= setup.radius
        start, way = lines.point[:, used], unit(lines.toward[:, used])
        useful += int(used.sum())
        second = first_hits(setup.scene, start + LIFT_MM * way, way)
        free = second < 0
        bright += int(_meets(lamps, start[:, free], way[:, free]).sum())
        label = np.append(setup.recovery.segments.label, -1)[second]
        mirror = np.where(label >= 0, setup.owner()[label], -1)
        some = np.flatnonzero(mirror >= 0)
        point, out = _again(setup.mirrors.take(mirror[some]), start[:, some], way[:, some])
        meets = _meets(lamps, point, out)  # before rays are traced: few do
        point, out = point[:, meets], out[:, meets]
        bright += int((first_hits(setup.scene, point + LIFT_MM * out, out) < 0).sum())
    return useful, bright


def _again(mirrors: Surfaces, start: Floats, way: Floats) -> tuple[Floats, Floats]:
    """Points and unit directions (3, N) of rays after mirrors (N), one for each."""
    k, beside = mirrors.curvature, start - mirrors.point
    slope = dot(way, mirrors.gradient(start))
    value = dot(beside, mirrors.normal) + k / 2 * dot(beside, beside)
    with np.errstate(invalid="ignore"):
        point = start + 2 * value / (np.sqrt(slope**2 - 2 * k * value) - slope) * way
    return point, reflect_directions(way, mirrors.gradient(point))


def _meets(lamps: ShellLamps, start: Floats, way: Floats) -> Bools:
    """(N,) whether rays meet the front of an LED, taken as a disc as wide as it."""
    radius, met = LEDS[lamps.led][1] / 2, np.zeros(start.shape[1], dtype=np.bool_)
    for one in lamps.places:
        toward = -(one.direction @ way)
        with np.errstate(divide="ignore", invalid="ignore"):
            length = (one.direction @ (start - one.position[:, None])) / toward
        off = norm(start + length * way - one.position[:, None])
        met |= (toward > 0) & (length > 0) & (off <= radius)
    return met
