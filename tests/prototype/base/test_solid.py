"""The base as solids: every figure from the shape or its mesh, not from how it was built."""

import re

import numpy as np
import pytest
import trimesh

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.cad.kernel.checks import check_pads, check_volume, plane_faces, properties, volume
from tbcad.cad.kernel.glyphs import ROWS, SIGNS, fitting_height, loops, relief
from tbcad.cad.kernel.solids import cut, cylinder, fused, moved, one_solid
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import PrinterSpec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.base import seat_solids
from tbcad.prototype.base.caps import cap_pocket, cap_spigot, cap_tilt, flat_depth
from tbcad.prototype.base.coupon import CouponRow, coupon_plates, coupon_rows, coupon_seats
from tbcad.prototype.base.coupon_seats import (
    KEEL_MM,
    SeatPose,
    core_radius,
    core_top,
    expected_downs,
    height,
    seat_body,
    with_pads,
    worst_pose,
)
from tbcad.prototype.base.hub import KEY_DEPTH_MM, KEY_HOLE_MM, hub_layout
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.seat_solids import cap_parts
from tbcad.prototype.base.solid import carrier_parts, hub_bodies, hub_holes, removed_solids
from tbcad.prototype.base.split import UNCUT, downward_directions, split_base
from tbcad.prototype.print_bed import usable_size
from tbcad.prototype.printed import PlacedSolid, placed_on_bed
from tests.helpers import as_trimesh, bounds

UP = np.array([0.0, 0.0, 1.0])
SPEC = BaseSpec(coupon_offsets_mm=(-0.1, 0.2), coupon_sizes=99)
PRINTER = PrinterSpec()
MESH_MM = 0.05


@pytest.fixture(scope="module")
def prototype(small_design: MirrorDesign) -> PrototypeLayout:
    options = ["n=6", "prototype.k=4", "prototype.snap=nearest", "prototype.largest_ball_mm=50"]
    options += ["prototype.grade=G40"]
    return prototype_layout(load_spec(None, options), small_design)


