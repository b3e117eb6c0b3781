"""Seats against weight: where they are made, and that weight brings the balls back."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.prototype.arrangement import PrototypeModel, arrange
from tbcad.prototype.base.solid import carrier_solid
from tbcad.prototype.files.tables import ball_rows
from tbcad.prototype.gravity import weighed
from tbcad.prototype.gravity.weighed import against_weight, sag_of, weighed_base


@pytest.fixture(scope="module")
def model(small_design: MirrorDesign) -> PrototypeModel:
    return arrange(small_design)


@pytest.fixture(scope="module")
def placed(model: PrototypeModel) -> PrototypeModel:
    return against_weight(model)


def test_weight_brings_each_ball_to_its_place_on_the_mean_over_its_pictures(
    model: PrototypeModel, placed: PrototypeModel
) -> None:
    assert placed.sag is not None
    fit, stop = placed.layout.fit, placed.layout.stops.stop
    before = placed.sag.whole @ placed.sag.axes  # with the base at angle zero
    loaded = placed.base.seats.centre + before
    for ball, place in enumerate(model.layout.body_centres()):
        mine = fit.ball == ball
        mean = loaded[stop[mine], ball].mean(axis=0)
        assert mean == pytest.approx(place, abs=1e-9)
    assert norm(placed.layout.sag).max() > 0.1


def test_seats_in_other_places_sag_as_much(placed: PrototypeModel) -> None:
    assert placed.sag is not None
    again = sag_of(weighed_base(placed))
    assert norm(again.whole - placed.sag.whole).max() < 0.02 * norm(again.whole).max()


def test_last_digits_of_linear_algebra_move_no_seat(
    model: PrototypeModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    base = weighed_base(model)
    sag = sag_of(base)
    for name in ("sag_of_bodies", "compliance"):
        solved = getattr(weighed, name)
        other = lambda *given, of=solved: of(*given) * (1 + 1e-14)  # noqa: E731
        monkeypatch.setattr(weighed, name, other)
    again = sag_of(base)
    assert all(np.array_equal(again.of[name], moved) for name, moved in sag.of.items())
    assert np.array_equal(again.seat_turn, sag.seat_turn)


def test_the_rest_of_the_design_stays(model: PrototypeModel, placed: PrototypeModel) -> None:
    assert placed.spec == model.spec
    assert placed.layout.apices() == pytest.approx(model.layout.apices())
    rows = ball_rows(placed.layout)
    place = np.array([[row[name] for name in ("bx", "by", "bz")] for row in rows], dtype=float)
    sag = np.array([[row[f"sag_{axis}_mm"] for axis in "xyz"] for row in rows], dtype=float)
    assert place == pytest.approx(placed.base.seats.centre)
    assert place + sag == pytest.approx(model.layout.body_centres())


def test_a_carrier_of_meshes_is_the_solid(placed: PrototypeModel) -> None:
    solid = weighed_base(placed).solids["carrier"]
    properties = carrier_solid(placed.base, 0.1, placed.split)[2]
    assert solid.volume == pytest.approx(properties.volume, rel=2e-3)
    axes = placed.balance.frame
    middle = properties.rotated(placed.base.axes).centroid @ axes.T
    assert solid.center_mass == pytest.approx(middle, abs=0.1)
