"""Capture with the prototype: its plan as read, its photographs, and what is merged of them."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import minimum_filter
from scipy.spatial.transform import Rotation

import tbcad.light.simulate.parallel
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.lens import PupilLens
from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import LightField, light_field_in_memory
from tbcad.light.simulate.capture.photograph import CENTRE, RowBand
from tbcad.light.simulate.capture.photograph import photograph as shell_photograph
from tbcad.light.simulate.capture.real import RealOptics
from tbcad.light.simulate.prototype.ball_rays import (
    resampled_photograph,
    trace_balls,
    trace_own_ball,
)
from tbcad.light.simulate.prototype.merge import merge_run
from tbcad.light.simulate.prototype.run import (
    HALF_TURN,
    Plan,
    PrototypeRun,
    ball_reflector,
    prototype_runs,
    read_plan,
)
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector, read_export
from tbcad.prototype.balls.layout import PrototypeLayout
from tests.exported_files import Rows, edit_csv, edit_json
from tests.light.conftest import CAPTURE_MM
from tests.photographed_runs import stop_photograph
from tests.prototype_exports import plan_of
from tests.prototype_records import FRAME

PLAN, RECORD, BALLS = "rotation_plan.csv", "prototype.json", "balls.csv"
Runs = tuple[PrototypeRun, PrototypeRun]


@pytest.fixture(scope="module")
def runs(layout: PrototypeLayout, cameras: tuple[Reflector, Reflector]) -> Runs:
    return prototype_runs(cameras, plan_of(layout))


@pytest.fixture(scope="module")
def merged(runs: Runs, knot: Scene) -> LightField:
    return merged_light_field(runs, knot)


def test_merged_of_real_photographs(runs: Runs, merged: LightField, knot: Scene) -> None:
    """The same mirrors and nearly the same light: blurred, with noise; without balls brighter."""
    count = runs[0].balls.shape[1]
    optics = RealOptics(PupilLens(0.85, 134.6), 0.55, np.full(count, 25.0))
    bands = list(merge_run(runs[0], knot, optics))
    mirror = np.concatenate([band.rays.mirror for band in bands])
    colour = np.concatenate([band.colour for band in bands]).astype(float)
    ideal = merged.frames["a"]
    assert (mirror == ideal.planes["mirror"]).all()
    sharp, on = ideal.planes["colour"].astype(float), mirror > 0
    assert np.corrcoef(sharp[on].ravel(), colour[on].ravel())[0, 1] > 0.9
    assert colour[on].mean() == pytest.approx(sharp[on].mean(), rel=0.1)
    direct = minimum_filter((sharp.max(axis=2) > 60) & ~on, 7)
    assert colour[direct].mean() == pytest.approx(
        np.minimum(sharp[direct] / 0.55, 255).mean(), rel=0.05
    )


def merged_light_field(runs: Runs, scene: Scene) -> LightField:
    photographs = ((ball_reflector(run), merge_run(run, scene)) for run in runs)
    return light_field_in_memory(photographs, CAPTURE_MM)


def ideal(layout: PrototypeLayout, angle: float) -> Plan:
    """A ball like each mirror, on a base that brings all of them there at one angle."""
    array, m = layout.array, np.arange(len(layout.array))
    back = Rotation.from_rotvec(-angle * array.ellipsoid.axis)
    apex, normal = back.apply(array.mirrors.apex), back.apply(array.mirrors.normal)
    radius = array.mirrors.radius
    centre = apex - radius[:, None] * normal
    ball, stop = np.stack([m, np.argsort(layout.twin)]), np.zeros((2, len(m)), dtype=np.int64)
    frame = array.ellipsoid.frame()
    return Plan(frame, apex, normal, radius, centre, radius, True, np.array([angle]), ball, stop)


def misses(run: PrototypeRun, mirror: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Distances from the origin of rays of mirrors' windows after their balls, caps whole.

    Infinite where a ray meets something else.
    """
    whole = np.concatenate([run.balls[..., :4], run.balls[..., :4]], axis=2)
    turned = np.einsum("nx,nxy->ny", direction, run.window_rotation[mirror])
    seen = trace_balls(replace(run, balls=whole), turned, run.stop[mirror])
    away = norm(np.cross(seen.origin, seen.direction))
    return np.where(seen.ball == run.ball[mirror] + 1, away, np.inf)


