"""Light of rectangular lamps, against the law of distant sources and the flux that they give."""

from pathlib import Path

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.lamp_light import RectangularLamps, irradiance
from tbcad.errors import InputError
from tbcad.light.simulate.scene.lamps import read_lamps
from tests.exported_files import edit_json
from tests.prototype_records import LAMP_SECTION, write_prototype

PLACE = np.array([108.0, 52.0, -87.5])
SIGNS = np.array([[1.0, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]])
INWARD = -SIGNS * [1, 0, 0]
LAMPS = RectangularLamps(SIGNS * PLACE, INWARD, 16.0, 50.0, 90.0)


def test_a_distant_lamp_follows_the_square_of_the_distance() -> None:
    one = RectangularLamps(np.zeros((1, 3)), np.array([[1.0, 0, 0]]), 16.0, 50.0, 90.0)
    way = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    found = irradiance(one, np.array([5000 * way]), -way[None])
    assert found[0] == pytest.approx(90 / np.pi * np.cos(0.3) / 5.0**2, rel=1e-4)


def test_all_light_of_a_lamp_falls_on_a_sphere_round_it() -> None:
    one = RectangularLamps(np.zeros((1, 3)), np.array([[0.0, 1, 0]]), 16.0, 50.0, 90.0)
    z, turn = np.meshgrid((np.arange(200) + 0.5) / 100 - 1, np.arange(400) * np.pi / 200)
    out = np.sqrt(1 - z**2)
    ways = np.stack([out * np.cos(turn), out * np.sin(turn), z], -1).reshape(-1, 3)
    found = irradiance(one, 200 * ways, -ways)
    assert found.mean() * 4 * np.pi * 0.2**2 == pytest.approx(90, rel=5e-3)


def test_a_half_turn_leaves_the_light_as_it_was() -> None:
    generator = np.random.default_rng(1)
    points, normals = 20 * generator.normal(size=(2, 100, 3))
    normals /= norm(normals)[:, None]
    turn = np.array([-1.0, -1, 1])
    before = irradiance(LAMPS, points, normals)
    assert irradiance(LAMPS, points * turn, normals * turn) == pytest.approx(before, rel=1e-12)
    quarter = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    other = irradiance(LAMPS, points @ quarter, normals @ quarter)
    assert np.abs(other - before).max() > 0.2 * before.max()


def test_lamps_of_a_record(tmp_path: Path) -> None:
    found = read_lamps(write_prototype(tmp_path, lamps=LAMP_SECTION))
    assert found is not None
    assert found.places.tolist() == [LAMP_SECTION["places"][0]["position_mm"]]
    edit_json(
        tmp_path / "prototype.json", lambda value: value.update(lamps=LAMP_SECTION | {"watt": "x"})
    )
    with pytest.raises(InputError, match="watt"):
        read_lamps(tmp_path)
    assert read_lamps(write_prototype(tmp_path)) is None