@pytest.fixture(scope="module")
def base(prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(SPEC, prototype)


@pytest.fixture(scope="module")
def part(base: BaseLayout) -> PlacedSolid:
    (only,) = carrier_parts(base, split_base(base, PRINTER), PRINTER, MESH_MM)
    return only


@pytest.fixture(scope="module")
def mesh(part: PlacedSolid) -> trimesh.Trimesh:
    return as_trimesh(part.shape)


def in_plane(mesh: trimesh.Trimesh, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Facets that lie in a plane and look along its normal."""
    distance = np.abs((mesh.triangles - point) @ normal).max(axis=1)
    return (distance < 1e-6) & (mesh.face_normals @ normal > 1 - 1e-9)


class TestCarrier:
    def test_solid_and_mesh_are_watertight_exact_and_on_the_bed(
        self, part: PlacedSolid, mesh: trimesh.Trimesh
    ) -> None:
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.body_count == 1
        assert mesh.volume == pytest.approx(part.volume, rel=1e-3)
        assert part.mass_g(1.27) == pytest.approx(part.volume * 1.27e-3)
        corners = part.mesh.vertices[part.mesh.triangles]
        assert trimesh.Trimesh(*trimesh.triangles.to_kwargs(corners).values()).is_watertight
        # Between chords on hollows and on bosses.
        assert abs(part.mesh.volume - part.volume) < MESH_MM * part.properties.area / 10
        on_bed = part.mesh_on_bed
        assert on_bed.volume == pytest.approx(part.mesh.volume)
        low, high = bounds(moved(part.shape, part.axes, part.origin))
        assert on_bed.vertices[:, 2].min() == pytest.approx(0, abs=1e-9)
        assert on_bed.vertices.min(axis=0) == pytest.approx(low, abs=MESH_MM)
        assert on_bed.vertices.max(axis=0) == pytest.approx(high, abs=MESH_MM)
        # Properties were integrated before it was moved there.
        expected = properties(part.shape)
        assert part.volume == pytest.approx(expected.volume, rel=1e-9)
        assert part.properties.area == pytest.approx(expected.area, rel=1e-9)
        assert part.properties.centroid == pytest.approx(expected.centroid, abs=1e-6)

    def test_balls_have_room_and_can_be_put_in(
        self, base: BaseLayout, mesh: trimesh.Trimesh
    ) -> None:
        points, _ = trimesh.sample.sample_surface(mesh, 200_000, seed=1)
        points, seats = np.vstack([points, mesh.vertices]), base.seats
        for k, path in enumerate(seats.insertion):
            offset = points - seats.centre[k]
            room = norm(offset) - seats.radius[k]
            at_pad = norm(points[:, None] - seats.contacts[k]).min(axis=1)
            at_pad = at_pad < seats.pad[k] + SPEC.clearance_mm
            assert room[~at_pad].min() > SPEC.clearance_mm - 0.03
            length = norm(path)
            along = offset @ path / length
            beside = norm(offset - along[:, None] * path / length)
            assert not ((along > 0) & (along < length) & (beside < seats.radius[k] - 1e-6)).any()

    def test_numbers_stand_on_the_bosses(self, base: BaseLayout, mesh: trimesh.Trimesh) -> None:
        seats = base.seats
        for k in range(len(seats)):
            top = seats.centre[k] + (seats.back[k] + SPEC.relief_mm) * seats.axis[k]
            near = norm(mesh.triangles_center - top) < seats.boss[k]
            area = mesh.area_faces[in_plane(mesh, top, seats.axis[k]) & near].sum()
            square = fitting_height(str(k + 1), SPEC.digit_mm, 0.85 * seats.boss[k]) / ROWS
            squares = "".join(SIGNS[str(k + 1)]).count("#")
            assert area == pytest.approx(squares * square**2, rel=1e-6)

    def test_the_hub_is_about_the_axis(self, base: BaseLayout, mesh: trimesh.Trimesh) -> None:
        local = mesh.vertices @ base.frame.T
        assert local[:, 0].min() == pytest.approx(base.hub.face)
        bore = np.isclose(norm(local[:, 1:]), SPEC.shaft_mm / 2)
        assert bore.sum() > 40

    def test_a_bed_too_small(self, base: BaseLayout, part: PlacedSolid) -> None:
        small = PrinterSpec(bed_mm=(120.0, 120.0, 120.0))
        turned = part.shape, part.mesh, part.properties, downward_directions(base, np.zeros((0, 4)))
        with pytest.raises(SpecError, match=r"make printer\.bed_mm at least \d+ x \d+") as caught:
            placed_on_bed("carrier", *turned, np.eye(3), small)
        bed = [
            float(size) for size in re.findall(r"least (\d+) x (\d+) x (\d+)", str(caught.value))[0]
        ]
        assert placed_on_bed("carrier", *turned, np.eye(3), PrinterSpec(bed_mm=tuple(bed)))


class TestHub:
    @pytest.mark.parametrize(
        ("drive", "lock"),
        [("nema17-belt", "clamp"), ("nema17-direct", "set-screws"), ("stage-60", "clamp")],
    )
    def test_every_drive(self, drive: str, lock: str) -> None:
        keys = BaseSpec.model_validate({"drive": drive, "lock": lock})
        hub = hub_layout(keys, -60.0)
        solid = one_solid("hub", cut(fused(hub_bodies(hub)), hub_holes(hub, keys)))
        assert as_trimesh(solid).is_watertight
        assert bounds(solid)[:, 2] == pytest.approx([hub.face, hub.front])
        if drive == "stage-60":
            thick = hub.front - hub.face
            hole = 3.3**2 * (thick - 6.5) + 5.5**2 * 6.5
            key = (KEY_HOLE_MM / 2) ** 2 * KEY_DEPTH_MM
            expected = np.pi * (hub.disc**2 * thick - 4.0**2 * thick - 4 * hole - key)
            assert volume(solid) == pytest.approx(expected)


def test_caps(base: BaseLayout, prototype: PrototypeLayout) -> None:
    parts, seats, balls = cap_parts(base, prototype, MESH_MM), base.seats, prototype.balls
    assert len(parts) == balls.cap.sum() > 0
    for k, cap in zip(np.flatnonzero(balls.cap).tolist(), parts, strict=True):
        body, front = float(balls.body_radius[k]), float(balls.radius[k])
        # Its volume in closed form.
        edge, behind = body / np.sqrt(2), flat_depth(base, k)
        drop = front - np.sqrt(front**2 - edge**2)
        lens = np.pi * drop**2 * (3 * front - drop) / 3
        zone = np.pi * (body**2 * (behind + edge) - (behind**3 + edge**3) / 3)
        wide, deep = cap_pocket(base, k, float(balls.body_depth[k]))
        spigot, end = cap_spigot(base, k)
        spigots = np.pi * spigot**2 * (end - behind)
        assert cap.volume == pytest.approx(lens + zone + spigots - np.pi * wide**2 * deep)
        # Printed front up.
        low, high = bounds(moved(cap.shape, cap.axes, cap.origin))
        assert [low[2], high[2]] == pytest.approx([0, end + balls.body_depth[k]], abs=1e-6)
        # Tilted by cap_tilt the spigot's edge just touches the pocket, and nothing behind it.
        sine, cosine = np.sin(cap_tilt(base, k)), np.cos(cap_tilt(base, k))
        assert spigot * cosine + end * sine == pytest.approx(seats.pocket[k], abs=2e-3)
        assert end * cosine - spigot * sine < seats.radius[k] + base.spec.magnet_gap_mm
        assert np.degrees(cap_tilt(base, k)) < 0.5
        # It rests on the pads, clear of its flat.
        along = dot(seats.contacts[k] - seats.centre[k], seats.axis[k])
        assert along == pytest.approx(np.full(3, np.cos(seats.tilt) * seats.radius[k]))
        assert (along + seats.pad[k] * np.sin(seats.tilt)).max() < flat_depth(base, k)
    glued = base_layout(BaseSpec(hold="glue"), prototype)
    assert cap_pocket(glued, 0, 5.0) == (0.0, 0.0)
    assert as_trimesh(cap_parts(glued, prototype, MESH_MM)[0].shape).is_watertight


@pytest.fixture(scope="module")
def plates(base: BaseLayout, part: PlacedSolid) -> list[PlacedSolid]:
    """Seats as they lie in the carrier as it is printed."""
    return coupon_plates(base, PRINTER, worst_pose(base, UNCUT, [-part.axes[:, 2]]), MESH_MM)


def pose_of(base: BaseLayout) -> SeatPose:
    """Of the seat that is expected to be printed worst in an uncut carrier."""
    return worst_pose(base, UNCUT, expected_downs(base, UNCUT))


def rows_of(base: BaseLayout, spec: BaseSpec = SPEC) -> list[CouponRow]:
    pose = pose_of(base)
    return coupon_rows(coupon_seats(base, pose), spec, PRINTER, pose.lean)


class TestCoupon:
    def test_a_seat_lies_on_the_bed_whole_round_its_pads_and_empty_between_them(
        self, base: BaseLayout
    ) -> None:
        """Behind each pad is the carrier's wall, as far beside it as it is thick."""
        spec, pose = base.spec, pose_of(base)
        seats = coupon_seats(base, pose)
        for k in (int(seats.radius.argmax()), int(seats.radius.argmin())):
            solid = as_trimesh(with_pads(seat_body(seats, spec, k, pose, 0.0), seats, k, 0.0, pose))
            bed = height(seats, spec, k, pose)
            assert solid.bounds[0, 2] == pytest.approx(-bed, abs=1e-6)
            keel = np.abs(solid.vertices[:, 0]) < KEEL_MM / 2 + 1e-6
            assert solid.vertices[~keel, 2].min() == pytest.approx(-bed, abs=0.3)
            beside = (seats.pad[k] + 0.9 * spec.cup_wall_mm) * np.linspace(-1, 1, 9)
            deep = float(seats.cup[k]) + spec.cup_wall_mm * np.array([0.1, 0.9])
            for normal in seats.local_normals[k]:
                across = unit(np.cross(normal, UP))
                points = [-d * normal + b * across for d in deep for b in beside]
                points = [at * deep.max() / max(norm(at), deep.max()) for at in points]
                assert solid.contains(np.array(points) @ pose.axes).all()
            middle = deep.mean() * -seats.local_normals[k] * [-1, -1, 1]
            between = norm(middle[:, :2]).min() > core_radius(seats, spec, k)
            assert solid.contains(middle @ pose.axes).all() != between

    def test_the_cup_ends_legs_before_the_core(self, base: BaseLayout) -> None:
        """Where legs met just outside the core, a sliver of 0.03 mm was left (n = 24)."""
        seats, spec = coupon_seats(base, pose_of(base)), base.spec
        for k in range(len(seats)):
            legs = (seats.pad[k] + spec.cup_wall_mm) / np.sin(np.pi / 3)
            core, top = core_radius(seats, spec, k), core_top(seats, spec, k)
            cup = np.sqrt(max(seats.cup[k] ** 2 - top**2, 0.0))
            assert core >= seats.boss[k] or (core > legs + 1 and cup > legs - 1e-9)

    def test_every_size_has_pads_at_every_offset(
        self, base: BaseLayout, plates: list[PlacedSolid]
    ) -> None:
        """A seat's pads are sqrt(3) sin(tilt) times the radius of the sphere in it apart."""
        seats = base.seats
        rows = rows_of(base)
        assert len(rows) == len(np.unique(np.round(seats.radius, 6)))
        planes = [plane_faces(plate.shape) for plate in plates]
        middle = np.concatenate([one + 1e4 * n for n, (one, _) in enumerate(planes)])
        area = np.concatenate([one for _, one in planes])
        for row in rows:
            pads = middle[np.isclose(area, np.pi * seats.pad[row.seat] ** 2, rtol=1e-6)]
            distance = norm(pads[:, None] - pads)
            for offset in SPEC.coupon_offsets_mm:
                apart = np.sqrt(3) * np.sin(seats.tilt) * (seats.radius[row.seat] + offset)
                assert (np.abs(distance - apart) < 1e-6).sum() == 6
        sizes = len(rows) * len(SPEC.coupon_offsets_mm)
        assert np.isin(np.round(area, 5), np.round(np.pi * seats.pad**2, 5)).sum() == 3 * sizes

    def test_seats_lie_as_the_carriers_worst(self, base: BaseLayout, part: PlacedSolid) -> None:
        """Every seat's pads are as steep on the bed as those of the carrier's seat that is."""
        steep = np.sort((base.seats.pad_normals @ part.axes)[..., 2], axis=1)
        down = (base.seats.axis @ part.axes)[:, 2]  # -1: the seat is upright
        tied = np.flatnonzero(steep[:, 0] < steep[:, 0].min() + 1e-6)
        pose = worst_pose(base, UNCUT, [-part.axes[:, 2]])
        found = coupon_seats(base, pose).local_normals @ pose.axes
        worst = steep[tied[np.argmax(down[tied])]]
        assert np.sort(found[..., 2], axis=1) == pytest.approx(np.tile(worst, (len(steep), 1)))

    def test_a_few_sizes_reach_from_the_largest_to_the_smallest(self, base: BaseLayout) -> None:
        seats = base.seats
        for count in (1, 2, 3):
            rows = rows_of(base, BaseSpec(coupon_sizes=count))
            tried = list(dict.fromkeys(seats.radius[row.seat] for row in rows))
            assert len(tried) == count
            for row in rows:  # by the diameter that is on it
                assert float(row.name) == pytest.approx(2 * seats.radius[row.seat], abs=0.006)
            assert tried == sorted(tried, reverse=True)
            assert tried[0] == seats.radius.max()
            assert count == 1 or tried[-1] == seats.radius.min()
        with pytest.raises(SpecError, match=r"make printer\.bed_mm larger or"):
            coupon_plates(base, PrinterSpec(bed_mm=(40.0, 40.0, 100.0)), pose_of(base), MESH_MM)

    def test_the_carriers_pads_are_moved_by_the_spec(self, prototype: PrototypeLayout) -> None:
        """A tool with the pads' posts left out reaches farther by the offset, and no less."""
        near, far = (base_layout(BaseSpec(pad_offset_mm=by), prototype) for by in (0.0, 0.2))
        seats, normal = near.seats, near.seats.pad_normals[0, 0]
        plane = seats.centre[0] - (seats.radius[0] + 0.2) * normal
        for base, found in ((near, 0.0), (far, np.pi * seats.pad[0] ** 2)):
            tool = as_trimesh(removed_solids(base, base.seats)[0])
            area = tool.area_faces[in_plane(tool, plane, -normal)].sum()
            assert area == pytest.approx(found, rel=0.02, abs=1e-6)

    def test_a_row_wider_than_the_bed_becomes_several(self, prototype: PrototypeLayout) -> None:
        """Every offset of a size has one seat, and no row is wider than the bed."""
        offsets = tuple(0.1 * k for k in range(9))
        base = base_layout(BaseSpec(coupon_offsets_mm=offsets), prototype)
        rows = rows_of(base, base.spec)
        assert max(row.size[0] for row in rows) <= usable_size(PRINTER)[0]
        for seat in {row.seat for row in rows}:
            parts = [row.offsets for row in rows if row.seat == seat]
            assert sum(parts, ()) == offsets
        assert len(rows) > len({row.seat for row in rows})


def test_signs_are_solids_and_holes_are_loops() -> None:
    for sign in SIGNS:
        (solid,) = relief(sign, 5.0, 0.6, 0.4, np.eye(3), np.zeros(3))
        assert volume(one_solid(sign, solid)) == pytest.approx("".join(SIGNS[sign]).count("#"))
        assert properties(solid).centroid[2] == pytest.approx(0.1)
    assert [len(loop) for loop in loops(SIGNS["8"])] == [4, 4, 4]


def test_a_lost_pad_is_noticed(base: BaseLayout) -> None:
    seats = base.seats
    boss, pads = seat_solids.boss_solid(seats, 0), np.full(3, seats.pad[0])
    whole = cut(boss, [seat_solids.seat_hollow(seats, 0)])
    contacts = -(seats.radius[0] + seats.pad_offset) * seats.local_normals[0]
    inward = -seats.local_normals[0][2]
    check_pads("seat", whole, contacts, pads)
    check_pads("seat", whole, contacts[:0], pads[:0])
    damaged = cut(whole, [cylinder(contacts[1] + 0.5 * UP, UP, 1.0, 5.0)])
    pierced = cut(whole, [cylinder(contacts[2] - 0.5 * inward, inward, 0.2, 1.0)])
    for lost, shape in ((1, boss), (2, damaged), (3, pierced)):
        with pytest.raises(InvalidSolidError, match=f"the kernel lost pad {lost}"):
            check_pads("seat", shape, contacts, pads)
    with pytest.raises(InvalidSolidError, match=r"carrier: the kernel made \d+ mm\^3 of \d+"):
        check_volume("carrier", 100.0, 101.0)
