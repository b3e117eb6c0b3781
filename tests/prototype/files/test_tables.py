"""Tables of balls, pictures and stops: read back, they are the layout."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tbcad.cad.formats.checked_files import write_table
from tbcad.core.spec.load import load_spec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.drive.loads import DriveLoads, base_torques
from tbcad.prototype.files.tables import (
    BALL_COLUMNS,
    PICTURE_COLUMNS,
    STOP_COLUMNS,
    ball_rows,
    picture_rows,
    stop_rows,
)
from tbcad.prototype.purchased.parts import load_parts
from tests.exported_files import Rows, read_csv

FRAME = np.array([[1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [0.0, -(2**0.5), 0.0]]) / 2**0.5
# A kilogram 80 mm from the axis at azimuth 30 degrees.
AZIMUTH = np.radians(30)
BALANCE = BaseBalance(FRAME, 1000.0, 8e4 * np.array([0, np.cos(AZIMUTH), np.sin(AZIMUTH)]), 6.4e6)


def loads_of(layout: PrototypeLayout) -> DriveLoads:
    torques = base_torques(BALANCE, layout.stops.range, load_spec(None).prototype.motion)
    return DriveLoads(load_drives(load_parts())[0], torques)


@pytest.fixture(scope="module")
def plan(layout: PrototypeLayout, tmp_path_factory: pytest.TempPathFactory) -> Rows:
    path = tmp_path_factory.mktemp("plan") / "rotation_plan.csv"
    write_table(path, PICTURE_COLUMNS, picture_rows(layout))
    return read_csv(path)


@pytest.fixture(scope="module")
def stops(layout: PrototypeLayout, tmp_path_factory: pytest.TempPathFactory) -> Rows:
    path = tmp_path_factory.mktemp("stops") / "stops.csv"
    write_table(path, STOP_COLUMNS, stop_rows(layout, BALANCE, loads_of(layout)))
    return read_csv(path)


def test_every_mirror_of_both_cameras_once(layout: PrototypeLayout, plan: Rows) -> None:
    assert tuple(plan[0]) == PICTURE_COLUMNS
    assert [int(row["order"]) for row in plan] == list(range(1, 2 * len(layout.array) + 1))
    for turn, camera in (("0", "a"), ("180", "b")):
        own = [row["mirror"] for row in plan if row["object_turn_deg"] == turn]
        assert sorted(own) == [f"{camera}{i + 1:04d}" for i in range(len(layout.array))]


def test_each_run_goes_upward(plan: Rows) -> None:
    for turn in ("0", "180"):
        angle = [float(row["base_angle_deg"]) for row in plan if row["object_turn_deg"] == turn]
        assert angle == sorted(angle)


def test_the_table_alone_gives_the_directions(layout: PrototypeLayout, plan: Rows) -> None:
    """Ball's azimuth on the base and the base's angle, less the error: the mirror's azimuth."""
    array, azimuth = layout.array, np.degrees(layout.placement.azimuth)
    for row in (row for row in plan if row["object_turn_deg"] == "0"):
        i = array.ids.index(row["mirror"])
        stands = azimuth[int(row["ball"]) - 1] + float(row["base_angle_deg"])
        found = stands - float(row["azimuth_error_deg"])
        assert found == pytest.approx(np.degrees(array.azimuth[i]), abs=1e-9)


def test_stops_sum_up_the_plan(plan: Rows, stops: Rows) -> None:
    assert tuple(stops[0]) == STOP_COLUMNS
    for turn in ("0", "180"):
        for stop in stops:
            own = [r for r in plan if (r["stop"], r["object_turn_deg"]) == (stop["stop"], turn)]
            assert len(own) == int(stop["mirrors"])
            assert {row["base_angle_deg"] for row in own} == {stop["base_angle_deg"]}
            assert {row["ball"] for row in own} == set(stop["balls"].split())
            assert max(float(row["error_deg"]) for row in own) == float(stop["error_deg"])
            worst = max(abs(float(row["azimuth_error_deg"])) for row in own)
            assert worst == float(stop["azimuth_error_deg"])


