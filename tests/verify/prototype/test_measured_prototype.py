"""The figures behind the checks, against closed forms, brute force and other algorithms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from scipy.spatial.transform import Rotation
from tbcad_verify.mesh.mesh import Mesh, join_meshes, mass_properties
from tbcad_verify.mesh.stl import parse
from tbcad_verify.mesh.surfaces import nearest_on_rays
from tbcad_verify.mesh.vectors import cross, dot, norm
from tbcad_verify.prototype import balls_apart, bodies, sag_checks, seats, swing
from tbcad_verify.prototype.assembly import assembly_meshes, part_step_checks
from tbcad_verify.prototype.bodies import MeasuredPrototype, measure_prototype
from tbcad_verify.prototype.caps import measure_cap
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.light import ball_views, pinhole_cells, windows
from tbcad_verify.prototype.measured_parts import MeasuredPart, measure_part, of_roles
from tbcad_verify.record.export import read_export
from tbcad_verify.record.files import read
from tbcad_verify.record.prototype import RECORD, SagTable
from tbcad_verify.report.checks import check_names
from tbcad_verify.run.kept import Shared, Store, keeping
from tbcad_verify.run.processes import Processes
from tbcad_verify.step.step_file import StepFile, examine_all, load, read_step_files
from tbcad_verify.types import Floats

from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Solid
from tests.verify.corpus.mutation import at
from tests.verify.prototype import synthetic_prototype
from tests.verify.prototype.synthetic_prototype import (
    SyntheticPrototype,
    export,
    make_balls,
    shell_of,
    turned,
)
from tests.verify.synthetic_export import Cells, poses, sign


def context_of(folder: Path) -> PrototypeContext:
    record = read_export(folder)
    assert record.prototype is not None
    return PrototypeContext(record, record.prototype)


def parts_of(context: PrototypeContext) -> list[MeasuredPart]:
    folder = context.export.folder
    return [measure_part(part, parse(read(folder, part.stl))) for part in context.prototype.parts]


def base_of(context: PrototypeContext) -> Mesh:
    return join_meshes([part.placed_mesh for part in of_roles(parts_of(context), "base")])


def measured_of(context: PrototypeContext) -> MeasuredPrototype:
    parts = parts_of(context)
    held = seats.measure_seats(context, base_of(context))
    caps = [measure_cap(context, one) for one in of_roles(parts, "cap")]
    return measure_prototype(context, held, caps, parts, assembly_meshes(context))


@pytest.fixture(scope="module")
def context(synthetic_prototype: Path) -> PrototypeContext:
    return context_of(synthetic_prototype)


@pytest.fixture(scope="module")
def measured(context: PrototypeContext) -> MeasuredPrototype:
    return measured_of(context)


def test_centres_are_where_the_pads_were_put(measured: MeasuredPrototype) -> None:
    expected = make_balls(SyntheticPrototype())
    np.testing.assert_allclose(measured.body.T, [ball.b for ball in expected], atol=1e-5)
    np.testing.assert_allclose(measured.centre.T, [ball.c for ball in expected], atol=2e-4)
    np.testing.assert_allclose(measured.radius, [ball.radius for ball in expected], atol=2e-4)


def test_a_moved_pad_moves_the_centre_as_in_closed_form(tmp_path: Path) -> None:
    """The centre moves along the line that both other planes leave it."""
    context = context_of(export(tmp_path / "x", SyntheticPrototype(pads={(1, 2): 0.02})))
    base = base_of(context)
    ball = make_balls(SyntheticPrototype())[1]
    shift = np.linalg.solve(ball.normals, [0, 0, -0.02])
    np.testing.assert_allclose(
        seats.measure_seats(context, base)[1].centre, ball.b + shift, atol=1e-5
    )
    assert np.linalg.norm(shift) > 0.02


def test_balls_touch_pads_in_the_middle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disc's radius, less the half of it that must be left to its edge."""
    pad = 1.6
    monkeypatch.setattr(synthetic_prototype, "PAD", pad)
    context = context_of(export(tmp_path / "x", SyntheticPrototype()))
    margins = [seat.margin for seat in seats.measure_seats(context, base_of(context))]
    np.testing.assert_allclose(margins, pad / 4, rtol=0.02)


@pytest.mark.parametrize(("away", "passes"), [(2.9, False), (3.1, True)])
def test_balls_keep_the_wall_between_them(
    measured: MeasuredPrototype, away: float, passes: bool
) -> None:
    """Of two balls of 5 mm, one beside the other, and two far away."""
    body = np.array([[0.0, 0, 0], [10 + away, 0, 0], [99, 0, 0], [0, 99, 0]]).T
    some = replace(measured, body=body, body_radius=np.full(4, 5.0))
    (check,) = balls_apart.checks(check_names(balls_apart.CHECKS, "x.stl"), some)
    assert (check.passed, check.measured) == (passes, pytest.approx(away))