class TestGeometry:
    def test_the_apex_of_a_mirror_shows_the_middle_of_the_object_by_its_ball(
        self, runs: Runs
    ) -> None:
        """Origin and pinhole are foci of the ellipsoid that both apices lie on."""
        for run in runs:
            direction = unit(run.reflector.mirrors.apex - run.camera.pinhole)
            turned = np.einsum("nx,nxy->ny", direction, run.window_rotation)
            seen = trace_balls(run, turned, run.stop)
            assert (seen.ball == run.ball + 1).all()
            assert np.abs(seen.origin - run.ball_surfaces.apex).max() < 1e-9
            assert np.abs(seen.direction + unit(run.ball_surfaces.apex)).max() < 1e-9
            alone = trace_own_ball(run, turned, run.stop, run.ball + 1)
            for mine, found in zip(vars(alone).values(), vars(seen).values(), strict=True):
                assert mine == pytest.approx(found)

    def test_rays_at_the_windows_edge_pass_by_half_the_recorded_coverage(
        self, runs: Runs, layout: PrototypeLayout
    ) -> None:
        """The record is computed at the mirror's own azimuth, these rays at the stop."""
        for run, order in zip(runs, (np.arange(len(layout.array)), layout.twin), strict=True):
            arcs, m = run.reflector.cells.arcs, len(run.reflector)
            wall, t = run.reflector.cells.seam, np.linspace(0, 1, 201)
            least = np.full(m, np.inf)
            for mine, other in (arcs.faces.T, arcs.faces.T[::-1]):
                # A cell halved by the seam goes on in the other camera's picture.
                counted = np.flatnonzero(
                    (mine < m) & ~((other == wall) & (run.reflector.u[mine % m, 0] == 0))
                )
                point = arcs.at(
                    np.repeat(counted[:, None], len(t), 1),
                    np.broadcast_to(t, (len(counted), len(t))),
                )
                direction = unit(point - run.camera.pinhole).reshape(-1, 3)
                mirror = np.repeat(mine[counted], len(t))
                np.minimum.at(least, mirror, misses(run, mirror, direction))
            assert 2 * least[order] == pytest.approx(layout.fit.coverage, abs=2e-3)

    def test_a_caps_body_hides_and_shows_nothing(self, runs: Runs) -> None:
        """Body about (0, 0, 10) of radius 3, its front cut off by a ball of 10 whose apex is 8."""
        cap = np.array([[[0.0, 0.0, 18.0, 10.0, 0.0, 0.0, 10.0, 3.0]]])
        view = replace(runs[0].camera, pinhole=np.zeros(3))
        run = replace(runs[0], camera=view, balls=cap)
        # Runs spheres meet at z = 8.6875, 2.697 from the axis.
        edge, rim = np.arctan2(2.697, 8.6875), np.arcsin(3 / 10)
        angle = np.array([0, 0.9 * edge, 0.99 * rim, 1.01 * rim])
        direction = np.column_stack([np.sin(angle), np.zeros(4), np.cos(angle)])
        seen = trace_balls(run, direction, np.zeros(4, dtype=np.int64))
        assert edge < 0.99 * rim
        assert seen.ball.tolist() == [1, 1, 0, 0]
        assert np.isfinite(seen.distance).tolist() == [True, True, True, False]
        assert seen.distance[0] == pytest.approx(8)
        assert norm(seen.origin[1] - [0, 0, 18]) == pytest.approx(10)
        assert seen.direction[0] == pytest.approx([0, 0, -1])


