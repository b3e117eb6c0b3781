"""How the base is cut for the bed: planes, holes, what is bought and refused, and the pieces."""

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, Mesh64
from OCP.BRepCheck import BRepCheck_Analyzer

from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.checks import plane_faces, volume
from tbcad.cad.kernel.glyphs import ROWS, SIGNS, fitting_height
from tbcad.cad.kernel.meshing import mesh_difference
from tbcad.cad.kernel.solids import fused, moved, solids
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.design import PrinterSpec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.hub import SCREW_MM
from tbcad.prototype.base.joints import LABEL_MM, flange_profile, joint_hardware
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.profile import distance_outside
from tbcad.prototype.base.solid import added_solids, carrier_parts, carrier_solid, removed_solids
from tbcad.prototype.base.split import UNCUT, BaseSplit, split_base
from tbcad.prototype.base.split_solids import piece_holes
from tbcad.prototype.printed import PlacedSolid
from tbcad.prototype.purchased.parts import load_parts
from tests.helpers import as_trimesh, bounds, cylinders, manifold

SPEC = BaseSpec()
PRINTER = PrinterSpec(bed_mm=(160.0, 160.0, 160.0))
MESH_MM = 0.05
CutUp = tuple[BaseLayout, BaseSplit, list[PlacedSolid], list[trimesh.Trimesh]]


def cube(size: float) -> PrinterSpec:
    return PrinterSpec(bed_mm=(size, size, size))


def split_at(prototype: PrototypeLayout, bed: float, count: int) -> tuple[BaseLayout, BaseSplit]:
    base = base_layout(SPEC, prototype)
    plan = split_base(base, cube(bed))
    assert len(plan.pieces) == count
    return base, plan


@pytest.fixture(
    scope="module",
    params=[
        ("small_prototype", 130.0, 3),
        pytest.param(("small_prototype", 150.0, 2), marks=pytest.mark.slow),
        pytest.param(("paper_prototype", 200.0, 2), marks=pytest.mark.slow),
    ],
    ids=["small in three", "small in two", "paper in two"],
)
def cut_base(request: pytest.FixtureRequest) -> tuple[BaseLayout, BaseSplit]:
    name, bed, count = request.param
    return split_at(request.getfixturevalue(name), bed, count)


def rims(base: BaseLayout) -> np.ndarray:
    """Points round both ends of all bosses, (k, 2, n, 3)."""
    seats, angle = base.local_seats, np.linspace(0, 2 * np.pi, 90)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    around = seats.boss[:, None, None] * (circle @ seats.axes)
    ends = np.stack([seats.front, seats.back], axis=1)[..., None] * seats.axis[:, None]
    return (seats.centre[:, None] + ends)[:, :, None] + around[:, None]


@pytest.mark.slow
class TestPlanes:
    def test_a_base_that_fits_stays_whole(
        self, small_prototype: PrototypeLayout, paper_prototype: PrototypeLayout
    ) -> None:
        for one in (small_prototype, paper_prototype):
            plan = split_base(base_layout(SPEC, one), PrinterSpec())
            assert not plan.joints
            assert [len(piece) for piece in plan.pieces] == [0]

    def test_no_boss_is_cut(self, cut_base: tuple[BaseLayout, BaseSplit]) -> None:
        base, plan = cut_base
        corners = rims(base).reshape(len(base.seats), -1, 3)
        for joint in plan.joints:
            inside = (corners @ joint.region[:, :3].T <= joint.region[:, 3]).all(axis=(1, 2))
            distance = joint.plane.height(corners[inside])
            assert ((distance.min(axis=1) > 0.99) | (distance.max(axis=1) < -0.99)).all()
            assert (distance.min(axis=1) > 0).any()
            assert (distance.max(axis=1) < 0).any()

    def test_pieces_fill_space_once_with_the_hub_whole_in_the_first(
        self, cut_base: tuple[BaseLayout, BaseSplit]
    ) -> None:
        base, plan = cut_base
        hub, angle = base.hub, np.linspace(0, 2 * np.pi, 60)
        for z in (hub.face, hub.front):
            rim = np.stack([hub.disc * np.cos(angle), hub.disc * np.sin(angle), 0 * angle + z], 1)
            assert {plan.piece_of(point) for point in rim} == {0}
        points = np.random.default_rng(1).normal(size=(3000, 3)) * 150
        inside = [(points @ one[:, :3].T < one[:, 3]).all(axis=1) for one in plan.pieces]
        assert (np.sum(inside, axis=0) == 1).all()
        assert all(one.any() for one in inside)

    def test_a_bed_too_small_names_one_that_does(self, small_prototype: PrototypeLayout) -> None:
        with pytest.raises(SpecError, match=r"make printer\.bed_mm at least") as caught:
            split_base(base_layout(SPEC, small_prototype), PrinterSpec(bed_mm=(135.0, 135.0, 60.0)))
        (bed,) = re.findall(r"least (\d+) x (\d+) x (\d+)", str(caught.value))
        width, depth, height = map(float, bed)
        larger = PrinterSpec(bed_mm=(width, depth, height))
        assert len(split_base(base_layout(SPEC, small_prototype), larger).pieces) == 2