def test_a_mean_is_over_the_pictures_of_each_ball(context: PrototypeContext) -> None:
    """By a sum over the rows of the plan."""
    plan, stops = context.prototype.plan, len(context.prototype.stops)
    moved = np.random.default_rng(3).standard_normal((stops, len(context.prototype.balls), 3))
    found = sag_checks._mean(context, moved)
    for ball in set(plan.ball.tolist()):
        mine = plan.stop[plan.ball == ball] - 1
        assert found[ball - 1] == pytest.approx(moved[mine, ball - 1].mean(axis=0))


def test_balls_are_where_weight_brings_them_from_their_seats(measured: MeasuredPrototype) -> None:
    """Seats as they were measured, with a weight that the record knows or not."""
    (name,) = check_names({"balls under weight": "mm"}, "sag.csv")
    sag = np.tile([[0.3], [0.0], [-0.6]], measured.seated.shape[1])
    assert sag_checks._beside(name, measured.context, measured, 0.0).passed
    wrong = sag_checks._beside(name, measured.context, measured, sag)
    assert (wrong.passed, wrong.measured) == (False, pytest.approx(np.hypot(0.3, 0.6), abs=1e-4))
    there = replace(measured, seated=measured.seated - sag)
    assert sag_checks._beside(name, measured.context, there, sag).passed


def test_pads_are_found_without_the_contacts_being_right(context: PrototypeContext) -> None:
    base = base_of(context)
    recorded = context.prototype
    moved = [
        seat.model_copy(update={"contacts": seat.contacts + 0.3 * seat.axis})
        for seat in recorded.seats
    ]
    near = replace(context, prototype=recorded.model_copy(update={"seats": moved}))
    centres = [seat.centre for seat in seats.measure_seats(near, base)]
    np.testing.assert_allclose(centres, recorded.balls.columns("bx", 3).T, atol=1e-5)


def test_outlines_are_those_of_cells_cut_by_hand(context: PrototypeContext) -> None:
    """`Cells` goes through all pairs of cutting planes, with no camera."""
    design = shell_of(SyntheticPrototype())
    hand = Cells(design, poses(design))
    found = pinhole_cells.cell_outlines(pinhole_cells.mirror_spheres(context))
    for k, outline in hand.outlines.items():
        # What lies on the seam is no edge of a halved mirror.
        points = np.array(
            [point for point, other in outline if other != -1 or not context.halved[k]]
        )
        d = points.T - context.pinhole[:, None]
        chief = np.repeat(found.chief[:, [k]], d.shape[1], axis=1)
        first, second = pinhole_cells.tangent_basis(chief)
        angle = np.arctan2(norm(cross(chief, d)), dot(chief, d))
        turn = np.arctan2((second * d).sum(axis=0), (first * d).sum(axis=0)) % (2 * np.pi)
        low = (
            np.floor(turn / (2 * np.pi) * pinhole_cells.OUTLINE_DIRECTIONS).astype(int)
            % pinhole_cells.OUTLINE_DIRECTIONS
        )
        both = np.stack([low, (low + 1) % pinhole_cells.OUTLINE_DIRECTIONS])
        own = found.is_edge[k, both].all(axis=0)
        near, far = found.angle[k, both].min(axis=0)[own], found.angle[k, both].max(axis=0)[own]
        assert own.sum() > 20
        assert (angle[own] > 0.998 * near).all()
        assert (angle[own] < 1.08 * far).all()  # a corner between two directions stands out


