"""The frame as solids: axes, pinhole and clearances, all from the shapes themselves."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, Mesh64
from OCP.BRep import BRep_Tool
from OCP.Geom import Geom_CylindricalSurface
from OCP.TopoDS import TopoDS_Shape
from scipy.spatial import cKDTree

from tbcad.cad.solids import faces, meshed, volume
from tbcad.geometry.rotations import rotated_about_x
from tbcad.geometry.vectors import norm
from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.frame.frame_solids import bought, parts
from tbcad.prototype.frame.layout import FrameLayout, frame
from tbcad.prototype.keepout import Room, room
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage import stage_solids as stages
from tbcad.prototype.stage.layout import StageLayout, stage
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec
from tbcad.spec.printer import PrinterSpec
from tbcad.spec.prototype import BaseSpec, FrameSpec, StageSpec
from tests.helpers import as_trimesh

LISTS = load_parts()
DRIVE = load_drives(LISTS)[0]
SPEC = load_spec(None, ["n=6", "prototype.k=4"])
KEYS = FrameSpec(clearance_mm=1.5)
PRINTER = PrinterSpec()


@pytest.fixture(scope="module")
def made(small_design: MirrorDesign) -> PrototypeLayout:
    return prototype_layout(SPEC, small_design)


@pytest.fixture(scope="module")
def carrier(made: PrototypeLayout) -> BaseLayout:
    return base_layout(BaseSpec(), made)


@pytest.fixture(scope="module")
def space(made: PrototypeLayout, carrier: BaseLayout) -> Room:
    return room(made, carrier, 30.0, 0.0)


@pytest.fixture(scope="module")
def stand(made: PrototypeLayout, space: Room) -> StageLayout:
    return stage((StageSpec(), KEYS, SPEC.prototype), made, space, LISTS)


@pytest.fixture(scope="module")
def numbers(
    made: PrototypeLayout, carrier: BaseLayout, space: Room, stand: StageLayout
) -> FrameLayout:
    return frame((KEYS, SPEC.prototype), made, carrier, stand, DRIVE, space, LISTS)


@pytest.fixture(scope="module")
def solids(numbers: FrameLayout) -> dict[str, PlacedSolid]:
    return {part.name: part for part in parts(numbers, PRINTER)}


@pytest.fixture(scope="module")
def things(numbers: FrameLayout) -> dict[str, TopoDS_Shape]:
    return dict(bought(numbers))


def cylinders(shape: TopoDS_Shape) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """A point on the axis, its direction and the radius of each round face."""
    found = []
    for face in faces(shape):
        surface = BRep_Tool.Surface_s(face)
        if isinstance(surface, Geom_CylindricalSurface):
            axis = surface.Cylinder().Axis()
            at, way = axis.Location(), axis.Direction()
            point = np.array([at.X(), at.Y(), at.Z()])
            found.append((point, np.array([way.X(), way.Y(), way.Z()]), surface.Radius()))
    return found


class TestSolids:
    def test_each_is_watertight(self, solids: dict[str, PlacedSolid]) -> None:
        assert len(solids) == 5
        for part in solids.values():
            mesh = as_trimesh(part.shape)
            assert mesh.is_watertight
            assert mesh.is_winding_consistent
            assert mesh.body_count == 1
            assert mesh.volume == pytest.approx(part.volume, rel=2e-3)

    def test_each_fits_on_the_bed(self, solids: dict[str, PlacedSolid]) -> None:
        for part in solids.values():
            size = np.ptp(meshed(part.on_bed, 0.1).vertices, axis=0)
            assert (size < np.array(PRINTER.bed_mm) - PRINTER.bed_margin_mm).all()

    def test_bearing_seats_and_bearings_are_on_the_axis(
        self, carrier: BaseLayout, solids: dict[str, PlacedSolid], things: dict[str, TopoDS_Shape]
    ) -> None:
        w, seat = carrier.frame[0], (22 + KEYS.bearing_fit_mm) / 2
        head = cylinders(solids["bearing_head"].shape)
        seats = [one for one in head if abs(one[2] - seat) < 1e-9]
        assert len(seats) >= 2
        rings = [*cylinders(things["bearing_front"]), *cylinders(things["bearing_rear"])]
        assert len(rings) == 4
        for point, way, _ in (*seats, *rings):
            assert norm(np.cross(point, w)) < 1e-9
            assert norm(np.cross(way, w)) < 1e-9

    def test_motor_holes_are_a_square_of_31_mm(
        self, carrier: BaseLayout, solids: dict[str, PlacedSolid], numbers: FrameLayout
    ) -> None:
        w, out, side = carrier.frame
        holes = [
            point
            for point, way, radius in cylinders(solids["bearing_head"].shape)
            if abs(radius - 1.7) < 1e-9 and abs(way @ w) > 0.999
        ]
        across = sorted({round(float(p @ side), 6) for p in holes})
        along = sorted({round(float(p @ out), 6) for p in holes})
        assert across == [-15.5, 15.5]
        half = KEYS.belt_travel_mm / 2
        ends = [m + s for m in (-15.5, 15.5) for s in (-half, half)]
        assert np.array(along) - numbers.head.motor == pytest.approx(np.array(ends), abs=1e-5)

    def test_the_bracket_puts_the_pinhole_where_the_record_has_it(
        self, made: PrototypeLayout, solids: dict[str, PlacedSolid]
    ) -> None:
        """From the bracket alone: its face and slot, and the camera's radius and thread."""
        view, own = made.half.camera, SPEC.prototype
        slot = [
            (point, way)
            for point, way, radius in cylinders(solids["camera_bracket"].shape)
            if abs(radius - 3.3) < 1e-9
        ]
        assert len(slot) >= 2
        way = slot[0][1] * np.sign(slot[0][1] @ [1, 0, 0])
        mesh = as_trimesh(solids["camera_bracket"].shape)
        face = mesh.face_normals @ way < -1 + 1e-9
        near = (mesh.triangles[face].reshape(-1, 3) @ way).min()
        up = np.cross(way, [0, 1, 0])
        up *= np.sign(up[2])
        ends = sorted((point for point, _ in slot), key=lambda point: float(point @ up))
        middle = (ends[0] + ends[-1]) / 2
        thread = middle + (near - middle @ way) * way
        pinhole = thread - own.camera_diameter_mm / 2 * way + KEYS.camera_screw_mm * up
        assert norm(pinhole - view.pinhole) < 1e-6
        assert up == pytest.approx(view.forward, abs=1e-9)

    def test_the_clamp_holds_the_post(
        self, solids: dict[str, PlacedSolid], stand: StageLayout
    ) -> None:
        radius = stand.post + KEYS.post_play_mm / 2
        bores = [
            (point, way)
            for point, way, size in cylinders(solids["stage_foot"].shape)
            if abs(size - radius) < 1e-9
        ]
        assert bores
        for point, way in bores:
            assert norm(point[:2]) < 1e-9
            assert abs(way[2]) == pytest.approx(1)

    def test_bought_bodies_have_their_volumes(
        self, things: dict[str, TopoDS_Shape], numbers: FrameLayout
    ) -> None:
        shaft = np.pi * 4**2 * 100
        ring = np.pi * (11**2 - 4**2) * 7
        assert volume(things["shaft"]) == pytest.approx(shaft, rel=1e-9)
        assert volume(things["bearing_front"]) == pytest.approx(ring, rel=1e-9)
        bar = 20 * 20 * numbers.length
        assert volume(things["upright_left"]) == pytest.approx(bar, rel=1e-9)
        length, width, thick = numbers.plate.sizes
        holes = len(numbers.holes) * np.pi * 2.1**2 * thick
        assert volume(things["plate"]) == pytest.approx(length * width * thick - holes, rel=1e-9)

    def test_the_plates_holes_are_below_those_of_the_brackets(
        self, solids: dict[str, PlacedSolid], numbers: FrameLayout
    ) -> None:
        through = [
            (point, radius)
            for part in solids.values()
            for point, way, radius in cylinders(part.shape)
            if abs(way[2]) > 0.999 and abs(radius - 2.75) < 1e-9
        ]
        middles = np.array([point[:2] for point, _ in through])
        for hole in numbers.holes @ numbers.axes[:2, :2]:
            assert norm(middles - hole).min() <= 5 + 1e-9  # half of the slots' travel


