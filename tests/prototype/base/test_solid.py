"""The base as solids: every figure from the shape or its mesh, not from how it was built."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from OCP.BRep import BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.Geom import Geom_SphericalSurface

from tbcad.cad.brep import InvalidSolidError, Solid
from tbcad.cad.checks import check_pads, check_volume
from tbcad.cad.glyphs import ROWS, SIGNS, fitting_height, loops, relief
from tbcad.cad.solids import (
    bounds,
    centroid,
    cut,
    cylinder,
    faces,
    fused,
    one_solid,
    plane_faces,
    volume,
    volume_by_meshes,
)
from tbcad.formats.step import write_step
from tbcad.geometry.vectors import dot, norm
from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.base import hub_solids as hubs
from tbcad.prototype.base import seat_solids as seat
from tbcad.prototype.base.cap_solids import cap_parts, cap_pocket, flat_depth
from tbcad.prototype.base.coupon import _wall_section as seat_section
from tbcad.prototype.base.coupon import coupon_plates, coupon_rows
from tbcad.prototype.base.hub import hub_layout
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.solid import added_solids, carrier_parts, removed_solids
from tbcad.prototype.base.split import downward_directions, split_base
from tbcad.prototype.printing.placing import PlacedSolid, placed_on_bed
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec
from tbcad.spec.printer import PrinterSpec
from tbcad.spec.prototype import BaseSpec
from tests.helpers import as_trimesh

UP = np.array([0.0, 0.0, 1.0])
KEYS = BaseSpec(coupon_offsets_mm=(-0.1, 0.2))
PRINTER = PrinterSpec()


@pytest.fixture(scope="module")
def prototype(small_design: MirrorDesign) -> PrototypeLayout:
    options = ["n=6", "prototype.k=4", "prototype.snap=nearest", "prototype.largest_ball_mm=50"]
    return prototype_layout(load_spec(None, options), small_design)


@pytest.fixture(scope="module")
def numbers(prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(KEYS, prototype)


@pytest.fixture(scope="module")
def part(numbers: BaseLayout) -> PlacedSolid:
    (only,) = carrier_parts(numbers, split_base(numbers, PRINTER), PRINTER)
    return only


@pytest.fixture(scope="module")
def mesh(part: PlacedSolid) -> trimesh.Trimesh:
    return as_trimesh(part.shape)


def in_plane(mesh: trimesh.Trimesh, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Facets that lie in a plane and look along its normal."""
    away = np.abs((mesh.triangles - point) @ normal).max(axis=1)
    return (away < 1e-6) & (mesh.face_normals @ normal > 1 - 1e-9)


def quartered(corners: np.ndarray) -> np.ndarray:
    half = (corners + np.roll(corners, -1, axis=1)) / 2
    tips = np.stack([corners, half, np.roll(half, 1, axis=1)], axis=2).reshape(-1, 3, 3)
    return np.concatenate([tips, half])


