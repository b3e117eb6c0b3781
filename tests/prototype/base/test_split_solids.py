"""The base cut up: every figure from the pieces' solids and meshes."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, Mesh64
from OCP.BRepCheck import BRepCheck_Analyzer

from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.glyphs import ROWS, SIGNS, fitting_height
from tbcad.cad.kernel.measures import plane_faces, volume
from tbcad.cad.kernel.meshing import volume_by_meshes
from tbcad.cad.kernel.solids import solids
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.printer import PrinterSpec
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.hub import SCREW_MM
from tbcad.prototype.base.joints import LABEL_MM, Joint
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.screws import joint_hardware
from tbcad.prototype.base.solid import added_solids, carrier_parts, carrier_solid, removed_solids
from tbcad.prototype.base.split import BaseSplit, split_base
from tbcad.prototype.printed import PlacedSolid
from tests.helpers import as_trimesh, bounds, cylinders, manifold

PRINTER = PrinterSpec(bed_mm=(160.0, 160.0, 160.0))
MESH_MM = 0.05
Cylinders = list[tuple[np.ndarray, np.ndarray, float]]
Cut = tuple[BaseLayout, PrinterSpec, BaseSplit, list[PlacedSolid], list[trimesh.Trimesh]]


def cut_up(base: BaseLayout, printer: PrinterSpec) -> Cut:
    plan = split_base(base, printer)
    parts = carrier_parts(base, plan, printer, MESH_MM)
    return base, printer, plan, parts, [as_trimesh(part.shape) for part in parts]


@pytest.fixture(scope="module")
def small(small_prototype: PrototypeLayout) -> Cut:
    return cut_up(base_layout(BaseSpec(), small_prototype), PRINTER)


def check_pieces(cut: Cut) -> None:
    """Each is one watertight solid that fits the bed; no two overlap; all pads are there."""
    _, printer, plan, parts, meshes = cut
    assert [part.name for part in parts] == [f"carrier_{n + 1}" for n in range(len(plan.pieces))]
    for part, mesh in zip(parts, meshes, strict=True):
        assert len(solids(part.shape)) == 1
        assert BRepCheck_Analyzer(part.shape).IsValid()
        assert mesh.is_watertight
        assert mesh.body_count == 1
        assert mesh.volume == pytest.approx(part.volume, rel=1e-3)
        low, high = bounds(part.on_bed)
        assert (high - low <= np.array(printer.bed_mm) - [6, 6, 3]).all()
        assert low[2] == pytest.approx(0, abs=0.5)
    nets = [Manifold(Mesh64(m.vertices, m.faces.astype(np.uint64))) for m in meshes]
    for n, one in enumerate(nets):
        for other in nets[:n]:
            assert (one ^ other).volume() < 0.1
            # They touch.
            assert one.min_gap(other, 1.0) < 1e-3


def check_pads(cut: Cut) -> None:
    base, _, _, parts, _ = cut
    planes = [plane_faces(part.shape) for part in parts]
    middle = np.concatenate([one for one, _ in planes])
    area = np.concatenate([one for _, one in planes])
    for contacts, pad in zip(base.seats.contacts, base.seats.pad, strict=True):
        for contact in contacts:
            near = norm(middle - contact) < 1e-4
            assert area[near] == pytest.approx([np.pi * pad**2], rel=1e-6)


class TestSmall:
    def test_pieces(self, small: Cut) -> None:
        check_pieces(small)

    def test_pads(self, small: Cut) -> None:
        check_pads(small)

    @pytest.mark.slow
    def test_together_they_are_the_whole_with_flanges_and_without_holes(self, small: Cut) -> None:
        base, _, plan, parts, _ = small
        seats = base.local_seats
        added, removed = added_solids(base, seats, plan), removed_solids(base, seats)
        meshes = ([manifold(one, 0.01) for one in some] for some in (added, removed))
        with_flanges = volume_by_meshes(*meshes)
        without = [manifold(one, 0.01) for one in added_solids(base, seats)]
        assert (
            with_flanges
            > volume_by_meshes(without, [manifold(one, 0.01) for one in removed]) + 10_000
        )
        assert volume(carrier_solid(base, MESH_MM, plan)[0]) == pytest.approx(
            with_flanges, rel=2e-4
        )
        # Holes of both sides begin beyond the plane, so each piece has its own taken out.
        assert len(plan.pieces) == 2
        (joint,) = plan.joints
        drilled = sum(part.volume for part in parts)
        assert drilled < with_flanges - hole_volume(base, joint)
        assert drilled > with_flanges - hole_volume(base, joint) - heads_volume(base, joint)

    def test_holes_of_both_sides_are_coaxial(self, small: Cut) -> None:
        base, _, plan, parts, _ = small
        (joint,) = plan.joints
        used, size = base.spec, joint_hardware(base.spec)
        axes = base.axes
        press, slip = used.dowel_mm + used.dowel_press_mm, used.dowel_mm + used.dowel_slip_mm
        sides = {
            -1: cylinders(parts[piece_at(plan, joint, -1)].shape),
            1: cylinders(parts[piece_at(plan, joint, 1)].shape),
        }
        normal = joint.plane.normal @ axes
        for place in joint.dowels @ axes:
            assert on_axis(sides[-1], place, normal) == pytest.approx([press / 2])
            assert on_axis(sides[1], place, normal) == pytest.approx([slip / 2])
        for place, head in zip(joint.screws @ axes, joint.heads.tolist(), strict=True):
            assert on_axis(sides[-head], place, normal) == pytest.approx([used.insert_hole_mm / 2])
            radii = on_axis(sides[head], place, normal)
            assert radii[0] == pytest.approx(SCREW_MM / 2)
            assert radii[-1] <= size.access_radius + 1e-9

    def test_holes_go_as_deep_as_they_must(self, small: Cut) -> None:
        """Straight from the plane into the material, until the mesh is met."""
        base, _, plan, _, meshes = small
        (joint,) = plan.joints
        used, depth = base.spec, joint_hardware(base.spec).dowel_depth
        for side in (-1, 1):
            mesh = meshes[piece_at(plan, joint, side)]
            out = side * joint.plane.normal @ base.axes
            for place in joint.dowels @ base.axes:
                assert first_hit(mesh, place, out) == pytest.approx(depth, abs=1e-4)
            for place, head in zip(joint.screws @ base.axes, joint.heads, strict=True):
                expected = used.insert_depth_mm if side != head else np.inf
                hit = first_hit(mesh, place, out)
                assert hit == pytest.approx(expected, abs=1e-4) if side != head else hit > 25

    def test_each_piece_bears_its_number(self, small: Cut) -> None:
        base, _, plan, _, meshes = small
        (joint,) = plan.joints
        for side, place in zip((-1, 1), joint.labels, strict=True):
            n = piece_at(plan, joint, side)
            out = side * joint.plane.normal @ base.axes
            far = base.spec.joint_mm + base.spec.relief_mm
            top = place @ base.axes + far * out
            mesh = meshes[n]
            flat = np.abs((mesh.triangles - top) @ out).max(axis=1) < 1e-6
            flat &= (mesh.face_normals @ out > 1 - 1e-9) & (norm(mesh.triangles_center - top) < 6)
            square = fitting_height(str(n + 1), base.spec.digit_mm, 0.95 * LABEL_MM) / ROWS
            squares = "".join(SIGNS[str(n + 1)]).count("#")
            assert mesh.area_faces[flat].sum() == pytest.approx(squares * square**2, rel=1e-6)

    def test_no_facet_reaches_into_the_light(self, small: Cut) -> None:
        base, _, _, _, meshes = small
        for mesh in meshes:
            points = np.vstack([mesh.vertices, mesh.triangles_center])
            assert base.light.excess(points @ base.frame.T).min() > 0

    def test_balls_can_be_put_in(self, small: Cut) -> None:
        base, _, _, _, meshes = small
        points = np.vstack([np.vstack([m.vertices, m.triangles_center]) for m in meshes])
        seats = base.seats
        for centre, path, radius in zip(seats.centre, seats.insertion, seats.radius, strict=True):
            distance, length = points - centre, norm(path)
            along = distance @ path / length
            beside = norm(distance - along[:, None] * path / length)
            assert not ((along > 0) & (along < length) & (beside < radius)).any()

    @pytest.mark.slow
    def test_the_same_bytes(self, small: Cut, tmp_path: Path) -> None:
        base, printer, _, parts, _ = small
        rebuilt = carrier_parts(base, split_base(base, printer), printer, MESH_MM)
        for name, again in (("one", parts), ("two", rebuilt)):
            for part in again:
                write_step(tmp_path / f"{name}_{part.name}", Solid(part.name, part.shape, ()))
        for part in parts:
            one, two = (tmp_path / f"{name}_{part.name}" for name in ("one", "two"))
            assert one.read_bytes() == two.read_bytes()


def piece_at(plan: BaseSplit, joint: Joint, side: int) -> int:
    return plan.piece_of(joint.dowels[0] + side * joint.plane.normal)


def hole_volume(base: BaseLayout, joint: Joint) -> float:
    """Of dowels' and screws' holes and of inserts, without what is taken off for the heads."""
    used, depth = base.spec, joint_hardware(base.spec).dowel_depth
    pins = [used.dowel_mm + used.dowel_press_mm, used.dowel_mm + used.dowel_slip_mm]
    dowels = len(joint.dowels) * sum(np.pi / 4 * pin**2 * depth for pin in pins)
    insert = np.pi / 4 * used.insert_hole_mm**2 * used.insert_depth_mm
    through = np.pi / 4 * SCREW_MM**2 * (used.joint_mm - 0.2)
    return float(dowels + len(joint.screws) * (insert + through))


def heads_volume(base: BaseLayout, joint: Joint) -> float:
    """At most all of what is kept clear for the heads."""
    return float(len(joint.screws) * np.pi * joint_hardware(base.spec).access_radius ** 2 * 25.2)


def on_axis(round_faces: Cylinders, at: np.ndarray, along: np.ndarray) -> list[float]:
    """Radii, each once, of the cylinders about a line, the smallest first."""
    return sorted(
        {
            round(radius, 9)
            for point, direction, radius in round_faces
            if abs(abs(direction @ along) - 1) < 1e-12 and norm(np.cross(point - at, along)) < 1e-9
        }
    )


def first_hit(mesh: trimesh.Trimesh, at: np.ndarray, out: np.ndarray) -> float:
    """Distance along a ray to the first facet, infinite where there is none."""
    places, _, _ = mesh.ray.intersects_location([at + 1e-3 * out], [out])
    return float(norm(places - at).min()) if len(places) else float(np.inf)