class TestPhotographs:
    def test_the_second_run_sees_the_object_turned(self, runs: Runs, knot: Scene) -> None:
        """Camera a before an object that was really turned takes the same photograph."""
        points, normals = (
            getattr(knot.subject, name) * HALF_TURN for name in ("points", "normals")
        )
        subject = replace(knot.subject, points=points, normals=normals)
        turned = replace(prepared_scene(subject), shade=knot.shade)
        second, first = stop_photograph(runs[1], knot, 3), stop_photograph(runs[0], turned, 3)
        assert second.any()
        assert (np.abs(second.astype(int) - first) > 1).any(axis=2).mean() < 1e-3
        straight = stop_photograph(runs[0], knot, 3)
        assert (np.abs(second.astype(int) - straight) > 1).any(axis=2).mean() > 1e-2

    def test_resampling_is_bilinear(self, runs: Runs, knot: Scene) -> None:
        whole = stop_photograph(runs[0], knot, 2, samples=2).astype(float)
        row, column = np.argwhere(whole.sum(axis=2) > 0)[::7].T
        row, column = np.minimum(row, 308), np.minimum(column, 414)
        places = np.column_stack([column, row]).astype(float)
        assert (resampled_photograph(runs[0], knot, 2, 2, places) == whole[row, column]).all()
        right, under = whole[row, column + 1], whole[row + 1, column]
        middle = 0.75 * whole[row, column] + 0.25 * right
        found = resampled_photograph(runs[0], knot, 2, 2, places + np.array([0.25, 0]))
        assert np.abs(found - middle).max() <= 0.5
        found = resampled_photograph(runs[0], knot, 2, 2, places + np.array([0, 0.5]))
        assert np.abs(found - (whole[row, column] + under) / 2).max() <= 0.5


