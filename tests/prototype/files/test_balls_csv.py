import numpy as np
import pytest
from numpy.typing import NDArray

from tbcad.formats.csv_table import write_table
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.files.balls_csv import COLUMNS, ball_rows
from tests.exported_files import Rows, read_csv


@pytest.fixture(scope="module")
def read(layout: PrototypeLayout, tmp_path_factory: pytest.TempPathFactory) -> Rows:
    path = tmp_path_factory.mktemp("balls") / "balls.csv"
    write_table(path, COLUMNS, ball_rows(layout))
    return read_csv(path)


def column(read: Rows, *names: str) -> NDArray[np.float64]:
    return np.array([[float(row[name]) for name in names] for row in read]).squeeze()


def test_one_row_a_ball(layout: PrototypeLayout, read: Rows) -> None:
    assert tuple(read[0]) == COLUMNS
    assert [int(row["number"]) for row in read] == list(range(1, len(layout) + 1))
    assert [row["size"] for row in read] == list(layout.balls.size)


def test_places_are_exact(layout: PrototypeLayout, read: Rows) -> None:
    for names, expected in {
        ("px", "py", "pz"): layout.apices(),
        ("nx", "ny", "nz"): layout.normals(),
        ("cx", "cy", "cz"): layout.centres(),
        ("bx", "by", "bz"): layout.body_centres(),
    }.items():
        assert np.array_equal(column(read, *names), expected)
    assert np.array_equal(column(read, "radius_mm"), layout.balls.radius)
    assert np.array_equal(column(read, "body_radius_mm"), layout.balls.body_radius)
    assert np.radians(column(read, "azimuth_deg")) == pytest.approx(
        layout.placement.azimuth, abs=1e-15, rel=1e-15
    )


def test_the_table_alone_gives_the_spheres(read: Rows) -> None:
    apex, normal = column(read, "px", "py", "pz"), column(read, "nx", "ny", "nz")
    centre, radius = column(read, "cx", "cy", "cz"), column(read, "radius_mm")
    assert apex - radius[:, None] * normal == pytest.approx(centre)
    pinhole = np.array([100.0, 0, -100])
    away = np.linalg.norm(apex, axis=1) + np.linalg.norm(apex - pinhole, axis=1)
    assert away == pytest.approx(np.full(len(read), away[0]))


def test_balls_have_grade_and_mass_caps_have_none(layout: PrototypeLayout, read: Rows) -> None:
    kinds = [row["kind"] for row in read]
    assert set(kinds) == {"ball", "cap"}
    for row, cap, mass in zip(read, layout.balls.cap, layout.balls.mass_g, strict=True):
        assert row["kind"] == ("cap" if cap else "ball")
        if cap:
            assert row["grade"] == row["standard"] == row["mass_g"] == ""
        else:
            assert (row["grade"], row["standard"]) == ("G40", "ISO 3290-1")
            assert float(row["mass_g"]) == mass
            assert float(row["diameter_mm"]) == 2 * float(row["radius_mm"])


def test_what_they_show(layout: PrototypeLayout, read: Rows) -> None:
    fit = layout.fit
    assert sum(int(row["mirrors"]) for row in read) == len(layout.array)
    assert column(read, "pixels").sum() == pytest.approx(fit.pixels.sum())
    assert column(read, "pixels_shell").sum() == pytest.approx(fit.pixels_shell.sum())
    for j, row in enumerate(read):
        own = fit.ball == j
        assert int(row["mirrors"]) == own.sum()
        assert float(row["coverage_mm"]) == fit.coverage[own].min()
        assert float(row["coverage_fixed_mm"]) == fit.coverage_fixed[own].min()
        assert float(row["error_deg"]) == np.degrees(layout.stops.error[own]).max()
