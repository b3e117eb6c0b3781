"""Tables of balls, pictures and stops: read back, they are the layout."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tbcad.cad.formats.checked_files import Row
from tbcad.core.spec.load import load_spec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.drive.drive import base_torques, drive_loads, load_drives
from tbcad.prototype.files.tables import (
    BALL_COLUMNS,
    STOP_COLUMNS,
    ball_rows,
    picture_rows,
    stop_rows,
)
from tbcad.prototype.purchased.parts import load_parts

FRAME = np.array([[1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [0.0, -(2**0.5), 0.0]]) / 2**0.5
# A kilogram 80 mm from the axis at azimuth 30 degrees.
AZIMUTH = np.radians(30)
BALANCE = BaseBalance(FRAME, 1000.0, 8e4 * np.array([0, np.cos(AZIMUTH), np.sin(AZIMUTH)]), 6.4e6)


@pytest.fixture(scope="module")
def plan(layout: PrototypeLayout) -> list[Row]:
    return picture_rows(layout)


def numbers(rows: list[Row], *names: str) -> NDArray[np.float64]:
    return np.array([[float(row[name] or 0) for name in names] for row in rows]).squeeze()


def test_stops_sum_up_the_plan_and_tell_what_gravity_does(
    layout: PrototypeLayout, plan: list[Row]
) -> None:
    """The sum of r x F along the axis, and what motor and belt yield beyond angle zero."""
    torques = base_torques(BALANCE, layout.stops.range, load_spec(None).prototype.motion)
    loads = drive_loads(load_drives(load_parts())[0], torques)
    stops = stop_rows(layout, BALANCE, loads)
    assert tuple(stops[0]) == STOP_COLUMNS
    for stop in stops:
        own = [row for row in plan if row["stop"] == stop["stop"]]
        worst = [abs(numbers(own, name)).max() for name in ("error_deg", "azimuth_error_deg")]
        assert worst == [stop["error_deg"], stop["azimuth_error_deg"]]
    angles = np.append(layout.stops.angle, 0.0)
    turned = Rotation.from_rotvec(np.outer(angles, FRAME[0])).apply(BALANCE.centre)
    torque = np.cross(turned, [0, 0, -9.80665]) @ FRAME[0]
    wind_up = np.degrees(loads.wind_up_at(torque))
    assert numbers(stops, "torque_nmm") == pytest.approx(torque[:-1])
    beyond = wind_up[:-1] - wind_up[-1]
    assert numbers(stops, "wind_up_deg") == pytest.approx(beyond, abs=1e-12)
    assert np.ptp(beyond) > 0.01


def test_balls(layout: PrototypeLayout) -> None:
    """Places are exact; a cap has no grade and no mass."""
    balls, fit = ball_rows(layout), layout.fit
    assert tuple(balls[0]) == BALL_COLUMNS
    assert [row["number"] for row in balls] == list(range(1, len(layout) + 1))
    assert [row["size"] for row in balls] == list(layout.balls.size)
    places = {"p": layout.apices(), "n": layout.normals(), "c": layout.centres()}
    for name, expected in (places | {"b": layout.body_centres()}).items():
        assert np.array_equal(numbers(balls, *(name + axis for axis in "xyz")), expected)
    radius = numbers(balls, "radius_mm")
    assert np.array_equal(radius, layout.balls.radius)
    assert np.array_equal(numbers(balls, "body_radius_mm"), layout.balls.body_radius)
    assert np.radians(numbers(balls, "azimuth_deg")) == pytest.approx(layout.placement.azimuth)
    assert {row["kind"] for row in balls} == {"ball", "cap"}
    for j, (row, cap) in enumerate(zip(balls, layout.balls.cap, strict=True)):
        told = (row["kind"], row["grade"], row["standard"], row["mass_g"])
        mass = float(layout.balls.mass_g[j])
        known = ("ball", "G40", "ISO 3290-1", mass)
        assert told == (("cap", None, None, None) if cap else known)
        assert cap or row["diameter_mm"] == 2 * radius[j]
        own = fit.ball == j
        assert row["mirrors"] == own.sum()
        assert row["coverage_mm"] == fit.coverage[own].min()
        assert row["coverage_fixed_mm"] == fit.coverage_fixed[own].min()
        assert row["error_deg"] == np.degrees(layout.stops.error[own]).max()
    assert numbers(balls, "pixels").sum() == pytest.approx(fit.pixels.sum())
    assert numbers(balls, "pixels_shell").sum() == pytest.approx(fit.pixels_shell.sum())