class TestCarrier:
    def test_it_is_watertight(self, part: PlacedSolid, mesh: trimesh.Trimesh) -> None:
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.body_count == 1
        assert mesh.volume == pytest.approx(part.volume, rel=1e-3)
        assert part.volume > 50_000
        assert part.mass_g(1.27) == pytest.approx(part.volume * 1.27e-3)

    def test_ball_centres_are_recovered_from_the_pads(
        self, numbers: BaseLayout, prototype: PrototypeLayout, mesh: trimesh.Trimesh
    ) -> None:
        centre, radius = prototype.body_centres(), prototype.balls.body_radius
        for k, (contacts, normals) in enumerate(
            zip(numbers.seats.contacts, numbers.seats.pad_normals, strict=True)
        ):
            planes = []
            for contact, normal in zip(contacts, normals, strict=True):
                near = np.abs(mesh.triangles_center - contact).max(axis=1) < 3
                points = mesh.triangles[in_plane(mesh, contact, normal) & near].reshape(-1, 3)
                assert len(points) >= 30
                middle = points.mean(axis=0)
                found = np.linalg.svd(points - middle)[2][2]
                found *= np.sign(found @ normal)
                planes.append((found, found @ middle + radius[k]))
            recovered = np.linalg.solve([n for n, _ in planes], [d for _, d in planes])
            assert norm(recovered - centre[k]) < 1e-3

    def test_pads_are_whole(self, numbers: BaseLayout, mesh: trimesh.Trimesh) -> None:
        areas = mesh.area_faces
        for contacts, normals, pad in zip(
            numbers.seats.contacts, numbers.seats.pad_normals, numbers.seats.pad, strict=True
        ):
            for contact, normal in zip(contacts, normals, strict=True):
                near = norm(mesh.triangles_center - contact) < pad
                area = areas[in_plane(mesh, contact, normal) & near].sum()
                assert area == pytest.approx(np.pi * pad**2, rel=0.02)

    def test_balls_touch_nothing_but_their_pads(
        self, numbers: BaseLayout, prototype: PrototypeLayout, mesh: trimesh.Trimesh
    ) -> None:
        points, _ = trimesh.sample.sample_surface(mesh, 200_000, seed=1)
        points = np.vstack([points, mesh.vertices])
        for contacts, centre, pad, radius in zip(
            numbers.seats.contacts,
            prototype.body_centres(),
            numbers.seats.pad,
            prototype.balls.body_radius,
            strict=True,
        ):
            room = norm(points - centre) - radius
            at_pad = norm(points[:, None] - contacts).min(axis=1) < pad + KEYS.clearance_mm
            assert room.min() > -1e-6
            assert room[~at_pad].min() > KEYS.clearance_mm - 0.03

    def test_no_facet_reaches_into_the_light(
        self, numbers: BaseLayout, mesh: trimesh.Trimesh
    ) -> None:
        corners = mesh.triangles @ numbers.frame.T
        for _ in range(4):
            # The bound is below all of a facet; where it is too low, of its quarters.
            corners = quartered(corners[numbers.light.min_excess(corners) < 0])
        assert not len(corners)
        assert numbers.light.excess(mesh.vertices @ numbers.frame.T).min() > 0

    def test_volume_against_booleans_of_meshes(
        self, numbers: BaseLayout, part: PlacedSolid
    ) -> None:
        """The kernel's booleans can lose a piece and pass for valid; other booleans tell."""
        seats = numbers.local_seats
        added, removed = added_solids(numbers, seats), removed_solids(numbers, seats)
        assert part.volume == pytest.approx(volume_by_meshes(added, removed, 0.01), rel=2e-4)
        with pytest.raises(InvalidSolidError, match=r"carrier: the kernel made \d+ mm\^3 of \d+"):
            check_volume("carrier", part.shape, part.volume * 1.01)

    def test_balls_can_be_put_in(self, numbers: BaseLayout, mesh: trimesh.Trimesh) -> None:
        points = np.vstack([mesh.vertices, mesh.triangles_center])
        found = numbers.seats
        for centre, way, radius in zip(found.centre, found.insertion, found.radius, strict=True):
            length = norm(way)
            away = points - centre
            along = away @ way / length
            beside = norm(away - along[:, None] * way / length)
            inside = (along > 0) & (along < length) & (beside < radius)
            assert not inside.any()

    def test_numbers_stand_on_the_bosses(self, numbers: BaseLayout, mesh: trimesh.Trimesh) -> None:
        found = numbers.seats
        for k in range(len(found)):
            top = found.centre[k] + (found.back[k] + KEYS.relief_mm) * found.axis[k]
            near = norm(mesh.triangles_center - top) < found.boss[k]
            area = mesh.area_faces[in_plane(mesh, top, found.axis[k]) & near].sum()
            square = fitting_height(str(k + 1), KEYS.digit_mm, 0.85 * found.boss[k]) / ROWS
            squares = "".join(SIGNS[str(k + 1)]).count("#")
            assert area == pytest.approx(squares * square**2, rel=1e-6)

    def test_nothing_stands_over_the_numbers(
        self, numbers: BaseLayout, mesh: trimesh.Trimesh
    ) -> None:
        found = numbers.seats
        turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        for k in range(len(found)):
            rings = [
                share * found.boss[k] * np.array([np.cos(turn), np.sin(turn)]).T
                for share in (0.3, 0.6, 0.9)
            ]
            start = found.centre[k] + (found.back[k] + KEYS.relief_mm + 0.01) * found.axis[k]
            points = start + np.vstack(rings) @ found.axes[k, :2]
            ways = np.broadcast_to(found.axis[k], points.shape)
            assert not mesh.ray.intersects_any(points, ways).any()

    def test_the_hub_is_about_the_axis(self, numbers: BaseLayout, mesh: trimesh.Trimesh) -> None:
        local = mesh.vertices @ numbers.frame.T
        assert local[:, 0].min() == pytest.approx(numbers.hub.face)
        bore = np.isclose(norm(local[:, 1:]), KEYS.shaft_mm / 2)
        assert bore.sum() > 40

    def test_it_is_laid_on_the_bed(self, part: PlacedSolid) -> None:
        low, high = bounds(part.on_bed)
        assert low[2] == pytest.approx(0, abs=0.5)
        assert (high - low <= np.array(PRINTER.bed_mm) - [6, 6, 3]).all()
        assert volume(part.on_bed) == pytest.approx(part.volume)

    def test_a_bed_too_small(self, numbers: BaseLayout, part: PlacedSolid) -> None:
        small = PrinterSpec(bed_mm=(120.0, 120.0, 120.0))
        with pytest.raises(SpecError, match=r"make printer\.bed_mm at least \d+ x \d+") as said:
            placed_on_bed(
                "carrier",
                part.shape,
                downward_directions(numbers, np.zeros((0, 4))),
                np.eye(3),
                small,
            )
        bed = [
            float(size) for size in re.findall(r"least (\d+) x (\d+) x (\d+)", str(said.value))[0]
        ]
        assert placed_on_bed(
            "carrier",
            part.shape,
            downward_directions(numbers, np.zeros((0, 4))),
            np.eye(3),
            PrinterSpec(bed_mm=tuple(bed)),
        )

    def test_the_same_bytes(self, numbers: BaseLayout, part: PlacedSolid, tmp_path: Path) -> None:
        (rebuilt,) = carrier_parts(numbers, split_base(numbers, PRINTER), PRINTER)
        for name, again in (("one", part), ("two", rebuilt)):
            write_step(tmp_path / name, Solid(again.name, again.shape, ()))
        assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_booleans_in_parallel_give_the_same_bytes(
    numbers: BaseLayout, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Faces come in the same order, in two threads or one, by oriented boxes or plain ones."""
    found = numbers.local_seats

    def step(name: str) -> bytes:
        bosses = [
            seat.moved_to_seat(seat.boss_solid(found, k), found, k) for k in range(len(found))
        ]
        rod = cylinder(np.array([0.0, 0.0, -300.0]), UP, 200.0, 600.0)
        solid = one_solid("block", cut(fused([rod, *bosses]), removed_solids(numbers, found)))
        write_step(tmp_path / name, Solid("block", solid, ()))
        return (tmp_path / name).read_bytes()

    first = step("one")
    used: list[str] = []
    for kind in (BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse):
        monkeypatch.setattr(f"tbcad.cad.solids.{kind.__name__}", plain(kind, used))
    assert step("two") == first
    assert {"SetRunParallel", "SetUseOBB"} <= set(used)


def plain(kind: type, used: list[str]) -> type:
    """A boolean that leaves these settings off, and notes that it was asked for them."""
    settings = {
        name: lambda _self, _on, name=name: used.append(name)
        for name in ("SetRunParallel", "SetUseOBB")
    }
    return type(kind.__name__, (kind,), settings)


class TestSeat:
    def test_volume_against_a_closed_form(self, numbers: BaseLayout) -> None:
        found = numbers.seats
        for k in range(len(found)):
            cup, pad, radius, pocket_radius = (
                float(value[k]) for value in (found.cup, found.pad, found.radius, found.pocket)
            )
            front, back, bottom = (
                float(value[k]) for value in (found.front, found.back, found.bottom)
            )
            low = np.sqrt(cup**2 - pocket_radius**2)
            zone = np.pi * (cup**2 * (low - front) - (low**3 - front**3) / 3)
            well = np.pi * pocket_radius**2 * (bottom - low)
            post = 2 * np.pi / 3 * (cup**3 - (cup**2 - pad**2) ** 1.5) - np.pi * pad**2 * radius
            whole = np.pi * float(found.boss[k]) ** 2 * (back - front)
            solid = one_solid("seat", cut(seat.boss_solid(found, k), [seat.seat_hollow(found, k)]))
            assert volume(solid) == pytest.approx(whole - zone - well + 3 * post, rel=1e-6)


class TestHub:
    @pytest.mark.parametrize("lock", ["set-screws", "clamp"])
    @pytest.mark.parametrize("drive", ["nema17-belt", "nema17-direct", "stage-60"])
    def test_every_drive(self, drive: str, lock: str) -> None:
        keys = BaseSpec.model_validate({"drive": drive, "lock": lock})
        held = hub_layout(keys, -60.0)
        solid = one_solid("hub", cut(fused(hubs.hub_bodies(held)), hubs.hub_holes(held, keys)))
        assert as_trimesh(solid).is_watertight
        assert bounds(solid)[:, 2] == pytest.approx([held.face, held.front])

    def test_volume_of_a_stages_hub(self) -> None:
        keys = BaseSpec(drive="stage-60")
        held = hub_layout(keys, -60.0)
        solid = cut(fused(hubs.hub_bodies(held)), hubs.hub_holes(held, keys))
        thick = held.front - held.face
        hole = 3.3**2 * (thick - 6.5) + 5.5**2 * 6.5
        expected = np.pi * (held.disc**2 * thick - 4.0**2 * thick - 4 * hole)
        assert volume(solid) == pytest.approx(expected)


class TestCaps:
    def test_fronts_and_bodies_are_exact_spheres(
        self, numbers: BaseLayout, prototype: PrototypeLayout
    ) -> None:
        parts = cap_parts(numbers, prototype)
        assert len(parts) == prototype.balls.cap.sum() > 0
        for k, found in zip(np.flatnonzero(prototype.balls.cap), parts, strict=True):
            spheres = {}
            for face in faces(found.shape):
                surface = BRep_Tool.Surface_s(face)
                if isinstance(surface, Geom_SphericalSurface):
                    middle = surface.Location()
                    spheres[round(surface.Radius(), 6)] = [middle.X(), middle.Y(), middle.Z()]
            assert sorted(spheres) == pytest.approx(
                [prototype.balls.body_radius[k], prototype.balls.radius[k]]
            )
            first, second = (spheres[size] for size in sorted(spheres))
            assert first == pytest.approx(prototype.body_centres()[k], abs=1e-9)
            assert second == pytest.approx(prototype.centres()[k], abs=1e-9)

    def test_volume_against_a_closed_form(
        self, numbers: BaseLayout, prototype: PrototypeLayout
    ) -> None:
        for k, found in zip(
            np.flatnonzero(prototype.balls.cap), cap_parts(numbers, prototype), strict=True
        ):
            body, front = float(prototype.balls.body_radius[k]), float(prototype.balls.radius[k])
            edge, behind = body / np.sqrt(2), flat_depth(numbers, k)
            drop = front - np.sqrt(front**2 - edge**2)
            lens = np.pi * drop**2 * (3 * front - drop) / 3
            zone = np.pi * (body**2 * (behind + edge) - (behind**3 + edge**3) / 3)
            wide, deep = cap_pocket(numbers, k, float(prototype.balls.body_depth[k]))
            assert found.volume == pytest.approx(lens + zone - np.pi * wide**2 * deep)

    def test_they_are_watertight_and_printed_front_up(
        self, numbers: BaseLayout, prototype: PrototypeLayout
    ) -> None:
        for k, found in zip(
            np.flatnonzero(prototype.balls.cap), cap_parts(numbers, prototype), strict=True
        ):
            whole = as_trimesh(found.shape)
            assert whole.is_watertight
            assert (norm(whole.vertices - prototype.apices()[k])).min() < 1e-6
            low, high = bounds(found.on_bed)
            assert low[2] == pytest.approx(0, abs=1e-6)
            assert high[2] == pytest.approx(flat_depth(numbers, k) + prototype.balls.body_depth[k])

    def test_they_rest_on_the_pads(self, numbers: BaseLayout, prototype: PrototypeLayout) -> None:
        for k in np.flatnonzero(prototype.balls.cap).tolist():
            along = dot(numbers.seats.contacts[k] - numbers.seats.centre[k], numbers.seats.axis[k])
            steep = np.cos(numbers.seats.tilt)
            assert along == pytest.approx(np.full(3, steep * numbers.seats.radius[k]))
            edge = along + numbers.seats.pad[k] * np.sin(numbers.seats.tilt)
            assert edge.max() < flat_depth(numbers, k)

    def test_glued_caps_have_no_pocket(self, prototype: PrototypeLayout) -> None:
        glued = base_layout(BaseSpec(hold="glue"), prototype)
        assert cap_pocket(glued, 0, 5.0) == (0.0, 0.0)
        assert as_trimesh(cap_parts(glued, prototype)[0].shape).is_watertight


@pytest.fixture(scope="module")
def plates(numbers: BaseLayout) -> list[PlacedSolid]:
    return coupon_plates(numbers, PRINTER)


class TestCoupon:
    def test_they_fit_and_are_watertight(self, plates: list[PlacedSolid]) -> None:
        for plate in plates:
            assert as_trimesh(plate.shape).is_watertight
            assert (np.ptp(bounds(plate.shape), axis=0) < 256).all()

    def test_every_size_has_pads_at_every_offset(
        self, numbers: BaseLayout, plates: list[PlacedSolid]
    ) -> None:
        """A seat's pads are sqrt(3) sin(tilt) times the radius of the sphere in it apart."""
        found = numbers.seats
        rows = coupon_rows(found, KEYS)
        assert len(rows) == len(np.unique(np.round(found.radius, 6)))
        planes = [plane_faces(plate.shape) for plate in plates]
        middle = np.concatenate([one + 1e4 * n for n, (one, _) in enumerate(planes)])
        area = np.concatenate([one for _, one in planes])
        for row in rows:
            pads = middle[np.isclose(area, np.pi * found.pad[row.seat] ** 2, rtol=1e-6)]
            away = norm(pads[:, None] - pads)
            for offset in KEYS.coupon_offsets_mm:
                apart = np.sqrt(3) * np.sin(found.tilt) * (found.radius[row.seat] + offset)
                assert (np.abs(away - apart) < 1e-6).sum() == 6
        sizes = len(rows) * len(KEYS.coupon_offsets_mm)
        assert np.isin(np.round(area, 5), np.round(np.pi * found.pad**2, 5)).sum() == 3 * sizes

    def test_walls_are_thick_enough(self, numbers: BaseLayout, plates: list[PlacedSolid]) -> None:
        """Nowhere from a cup or pocket outward is there less than on the carrier."""
        found = numbers.seats
        for k in range(len(found)):
            wall = seat_section(replace(found, back=found.bottom + KEYS.floor_mm), KEYS, k)
            ends = np.stack([wall, np.roll(wall, -1, axis=0)], axis=1)[:-1]
            outer = ends[(ends[..., 1] > 0).any(axis=1)][1:]
            along = np.linspace(outer[:, 0], outer[:, 1], 50).reshape(-1, 2)
            deep = along[along[:, 0] > found.front[k]]
            assert norm(deep).min() > found.cup[k] + 0.6 * KEYS.cup_wall_mm
            pocket = deep[deep[:, 0] < found.bottom[k]]
            assert pocket[:, 1].min() >= found.pocket[k] + KEYS.cup_wall_mm - 1e-9
            assert deep[:, 0].max() == pytest.approx(found.bottom[k] + KEYS.floor_mm)

    def test_it_takes_less_than_the_carrier(
        self, plates: list[PlacedSolid], part: PlacedSolid
    ) -> None:
        assert sum(plate.volume for plate in plates) < part.volume / 3

    def test_offsets_move_the_pads(self, numbers: BaseLayout) -> None:
        found = numbers.seats
        shapes = [
            cut(seat.boss_solid(found, 0), [seat.seat_hollow(found, 0, by)]) for by in (0.0, 0.2)
        ]
        pad, normal = found.pad[0], found.local_normals[0, 0]
        for shape, by in zip(shapes, (0.0, 0.2), strict=True):
            plane = -(found.radius[0] + by) * normal
            solid = as_trimesh(shape)
            area = solid.area_faces[in_plane(solid, plane, normal)].sum()
            assert area == pytest.approx(np.pi * pad**2, rel=0.02)

    def test_a_row_larger_than_the_bed(self, prototype: PrototypeLayout) -> None:
        crowded = base_layout(BaseSpec(coupon_offsets_mm=(0.1,) * 9), prototype)
        with pytest.raises(SpecError, match=r"make printer\.bed_mm larger or"):
            coupon_plates(crowded, PrinterSpec(bed_mm=(100.0, 100.0, 100.0)))


class TestRelief:
    @pytest.mark.parametrize("sign", SIGNS)
    def test_signs_are_solids(self, sign: str) -> None:
        (solid,) = relief(sign, 5.0, 0.6, 0.4, np.eye(3), np.zeros(3))
        squares = "".join(SIGNS[sign]).count("#")
        assert volume(one_solid(sign, solid)) == pytest.approx(squares)
        assert centroid(solid)[2] == pytest.approx(0.1)

    def test_holes_are_loops(self) -> None:
        assert [len(loop) for loop in loops(SIGNS["8"])] == [4, 4, 4]


def test_several_solids_are_refused() -> None:
    apart = fused([cylinder(x * np.eye(3)[0], UP, 1.0, 1.0) for x in (0.0, 5.0)])
    with pytest.raises(InvalidSolidError, match="2 solids where one should be"):
        one_solid("pair", apart)


def test_a_lost_pad_is_noticed(numbers: BaseLayout) -> None:
    found = numbers.seats
    whole = cut(seat.boss_solid(found, 0), [seat.seat_hollow(found, 0)])
    contacts = -found.radius[0] * found.local_normals[0]
    pads = np.full(3, found.pad[0])
    check_pads("seat", whole, contacts, pads)
    damaged = cut(whole, [cylinder(contacts[1] + 0.5 * UP, UP, 1.0, 5.0)])
    with pytest.raises(InvalidSolidError, match="the kernel lost pad 2"):
        check_pads("seat", damaged, contacts, pads)