class TestClearance:
    def test_nothing_meets_the_base(
        self,
        made: PrototypeLayout,
        carrier: BaseLayout,
        solids: dict[str, PlacedSolid],
        things: dict[str, TopoDS_Shape],
        numbers: FrameLayout,
    ) -> None:
        """Points of the base in many positions, and points of the meshes."""
        still = [part.shape for part in solids.values()]
        still += [things[name] for name in things if name in numbers.swept and name != "camera"]
        mesh = trimesh.util.concatenate([as_trimesh(shape) for shape in still])
        frame_ = carrier.frame
        seat = carrier.seats
        ends = (seat.centre + seat.back[:, None] * seat.axis) @ frame_.T
        outline = np.column_stack([carrier.outline, 0 * carrier.outline[:, 0]])
        found = []
        low, high = made.stops.angle[[0, -1]]
        for angle in np.linspace(low, high, 25).tolist():
            found.append(rotated_about_x(ends, np.full(len(ends), angle)) @ frame_)
            for azimuth in np.linspace(*carrier.sector, 5).tolist():
                found.append(
                    rotated_about_x(outline, np.full(len(outline), azimuth + angle)) @ frame_
                )
        points, _ = trimesh.sample.sample_surface(mesh, 200_000, seed=4)
        away = np.asarray(cKDTree(points).query(np.vstack(found))[0])
        assert away.min() > KEYS.clearance_mm
        assert away.min() < 20

    def test_no_ray_hits_the_frame(
        self,
        made: PrototypeLayout,
        solids: dict[str, PlacedSolid],
        things: dict[str, TopoDS_Shape],
        stand: StageLayout,
    ) -> None:
        shapes = [part.shape for part in solids.values()]
        shapes += [part.shape for part in stages.parts(stand, PRINTER)[1:]]
        shapes += [shape for name, shape in things.items() if name not in ("camera", "shaft")]
        mesh = trimesh.util.concatenate([as_trimesh(shape) for shape in shapes])
        frame_, stops = made.half.ellipsoid.frame(), made.stops
        pinhole = made.half.camera.pinhole
        for mirror in range(len(made.half)):
            ball = int(made.fit.ball[mirror])
            turn = made.placement.azimuth[ball] + stops.angle[stops.stop[mirror]]
            rim = made.balls.outline[ball]
            points = rotated_about_x(rim, np.full(len(rim), turn)) @ frame_
            hits, rays, _ = mesh.ray.intersects_location(points, pinhole - points)
            assert (norm(hits - points[rays]) > norm(pinhole - points[rays])).all()
            # To the capture sphere's near edge, no farther.
            way = -points / norm(points)[:, None]
            hits, rays, _ = mesh.ray.intersects_location(points, way)
            assert (norm(hits - points[rays]) > norm(points[rays]) - 30).all()

    @pytest.mark.parametrize("teeth", [60, 120])
    def test_printed_and_bought_do_not_overlap(
        self,
        made: PrototypeLayout,
        carrier: BaseLayout,
        space: Room,
        stand: StageLayout,
        teeth: int,
    ) -> None:
        drive = next(d for d in load_drives(LISTS) if d.wheel and d.wheel["teeth"] == teeth)
        keys = FrameSpec(clearance_mm=0.5)
        found = frame((keys, SPEC.prototype), made, carrier, stand, drive, space, LISTS)
        static = {part.name: part.shape for part in parts(found, PRINTER)}
        static |= {part.name: part.shape for part in stages.parts(stand, PRINTER)}
        bodies = {name: manifold(shape) for name, shape in (static | dict(bought(found))).items()}
        names = list(bodies)
        for i, one in enumerate(names):
            for other in names[:i]:
                shared = (bodies[one] ^ bodies[other]).volume()
                assert shared < allowed({one, other}), (one, other, shared)


def manifold(shape: TopoDS_Shape) -> Manifold:
    net = meshed(shape, 0.005)
    return Manifold(Mesh64(net.vertices, net.triangles.astype(np.uint64)))


def allowed(pair: set[str]) -> float:
    """Volume that facets of round fits may share, mm^3; a press fit's is meant."""
    if pair in ({"bearing_head", "bearing_front"}, {"bearing_head", "bearing_rear"}):
        return np.pi * 22 * 7 * -KEYS.bearing_fit_mm
    return 2.0


def test_a_bed_too_small_is_refused(numbers: FrameLayout) -> None:
    with pytest.raises(SpecError, match="does not fit on the printer's bed"):
        parts(numbers, PrinterSpec(bed_mm=(90.0, 90.0, 90.0)))


def test_the_same_bytes_twice(numbers: FrameLayout, tmp_path: Path) -> None:
    one, two = (meshed(parts(numbers, PRINTER)[0].shape, 0.05) for _ in range(2))
    assert one.vertices.tobytes() == two.vertices.tobytes()
    assert one.triangles.tobytes() == two.triangles.tobytes()