class TestJoints:
    def test_holes_are_apart_in_the_flanges_and_off_all_seats(
        self, cut_base: tuple[BaseLayout, BaseSplit]
    ) -> None:
        base, plan = cut_base
        seat, used = base.local_seats, base.spec
        for joint in plan.joints:
            assert len(joint.dowels) == 2 <= len(joint.screws)
            places = np.vstack([joint.dowels, joint.screws])
            assert np.abs(joint.plane.height(places)).max() < 1e-9
            apart = norm(places[:, None] - places) + 99 * np.eye(len(places))
            assert apart.min() >= 8.0
            assert norm(joint.dowels[1] - joint.dowels[0]) > 40
            along = np.linspace(-used.joint_mm, used.joint_mm, 40)[:, None, None]
            axes = places + along * joint.plane.normal
            at = np.stack([axes[..., 2], norm(axes[..., :2])], axis=-1)
            assert distance_outside(base.inner, at).min() > used.insert_hole_mm / 2 + 1
            offset = axes[..., None, :] - seat.centre
            assert (norm(offset) - seat.cup).min() > used.insert_hole_mm / 2 + 1
            # And beside the magnets.
            deep = (offset * seat.axis).sum(axis=-1)
            beside = norm(offset - deep[..., None] * seat.axis) - seat.pocket
            assert (beside[(deep > 0) & (deep < seat.back)] > used.insert_hole_mm / 2 + 1).all()

    def test_heads_are_reached_from_outside(self, cut_base: tuple[BaseLayout, BaseSplit]) -> None:
        base, plan = cut_base
        free = joint_hardware(base.spec).access_radius
        assert free > 5.5 / 2
        for joint in plan.joints:
            for place, side in zip(joint.screws, joint.heads, strict=True):
                steps = base.spec.joint_mm + np.linspace(0, 25, 60)
                axis = place + side * steps[:, None] * joint.plane.normal
                at = np.stack([axis[:, 2], norm(axis[:, :2])], axis=-1)
                assert distance_outside(base.outer, at).min() > 5.5 / 2
                for rim, up in zip(rims(base), base.local_seats.axis, strict=True):
                    ends = rim.mean(axis=1)
                    deep = np.clip((axis - ends[0]) @ up, 0, (ends[1] - ends[0]) @ up)
                    distance = norm(axis - ends[0] - deep[:, None] * up)
                    assert distance.min() > norm(rim[0, 0] - ends[0]) + 5.5 / 2 - 0.1

    def test_flanges_are_behind_the_light(self, cut_base: tuple[BaseLayout, BaseSplit]) -> None:
        base, line = cut_base[0], flange_profile(cut_base[0])
        parts = np.stack([line, np.roll(line, -1, axis=0)], axis=1)
        assert base.light.min_excess(parts).min() > 0
        assert line[:, 1].min() > base.hub.disc

    def test_holes_are_coaxial_and_go_as_deep_as_they_must(
        self, cut_base: tuple[BaseLayout, BaseSplit]
    ) -> None:
        """What is cut out of each piece, straight from the planes."""
        base, plan = cut_base
        used, size = base.spec, joint_hardware(base.spec)
        tools = [cylinders(fused(piece_holes(base, plan, n))) for n in range(len(plan.pieces))]
        for joint in plan.joints:
            normal = joint.plane.normal
            for side, play in ((-1, used.dowel_press_mm), (1, used.dowel_slip_mm)):
                n = plan.piece_of(joint.dowels[0] + side * normal)
                ends = [mesh_ends(base, plan, n, at, side * normal) for at in joint.dowels]
                assert ends == pytest.approx([size.dowel_depth] * 2, abs=1e-4)
                for place in joint.dowels:
                    radii = on_axis(tools[n], place, normal)
                    assert radii == pytest.approx([(used.dowel_mm + play) / 2])
                for place, head in zip(joint.screws, joint.heads.tolist(), strict=True):
                    radii = on_axis(tools[n], place, normal)
                    if head == side:
                        assert radii[0] == pytest.approx(SCREW_MM / 2)
                        assert radii[-1] == pytest.approx(size.access_radius)
                    else:
                        assert radii == pytest.approx([used.insert_hole_mm / 2])
                        end = mesh_ends(base, plan, n, place, side * normal)
                        assert end == pytest.approx(used.insert_depth_mm, abs=1e-4)

    def test_sizes_are_in_the_lists_or_refused(self, small_prototype: PrototypeLayout) -> None:
        hardware, parts = joint_hardware(SPEC), load_parts()
        assert parts[hardware.dowel].sizes == (3.0, 12.0)
        assert hardware.dowel_depth + 1 <= SPEC.joint_mm
        length = parts[hardware.screw].sizes[1]
        # 1.3 diameters in the insert, and not through its hole.
        assert 1.3 * 3 <= length - SPEC.joint_mm <= SPEC.insert_depth_mm
        cases = {
            r"prototype\.base\.joint_mm at least 7\.2": {"joint_mm": 6.0},
            "no dowel of 5 mm is at most 13 mm long": {"dowel_mm": 5.0},
            r"no M3 screw is 31 to 33\.2 mm long": {"joint_mm": 27.0},
        }
        for text, changed in cases.items():
            spec = BaseSpec.model_validate(SPEC.model_dump() | changed)
            with pytest.raises(SpecError, match=text):
                split_base(base_layout(spec, small_prototype), cube(150.0))