def test_stops_tell_what_gravity_does(layout: PrototypeLayout, stops: Rows) -> None:
    """The sum of r x F along the axis, and what motor and belt yield beyond angle zero."""
    angles = np.append(layout.stops.angle, 0.0)
    turned = Rotation.from_rotvec(np.outer(angles, FRAME[0])).apply(BALANCE.centre)
    torque = np.cross(turned, [0, 0, -9.80665]) @ FRAME[0]
    wind_up = np.degrees(loads_of(layout).wind_up_at(torque))
    assert [float(row["torque_nmm"]) for row in stops] == pytest.approx(torque[:-1])
    beyond = wind_up[:-1] - wind_up[-1]
    assert [float(row["wind_up_deg"]) for row in stops] == pytest.approx(beyond, abs=1e-12)
    assert np.ptp(beyond) > 0.01


@pytest.fixture(scope="module")
def balls(layout: PrototypeLayout, tmp_path_factory: pytest.TempPathFactory) -> Rows:
    path = tmp_path_factory.mktemp("balls") / "balls.csv"
    write_table(path, BALL_COLUMNS, ball_rows(layout))
    return read_csv(path)


def column(balls: Rows, *names: str) -> NDArray[np.float64]:
    return np.array([[float(row[name]) for name in names] for row in balls]).squeeze()


def test_one_row_a_ball(layout: PrototypeLayout, balls: Rows) -> None:
    assert tuple(balls[0]) == BALL_COLUMNS
    assert [int(row["number"]) for row in balls] == list(range(1, len(layout) + 1))
    assert [row["size"] for row in balls] == list(layout.balls.size)


def test_places_are_exact(layout: PrototypeLayout, balls: Rows) -> None:
    for names, expected in {
        ("px", "py", "pz"): layout.apices(),
        ("nx", "ny", "nz"): layout.normals(),
        ("cx", "cy", "cz"): layout.centres(),
        ("bx", "by", "bz"): layout.body_centres(),
    }.items():
        assert np.array_equal(column(balls, *names), expected)
    assert np.array_equal(column(balls, "radius_mm"), layout.balls.radius)
    assert np.array_equal(column(balls, "body_radius_mm"), layout.balls.body_radius)
    assert np.radians(column(balls, "azimuth_deg")) == pytest.approx(
        layout.placement.azimuth, abs=1e-15, rel=1e-15
    )


def test_the_table_alone_gives_the_spheres(balls: Rows) -> None:
    apex, normal = column(balls, "px", "py", "pz"), column(balls, "nx", "ny", "nz")
    centre, radius = column(balls, "cx", "cy", "cz"), column(balls, "radius_mm")
    assert apex - radius[:, None] * normal == pytest.approx(centre)
    pinhole = np.array([100.0, 0, -100])
    away = np.linalg.norm(apex, axis=1) + np.linalg.norm(apex - pinhole, axis=1)
    assert away == pytest.approx(np.full(len(balls), away[0]))


def test_balls_have_grade_and_mass_caps_have_none(layout: PrototypeLayout, balls: Rows) -> None:
    kinds = [row["kind"] for row in balls]
    assert set(kinds) == {"ball", "cap"}
    for row, cap, mass in zip(balls, layout.balls.cap, layout.balls.mass_g, strict=True):
        assert row["kind"] == ("cap" if cap else "ball")
        if cap:
            assert row["grade"] == row["standard"] == row["mass_g"] == ""
        else:
            assert (row["grade"], row["standard"]) == ("G40", "ISO 3290-1")
            assert float(row["mass_g"]) == mass
            assert float(row["diameter_mm"]) == 2 * float(row["radius_mm"])


def test_what_they_show(layout: PrototypeLayout, balls: Rows) -> None:
    fit = layout.fit
    assert sum(int(row["mirrors"]) for row in balls) == len(layout.array)
    assert column(balls, "pixels").sum() == pytest.approx(fit.pixels.sum())
    assert column(balls, "pixels_shell").sum() == pytest.approx(fit.pixels_shell.sum())
    for j, row in enumerate(balls):
        own = fit.ball == j
        assert int(row["mirrors"]) == own.sum()
        assert float(row["coverage_mm"]) == fit.coverage[own].min()
        assert float(row["coverage_fixed_mm"]) == fit.coverage_fixed[own].min()
        assert float(row["error_deg"]) == np.degrees(layout.stops.error[own]).max()