@pytest.mark.parametrize("rays_together", [1, 80])
def test_first_mirrors_by_brute_force(context: PrototypeContext, rays_together: int) -> None:
    """Of rays that go everywhere, and of bundles, for which most mirrors are out of reach."""
    shell, random = pinhole_cells.mirror_spheres(context), np.random.default_rng(3)
    d = random.normal(size=(3, 4000 // rays_together)) + np.array([[-1.0], [0], [2]])
    d = d.repeat(rays_together, axis=1) + 0.03 * random.normal(size=(3, 4000))
    found = pinhole_cells.first_mirrors(shell, d)
    assert (found >= 0).sum() > 100
    for k in range(0, 4000, 7):
        unit = d[:, k] / np.linalg.norm(d[:, k])
        best, which = np.inf, -1
        for j in range(shell.radius.size):
            away = shell.pinhole - shell.centre[:, j]
            b, c = away @ unit, away @ away - shell.radius[j] ** 2
            if b < 0 and b * b > c and -b - np.sqrt(b * b - c) < best:
                best, which = -b - np.sqrt(b * b - c), j
        point = shell.pinhole + best * unit if which >= 0 else np.full(3, np.nan)
        good = which >= 0 and point[0] >= 0 and point[2] >= shell.foot
        assert found[k] == (which if good else -1)


def hung(measured: MeasuredPrototype, moved: Floats) -> MeasuredPrototype:
    """The same with displacements (S, K, 3) by weight, in the ground's frame, mm."""
    stop, ball = np.indices(moved.shape[:2]).reshape(2, -1) + 1
    columns = [moved[..., x].ravel() for x in range(3)] + [np.zeros(stop.size)] * 12
    names = list(SagTable.model_fields)[2:]
    table = SagTable.model_construct(stop=stop, ball=ball, **dict(zip(names, columns, strict=True)))
    record = measured.context.prototype.model_copy(update={"sag": table})
    return replace(measured, context=replace(measured.context, prototype=record))


def places(measured: MeasuredPrototype) -> Floats:
    """Balls in their seats at the stops, (S, K, 3)."""
    angles = measured.context.prototype.stops.angle.tolist()
    return np.stack([turned(measured.seated.T, angle) for angle in angles])


def coverage_of(measured: MeasuredPrototype) -> Floats:
    cells = pinhole_cells.cell_outlines(pinhole_cells.mirror_spheres(measured.context))
    transfer = windows.ray_transfer(measured)
    return ball_views._coverage(transfer, *ball_views.ended_on_balls(transfer, cells))


def test_the_window_goes_along_with_its_ball(
    context: PrototypeContext, measured: MeasuredPrototype
) -> None:
    """Each mirror's middle is moved to its ball's highlight, which shows the origin."""
    shell = pinhole_cells.mirror_spheres(context)
    chief = pinhole_cells.cell_outlines(shell).chief
    moved = np.random.default_rng(1).normal(0, 0.5, places(measured).shape)
    for some, tolerance in ((measured, 0.02), (hung(measured, moved), 1e-9)):
        transfer = windows.ray_transfer(some)
        _, lines = transfer.reflected(np.arange(chief.shape[1]), chief)
        away = nearest_on_rays(lines)
        assert np.linalg.norm(away, axis=0).max() < tolerance
    apex = context.prototype.balls.columns("px", 3)[:, context.ball]
    there = context.base_rotation(context.angle).apply(apex.T).T
    _, lines = windows.ray_transfer(measured).reflected(np.arange(chief.shape[1]), chief)
    np.testing.assert_allclose(lines.point, there, atol=0.02)


def test_a_base_that_yields_about_its_axis_shows_the_same(measured: MeasuredPrototype) -> None:
    """Pinhole and object lie on the axis, so all but the picture's turn stays, to first order."""
    moved = np.cross(3e-4 * measured.context.frame[0], places(measured))
    assert np.linalg.norm(moved, axis=2).max() > 0.02
    assert coverage_of(hung(measured, moved)) == pytest.approx(coverage_of(measured), abs=3e-3)


def test_caps_that_turn_too_much_show_too_little(
    context: PrototypeContext, measured: MeasuredPrototype
) -> None:
    """At one stop alone, and a flat cap, whose sphere's centre is far behind its seat."""
    cap = int(context.prototype.balls.cap.argmax())
    normal, radius = context.prototype.balls.columns("nx", 3), measured.radius.copy()
    radius[cap] = 60.0
    centre = measured.centre + (measured.radius - radius) * normal
    flat = replace(measured, radius=radius, centre=centre)
    before, moved = coverage_of(flat), np.zeros(places(flat).shape)
    here = context.stop == context.stop[context.ball == cap][0]
    moved[context.stop[here]] = -0.06 * np.cross(context.frame[2], places(flat)[context.stop[here]])
    after = coverage_of(hung(flat, moved))
    assert after[~here] == pytest.approx(before[~here], abs=1e-9)
    assert (after[here] < before[here] - 0.1).all()


def test_coverage_by_rays_on_a_fine_outline(
    context: PrototypeContext, measured: MeasuredPrototype
) -> None:
    """One mirror by a plain loop over many directions; weight moves balls, and turns the cap."""
    seats = places(measured)
    rigid = np.array([0.01, -0.005, 0.0075])
    rest = np.random.default_rng(2).normal(0, 0.05, seats.shape)
    for k, place in enumerate(seats):  # of which no motion is left
        motion = bodies.rigid_motions(place)
        rest[k] -= (motion @ np.linalg.pinv(motion) @ rest[k].ravel()).reshape(-1, 3)
    some = hung(measured, np.cross(rigid, seats) + rest)
    covered, transfer = coverage_of(some), windows.ray_transfer(some)
    edge = pinhole_cells.cell_outlines(pinhole_cells.mirror_spheres(context))
    for i in (5, 20, 40):
        ball, stop, angle = (int(context.ball[i]), int(context.stop[i]), context.angle[i])
        sphere = make_balls(SyntheticPrototype())[ball]
        arm = Rotation.from_rotvec(rigid).apply(turned(sphere.c - sphere.b, np.degrees(angle)))
        centre = (seats + np.cross(rigid, seats) + rest)[stop, ball] + arm
        least = np.inf
        middle = transfer.merged[:, :, i] @ edge.chief[:, i]
        for d in edge.direction[:, i].T[edge.is_edge[i]]:
            way = transfer.merged[:, :, i] @ d
            away = context.pinhole - centre
            b, c = way @ away, away @ away - sphere.radius**2
            while b * b <= c:  # beside the ball: back to where it ends
                way = way + 1e-4 * (middle - way)
                way /= np.linalg.norm(way)
                b = way @ away
            point = context.pinhole + (-b - np.sqrt(b * b - c)) * way
            normal = (point - centre) / sphere.radius
            out = way - 2 * (way @ normal) * normal
            at = point + max(-(point @ out), 0) * out
            least = min(least, 2 * float(np.linalg.norm(at)))
        assert covered[i] == pytest.approx(least, rel=5e-3)


@pytest.mark.parametrize(("turn", "meets"), [(0.0, True), (170.0, False)])
def test_no_step_of_the_swing_is_too_large(
    measured: MeasuredPrototype, turn: float, meets: bool
) -> None:
    """A rod that the base passes at one angle only is found, whichever has more facets."""
    import manifold3d

    rows = measured.context.frame
    arm = manifold3d.Manifold.cube([100.0, 2.0, 2.0]).translate([0, 80, 0])
    arm = arm.transform(np.hstack([rows[[1, 2, 0]].T, np.zeros((3, 1))]))
    at = turned(rows.T @ np.array([0.3, 85.0, 80.7]), turn)
    rod = manifold3d.Manifold.cube([0.4, 0.4, 0.4]).translate(at - np.array([0.2, 0.2, 0.2]))
    one, two = (
        swing.sweep(
            swing.swing_ends(measured),
            swing.axial_solid(measured, "arm", moving),
            swing.axial_solid(measured, "rod", still),
        )
        for moving, still in ((arm.refine(3), rod), (arm, rod.refine(3)))
    )
    assert (one.volume > swing.TOUCH_MM3) == meets
    assert one.samples == two.samples > 5
    assert (one.volume, one.gap, one.at) == pytest.approx((two.volume, two.gap, two.at), abs=1e-6)


def random_body(rng: np.random.Generator) -> Any:
    """A block, a ball, or a tube about the axis, within 60 mm of the origin."""
    import manifold3d

    size = rng.uniform(3, 30, 3)
    if rng.random() < 0.3:
        tube = manifold3d.Manifold.cylinder(size[0], 30 + size[1], center=True)
        return tube - manifold3d.Manifold.cylinder(100.0, 15 + size[1], center=True)
    block = manifold3d.Manifold.cube(size, center=True).rotate(rng.uniform(0, 90, 3))
    ball = manifold3d.Manifold.sphere(size[0] / 2, 24)
    return (ball if rng.random() < 0.3 else block).translate(rng.uniform(-45, 45, 3))


def test_sweeps_past_the_same_solids_are_kept(measured: MeasuredPrototype, tmp_path: Path) -> None:
    import manifold3d

    def swept(
        shift: float, ends: tuple[float, float] = (0.0, 1.0), moving: float = 80.0
    ) -> list[swing.PairSweep]:
        arm, rod = (manifold3d.Manifold.cube([size, 2.0, 2.0]) for size in (90.0, 3.0))
        one, two = (
            swing.axial_solid(measured, "body", solid.translate([0, shift, 0]))
            for solid, shift in ((arm, moving), (rod, shift))
        )
        return swing.sweeps_past(two, Shared([one]), ends)

    expected = swept(84.0)
    for settings, again in (((84.0,), False), ((84.0,), True), ((84.1,), False)):
        with keeping(store := Store(tmp_path, "code")):
            assert (swept(*settings) == expected) == (settings == (84.0,))
        assert bool(store.reused) == again
    with keeping(store := Store(tmp_path, "code")):
        swept(84.0, (0.0, 1.1))
        swept(84.0, moving=80.1)
    assert not store.reused


@pytest.mark.parametrize("seed", range(4))
def test_a_swing_is_that_of_many_angles(measured: MeasuredPrototype, seed: int) -> None:
    """Against booleans at 21 angles."""
    rng = np.random.default_rng(seed)
    place = np.hstack([measured.context.frame[[1, 2, 0]].T, np.zeros((3, 1))])
    solids = [random_body(rng).transform(place) for _ in range(2)]
    one, two = (swing.axial_solid(measured, "body", solid) for solid in solids)
    found = swing.sweep(swing.swing_ends(measured), one, two)
    some = np.linspace(*np.radians(measured.context.prototype.swing), 21)
    turns = measured.context.base_rotation(some).as_matrix()
    at = [solids[0].transform(np.hstack([turn, np.zeros((3, 1))])) for turn in turns]
    volume = max((turned ^ solids[1]).volume() for turned in at)
    gap = min(turned.min_gap(solids[1], swing.SEARCH_MM) for turned in at)
    assert found.volume > swing.TOUCH_MM3 or volume < 1
    assert found.volume == 0 or volume > 0 or gap < 0.5
    assert volume > 0 or found.gap <= gap + 0.01
    room = swing.room_of([one], measured.context.frame)
    assert max((turned - room).volume() for turned in at) < 1e-6
    near = swing.axial_solid(measured, "body", solids[1] ^ room)
    again = swing.sweep(swing.swing_ends(measured), one, near)
    assert again.volume == pytest.approx(found.volume)
    assert abs(again.gap - found.gap) < 0.2


def test_nothing_out_of_reach_is_swept(measured: MeasuredPrototype) -> None:
    rng = np.random.default_rng(5)
    one, far = (swing.axial_solid(measured, "body", random_body(rng)) for _ in range(2))
    room = swing.room_of([one], measured.context.frame)
    none = swing.axial_solid(measured, "far", far.solid.translate([0, 0, 1e4]) ^ room)
    found = swing.sweep((0.0, 1.0), one, none)
    assert (found.volume, found.gap, found.samples) == (0.0, swing.SEARCH_MM, 1)


def stepped(folder: Path, low: list[float], high: list[float]) -> Path:
    """Give the stage a STEP file of a box."""
    box = BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Solid()
    write_step(folder / "stage.step", Solid("stage", box, ()))
    at("parts/stage/step", "stage.step", RECORD)(folder)
    at("spec/mesh", {"chord_error_mm": 0.01, "structure_error_mm": 0.02})(folder)
    return sign(folder)


@pytest.mark.parametrize(
    ("low", "high", "wrong"),
    [
        ([-4, -4, -8], [4, 4, -6], set()),
        ([-4, -4, -7.7], [4, 4, -5.7], {"step box", "step centroid"}),
        ([-4, -4, -8], [4, 4, -5], {"step box", "step centroid", "step volume", "step area"}),
    ],
)
def test_a_step_file_is_held_against_the_mesh_in_its_place(
    prototype_folder: Path, low: list[float], high: list[float], wrong: set[str]
) -> None:
    """Of a stage whose STEP file has a box of these corners."""
    context = context_of(stepped(prototype_folder, low, high))
    masses = {one.part.name: one.placed_mass for one in parts_of(context) if one.placed_mass}
    with Processes(1, 60) as processes:
        files = read_step_files(context.export, processes)
    found = part_step_checks(context.export, masses, files)
    # The synthetic prototype has no coupons.
    assert {check.name for check in found if not check.passed} == wrong | {"coupons"}


def test_one_broken_step_file_leaves_the_others_known(prototype_folder: Path) -> None:
    context = context_of(stepped(prototype_folder, [-4, -4, -8], [4, 4, -6]))
    good = load(context.export.folder, "stage.step")
    (prototype_folder / "bad.step").write_text("ISO-10303-21;\nEND-ISO-10303-21;")
    bad = load(prototype_folder, "bad.step")
    with Processes(1, 60) as processes:
        found = examine_all([bad, good, bad], processes)
    assert [isinstance(one, StepFile) for one in found] == [False, True, False]


def test_the_bend_of_a_cube_is_its_edges(context: PrototypeContext) -> None:
    """Twelve edges at a right angle, of 8, 8 and 2 mm."""
    stage = next(one for one in parts_of(context) if one.part.name == "stage")
    assert stage.placed_mass is not None
    assert stage.placed_mass.bend == pytest.approx(4 * 18 * np.pi / 2, rel=1e-5)
    assert mass_properties(stage.placed_mesh).volume == pytest.approx(128, rel=1e-6)