def on_axis(
    round_faces: list[tuple[np.ndarray, np.ndarray, float]], at: np.ndarray, along: np.ndarray
) -> list[float]:
    """Radii, each once, of the cylinders about a line, the smallest first."""
    return sorted(
        {
            round(radius, 9)
            for point, direction, radius in round_faces
            if abs(abs(direction @ along) - 1) < 1e-12 and norm(np.cross(point - at, along)) < 1e-9
        }
    )


def mesh_ends(base: BaseLayout, plan: BaseSplit, n: int, at: np.ndarray, out: np.ndarray) -> float:
    """Distance along a ray from a plane to the end of what is cut out of a piece there."""
    (hole,) = (
        mesh
        for mesh in (as_trimesh(one) for one in piece_holes(base, plan, n))
        if mesh.contains([at + 0.1 * out]).all()
    )
    return float(((hole.vertices - at) @ out).max())


@pytest.fixture(scope="module")
def cut_up(small_prototype: PrototypeLayout) -> CutUp:
    base, plan = split_at(small_prototype, PRINTER.bed_mm[0], 2)
    parts = carrier_parts(base, plan, PRINTER, MESH_MM)
    return base, plan, parts, [as_trimesh(part.shape) for part in parts]


@pytest.mark.slow
class TestPieces:
    def test_each_is_a_whole_solid_on_the_bed_with_its_number(self, cut_up: CutUp) -> None:
        base, plan, parts, meshes = cut_up
        assert [part.name for part in parts] == ["carrier_1", "carrier_2"]
        for part, mesh in zip(parts, meshes, strict=True):
            assert len(solids(part.shape)) == 1
            assert BRepCheck_Analyzer(part.shape).IsValid()
            assert mesh.is_watertight
            assert mesh.body_count == 1
            assert mesh.volume == pytest.approx(part.volume, rel=1e-3)
            low, high = bounds(moved(part.shape, part.axes, part.origin))
            assert (high - low <= np.array(PRINTER.bed_mm) - [6, 6, 3]).all()
            assert low[2] == pytest.approx(0, abs=0.5)
            points = np.vstack([mesh.vertices, mesh.triangles_center])
            assert base.light.excess(points @ base.frame.T).min() > 0
        one, other = (Manifold(Mesh64(m.vertices, m.faces.astype(np.uint64))) for m in meshes)
        assert (one ^ other).volume() < 0.1
        assert one.min_gap(other, 1.0) < 1e-3  # they touch
        planes = [plane_faces(part.shape) for part in parts]
        middle, area = (np.concatenate(each) for each in zip(*planes, strict=True))
        for contacts, pad in zip(base.seats.contacts, base.seats.pad, strict=True):
            for contact in contacts:
                near = norm(middle - contact) < 1e-4
                assert area[near] == pytest.approx([np.pi * pad**2], rel=1e-6)
        (joint,) = plan.joints
        for side, place in zip((-1, 1), joint.labels, strict=True):
            n = plan.piece_of(joint.dowels[0] + side * joint.plane.normal)
            out, mesh = side * joint.plane.normal @ base.axes, meshes[n]
            top = place @ base.axes + (base.spec.joint_mm + base.spec.relief_mm) * out
            flat = np.abs((mesh.triangles - top) @ out).max(axis=1) < 1e-6
            flat &= (mesh.face_normals @ out > 1 - 1e-9) & (norm(mesh.triangles_center - top) < 6)
            square = fitting_height(str(n + 1), base.spec.digit_mm, 0.95 * LABEL_MM) / ROWS
            squares = "".join(SIGNS[str(n + 1)]).count("#")
            assert mesh.area_faces[flat].sum() == pytest.approx(squares * square**2, rel=1e-6)

    def test_together_they_are_the_whole_with_flanges_and_without_holes(
        self, cut_up: CutUp
    ) -> None:
        base, plan, parts, _ = cut_up
        seats, (joint,) = base.local_seats, plan.joints
        removed = [manifold(one, 0.01) for one in removed_solids(base, seats)]
        added = (added_solids(base, seats, by) for by in (plan, UNCUT))
        whole, without = (
            mesh_difference([manifold(one, 0.01) for one in some], removed).volume()
            for some in added
        )
        assert whole > without + 10_000
        assert volume(carrier_solid(base, MESH_MM, plan)[0]) == pytest.approx(whole, rel=2e-4)
        # Holes of both sides begin beyond the plane, so each piece has its own taken out.
        used, size = base.spec, joint_hardware(base.spec)
        pins = [used.dowel_mm + used.dowel_press_mm, used.dowel_mm + used.dowel_slip_mm]
        holes = len(joint.dowels) * sum(np.pi / 4 * pin**2 * size.dowel_depth for pin in pins)
        insert = np.pi / 4 * used.insert_hole_mm**2 * used.insert_depth_mm
        through = np.pi / 4 * SCREW_MM**2 * (used.joint_mm - 0.2)
        holes += len(joint.screws) * (insert + through)
        heads = len(joint.screws) * np.pi * size.access_radius**2 * 25.2  # all, at most
        drilled = sum(part.volume for part in parts)
        assert whole - holes - heads < drilled < whole - holes

    def test_the_same_bytes(self, cut_up: CutUp, tmp_path: Path) -> None:
        base, _, parts, _ = cut_up
        rebuilt = carrier_parts(base, split_base(base, PRINTER), PRINTER, MESH_MM)
        for some, name in ((parts, "one"), (rebuilt, "two")):
            for part in some:
                write_step(tmp_path / f"{name}_{part.name}", Solid(part.name, part.shape, ()))
        for part in parts:
            one, two = (tmp_path / f"{name}_{part.name}" for name in ("one", "two"))
            assert one.read_bytes() == two.read_bytes()
