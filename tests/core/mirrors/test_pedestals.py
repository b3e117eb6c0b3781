"""Radii of mirrors on pedestals, and what refuses them."""

import numpy as np
import pytest

from tbcad.core.optics.cells import cell_areas
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tests.mirror_arrays import mirror_array
from tests.pedestal_designs import pedestal_design


def test_every_mirror_covers_the_target_whatever_the_groove() -> None:
    areas = []
    for groove in (0.02, 0.1, 0.5):
        array = pedestal_design("n=9", f"shell.groove_mm={groove}").arrays[0]
        assert array.coverage.min() == pytest.approx(60.6, abs=1e-3)
        areas.append(array.area.sum())
    assert areas[0] > areas[1] > areas[2]
    assert 0.9 * mirror_array("n=9").area.sum() < areas[1] < mirror_array("n=9").area.sum()


def test_a_coat_leaves_the_pedestals_where_they_are() -> None:
    array = pedestal_design("n=4", "coating_um=100").arrays[0]
    bare, coated = array.modelled_cells, array.cells
    assert (cell_areas(bare) != cell_areas(coated)).all()
    walls = slice(bare.mirrors, None)
    np.testing.assert_array_equal(bare.surfaces.normal[walls], coated.surfaces.normal[walls])


def test_a_groove_wider_than_the_mirrors_is_refused_in_one_line() -> None:
    with pytest.raises(SpecError, match=r"set shell\.groove_mm to 0"):
        pedestal_design("n=30", "shell.groove_mm=5")


def test_a_coat_thicker_than_the_grooves_are_deep_is_refused() -> None:
    with pytest.raises(SpecError, match=r"mirrors\.coating_um 200 .* shell\.groove_mm larger"):
        pedestal_design("n=4", "coating_um=200", "shell.groove_mm=0.02")


def test_an_unknown_kind_of_edge_is_refused() -> None:
    with pytest.raises(SpecError, match=r"shell\.edges"):
        load_spec(None, ["shell.edges=step"])