class TestMerged:
    def test_balls_like_the_mirrors_give_the_shells_picture(
        self,
        layout: PrototypeLayout,
        cameras: tuple[Reflector, Reflector],
    ) -> None:
        """Also where the object, which is too large, hides mirrors.

        Halves of a mirror on the seam are aimed beyond it, and balls are not: they differ.
        """
        scene = prepared_scene(built_in_object(1.7 * CAPTURE_MM))
        ideal_runs = prototype_runs(cameras, ideal(layout, 0.7))
        found = merged_light_field(ideal_runs, scene)
        for at in cameras:
            shell = list(shell_photograph(at.camera, exact_tracer(at), scene))
            planes = found.frames[at.camera_id].planes
            mirror, picture = joined(shell, "mirror"), np.concatenate([b.colour for b in shell])
            free = np.concatenate([exact_tracer(at)(band.rows, CENTRE).mirror for band in shell])
            seam = np.flatnonzero(at.cells.halved) + 1
            whole = ~np.isin([mirror, planes["mirror"], free], seam).any(axis=0)
            assert whole.mean() > 0.9
            # At the very edge between two cells rounding decides.
            same = planes["mirror"] == mirror
            assert (mirror > 0).sum() < (free > 0).sum()
            assert same[whole].mean() > 1 - 1e-4
            same &= whole
            for name in ("origin", "direction"):
                away = np.abs(planes[name] - joined(shell, name))[same]
                assert away.max() < 1e-4
            off = np.abs(planes["colour"].astype(int) - picture).max(axis=2)
            assert (off[whole] > 1).mean() < 5e-4

    def test_share_of_rays_kept_is_that_of_the_layout(
        self, merged: LightField, layout: PrototypeLayout, cameras: tuple[Reflector, Reflector]
    ) -> None:
        """As many rays into the capture sphere as the design's areas promise, within rounding."""
        kept = sum(capture_rays(frame.planes).sum() for frame in merged.frames.values())
        shell = sum(
            capture_rays({k: getattr(exact_tracer(at)(range(310), (0, 0)), k) for k in RAYS}).sum()
            for at in cameras
        )
        assert shell == pytest.approx(2 * layout.fit.pixels_shell.sum(), rel=0.01)
        assert kept / shell == pytest.approx(layout.fit.kept_share, abs=0.01)

    def test_windows_that_leave_the_photograph(self, runs: Runs, knot: Scene) -> None:
        """A camera of a narrower lens takes no rays beyond its frame, and no colours."""
        wide = runs[0].camera
        narrow = replace(runs[0], camera=replace(wide, focal=1.4 * wide.focal))
        bands = list(merge_run(narrow, knot))
        mirror, origin = joined(bands, "mirror"), joined(bands, "origin")
        place = narrow.camera.project(origin[mirror > 0])
        assert (place >= -1e-6).all()
        assert (place <= np.array([415, 309]) + 1e-6).all()
        free = exact_tracer(runs[0].reflector)(range(310), CENTRE).mirror
        lost = (mirror == 0) & (free > 0)
        assert 0.1 < lost.sum() / (free > 0).sum() < 0.9
        assert not np.concatenate([band.colour for band in bands])[lost].any()

    def test_same_bytes_on_one_thread(
        self, merged: LightField, runs: Runs, knot: Scene, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(tbcad.light.simulate.parallel, "THREADS", 1)
        again = merged_light_field(runs, knot)
        for camera, frame in merged.frames.items():
            for name, plane in frame.planes.items():
                assert (plane == again.frames[camera].planes[name]).all()


RAYS = ("mirror", "origin", "direction")


def joined(bands: list[RowBand], name: str) -> np.ndarray:
    return np.concatenate([getattr(band.rays, name) for band in bands])


def capture_rays(planes: dict[str, np.ndarray]) -> np.ndarray:
    """Pixels whose ray meets the capture sphere."""
    origin, direction = planes["origin"].astype(float), planes["direction"].astype(float)
    near = norm(np.cross(origin, direction)) <= CAPTURE_MM / 2
    return near & (planes["mirror"] > 0) & ((origin * direction).sum(axis=2) < 0)


class TestReading:
    def test_plan_round_trip(self, export_folder: Path, layout: PrototypeLayout) -> None:
        found, wanted = read_plan(read_export(export_folder)), plan_of(layout)
        for name in ("frame", "apex", "normal", "radius", "body_centre", "body_radius", "angle"):
            assert getattr(found, name) == pytest.approx(getattr(wanted, name), abs=1e-12)
        assert (found.ball == wanted.ball).all()
        assert (found.stop == wanted.stop).all()
        assert found.moved
        assert found.centre == pytest.approx(layout.centres())

    @pytest.mark.parametrize(
        ("name", "change", "message"),
        [
            (PLAN, lambda t: t.pop(5), "does not show mirror a"),
            (PLAN, lambda t: t.append(t[7]), "a second time"),
            (PLAN, lambda t: t[3].update(mirror="b0001"), "row 4 shows b0001"),
            (PLAN, lambda t: t[3].update(mirror="a9999"), "allowed .* is a0001 to a0103"),
            (PLAN, lambda t: t[3].update(ball="6"), "names ball 6, allowed is 1 to 5"),
            (PLAN, lambda t: t[3].update(object_turn_deg="90"), "object_turn_deg 90"),
            (PLAN, lambda t: t[0].update(base_angle_deg="3"), "stop 1 has two base angles"),
            (PLAN, lambda t: raised(t, "stop", 1), "not numbered from 1"),
            (PLAN, lambda t: raised(t, "base_angle_deg", 1.0, -1), "do not rise from stop to stop"),
            (PLAN, lambda t: raised(t, "base_angle_deg", 0.5), "but its ball is"),
            (RECORD, lambda t: t["frame"].update(zero=[1, 0, 0]), "not square"),
            (RECORD, lambda t: t["frame"].update(third=[0, 1, 0]), "right-handed"),
            (RECORD, lambda t: t.update(frame=FRAME), "does not point"),
            (BALLS, lambda t: t.clear(), "balls.csv: no balls"),
            (BALLS, lambda t: t.reverse(), "ball 1 is out of order"),
            (BALLS, lambda t: t[2].update(nx="2.0"), "ball 3 has a normal"),
            (BALLS, lambda t: t[1].update(cx="1.0"), "ball 2 has a centre"),
        ],
    )
    def test_refused(
        self,
        export_folder: Path,
        tmp_path: Path,
        name: str,
        change: Callable[[Any], object],
        message: str,
    ) -> None:
        folder = Path(shutil.copytree(export_folder, tmp_path / "broken"))
        edit = edit_json if name.endswith(".json") else edit_csv
        edit(folder / name, change)
        with pytest.raises(InputError, match=message) as caught:
            read_plan(read_export(folder))
        assert "\n" not in str(caught.value)

    def test_one_camera_that_cannot_take_both_halves(self, export_folder: Path) -> None:
        exported = read_export(export_folder)
        a, b = exported.reflectors
        askew = replace(b, camera=replace(b.camera, pinhole=b.camera.pinhole + np.array([0, 1, 0])))
        with pytest.raises(InputError, match="one camera cannot take both halves"):
            read_plan(exported.model_copy(update={"reflectors": (a, askew)}))


def raised(table: Rows, name: str, by: float, times: int = 1) -> None:
    for row in table:
        value = times * float(row[name]) + by
        row[name] = str(int(value)) if name == "stop" else repr(value)
