"""Elastic compliances against closed forms of beams."""

import numpy as np
import pytest
from scipy.integrate import quad
from trimesh import Trimesh
from trimesh.creation import box

from tbcad.prototype.gravity.compliance import (
    N_PER_G,
    Axle,
    Bodies,
    Material,
    column_compliance,
    compliance,
    moved_to,
    sag_of_bodies,
    shaft_compliance,
    turned_to,
)
from tbcad.prototype.gravity.elastic import POISSON, fill_cells

# A side of whole sub-cubes: a face is found to half of one.
LENGTH, SIDE = 200.0, 20.0
SOLID = Material(modulus=2.0, density=1.27, infill=1.0)
INERTIA = SIDE**4 / 12
SHEAR = 2000.0 / 2 / (1 + POISSON) * SIDE**2 * 5 / 6
X = np.array([1.0, 0.0, 0.0])
START = -2.5  # the last nodes that are held


def bar() -> Trimesh:
    """A bar along x from -40, of which the first 40 mm are held."""
    made = box((LENGTH + 40, SIDE, SIDE))
    made.apply_translation((LENGTH / 2 - 20, 0.7, -1.3))
    return made


HELD = Axle(-40 * X, -3 * X, 2 * SIDE)


def test_a_bar_bends_under_its_weight_and_a_load_as_a_beam_does() -> None:
    load = 500.0
    bodies = Bodies(np.array([[LENGTH - 10, 0.7, -1.3]]), np.array([15.0]), np.array([load]))
    moved, turned = np.split(sag_of_bodies(bar(), bodies, HELD, SOLID)[0], 2)
    a, whole, each = LENGTH - 10 - START, LENGTH - START, SOLID.density * 1e-3 * SIDE**2 * N_PER_G
    own = each * a**2 * (6 * whole**2 - 4 * whole * a + a**2) / 24 / (2000 * INERTIA)
    tip = load * N_PER_G * (a**3 / 3 / (2000 * INERTIA) + a / SHEAR)
    assert np.diag(moved)[1:] == pytest.approx([own + tip] * 2, rel=0.02)
    assert abs(moved - np.diag(np.diag(moved))).max() < 0.02 * (own + tip)
    # The slope there: of its own weight, and of the load.
    slope = each * a * (3 * whole**2 - 3 * whole * a + a**2) / 6 / (2000 * INERTIA)
    slope += load * N_PER_G * a**2 / 2 / (2000 * INERTIA)
    assert [turned[2, 1], -turned[1, 2]] == pytest.approx([slope] * 2, rel=0.02)


def test_the_tip_of_a_bar_has_the_compliance_of_a_column() -> None:
    end = np.array([LENGTH - 10, 0.7, -1.3])
    loaded = Axle(end - 9 * X, end + 9 * X, SIDE)
    found = compliance(bar(), end, [HELD], [loaded], SOLID)
    # Twist of a square bar: 0.141 a^4 (Roark).
    twisting = 2000 / 2 / (1 + POISSON) * 0.141 * SIDE**4
    upright = column_compliance(LENGTH - 10 - START, 2000 * INERTIA, twisting)
    along = turned_to(upright, np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    assert np.diag(found)[1:] == pytest.approx(np.diag(along)[1:], rel=0.06)
    assert found[1, 5] == pytest.approx(along[1, 5], rel=0.02)
    assert found[2, 4] == pytest.approx(along[2, 4], rel=0.02)


def test_infill_leaves_the_walls_solid() -> None:
    cells = fill_cells(bar(), 5.0, 0.2)
    inner = (LENGTH + 40 - 3.3) * (SIDE - 3.3) ** 2
    expected = (LENGTH + 40) * SIDE**2 - 0.8 * inner
    assert cells.nodal.sum() == pytest.approx(expected, rel=0.15)


def test_an_overhanging_shaft_by_its_moments() -> None:
    a, span, stiffness = 31.0, 56.0, 4.2e7

    def moment(x: float, shape: str) -> float:  # from the rear bearing; the tip is at span + a
        at_front = {"force": a, "moment": 1.0}[shape]
        beyond = {"force": span + a - x, "moment": 1.0}[shape]
        return at_front * x / span if x < span else beyond

    def work(one: str, other: str) -> float:
        found = quad(lambda x: moment(x, one) * moment(x, other), 0, span + a, points=[span])
        return float(found[0] / stiffness)

    found = shaft_compliance(a, span, stiffness)
    assert found[1, 1] == pytest.approx(work("force", "force"))
    assert found[1, 5] == pytest.approx(work("force", "moment"))
    assert found[4, 4] == pytest.approx(work("moment", "moment"))
    assert np.allclose(found, found.T)


def test_a_compliance_seen_from_elsewhere_does_the_same_work() -> None:
    random = np.random.default_rng(5)
    some = random.standard_normal((6, 6))
    flexible, arm, wrench = some @ some.T, random.standard_normal(3), random.standard_normal(6)
    here = np.concatenate([wrench[:3], wrench[3:] + np.cross(arm, wrench[:3])])
    assert wrench @ moved_to(flexible, arm) @ wrench == pytest.approx(here @ flexible @ here)
