"""Pedestals at the seam and the foot plane."""

from pathlib import Path

import numpy as np
import pytest

from tbcad.core.mirrors.array import design
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tests.pedestal_designs import pedestal_design

EVEN = Path(__file__).parents[4] / "designs" / "turtleback-even.toml"


def modelled(*settings: str, path: Path | None = None) -> PedestalCells:
    spec = load_spec(path, ["shell.edges=pedestal", *settings])
    cells = design(spec).arrays[0].modelled_cells
    assert isinstance(cells, PedestalCells)
    return cells


def heights(cells: PedestalCells) -> np.ndarray:
    """Distances (c, 2) of all corners from the seam and the foot plane, inward."""
    planes = slice(cells.mirrors, cells.mirrors + PLANES)
    apex, normal = cells.surfaces.apex[planes], cells.surfaces.normal[planes]
    return np.einsum("cpx,px->cp", cells.corners[:, None] - apex, normal)


# Mirrors of n = 3, 8 and 12 have borders of less than 2 mm with the foot; those of the others have
# ends of grooves near the seam.
@pytest.mark.parametrize(
    "settings", [("n=3", "groove_mm=0.05"), ("n=8",), ("n=12",), ("n=9", "groove_mm=0.5")]
)
def test_nothing_sticks_out_beyond_the_seam_and_the_foot(settings: tuple[str, ...]) -> None:
    assert heights(modelled(*settings)).min() > -1e-9


@pytest.mark.parametrize("n", [10, 13])
def test_grooves_between_half_mirrors_end_before_the_seam(n: int) -> None:
    assert heights(modelled(f"n={n}", path=EVEN)).min() > -1e-9


def test_a_mirror_that_ends_before_the_foot_keeps_its_distance() -> None:
    """No tip lies between the foot plane and a groove's width above it."""
    cells = modelled("n=8")
    above = heights(cells)[:, 1]
    tips = above[: len(cells.rings[1])]
    assert not ((tips > 1e-9) & (tips < cells.layout.groove)).any()


def test_every_mirror_keeps_its_coverage() -> None:
    made = pedestal_design("n=8")
    spec = made.spec
    wanted = spec.optics.capture_diameter_mm + spec.mirrors.margin_mm
    assert made.arrays[0].coverage.min() == pytest.approx(wanted, abs=1e-3)


def test_a_groove_that_crosses_the_seam_is_refused_with_a_width_that_was_tried() -> None:
    with pytest.raises(SpecError, match=r"groove.*: set shell\.groove_mm to 0\.25,"):
        modelled("n=20", "groove_mm=0.5")


def test_radii_that_are_not_found_may_be_with_another_groove() -> None:
    """Of some stretched designs a border vanishes with every second set of radii."""
    stretched = "n=9", "optics.stretch=[2, 2]"
    with pytest.raises(SpecError, match=r"change shell\.groove_mm, optics\.n"):
        modelled(*stretched, "groove_mm=0.05")
    assert heights(modelled(*stretched, "groove_mm=0.1")).min() > -1e-9
