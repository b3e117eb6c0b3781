"""A carrier whose STEP file does not keep it is a fault in words: other arrangements are tried."""

from collections.abc import Callable

import numpy as np
import pytest
from OCP.Standard import Standard_Failure

from tbcad.cad.brep import InvalidSolidError
from tbcad.cad.meshing import meshed
from tbcad.cad.solids import cylinder, one_solid
from tbcad.prototype import model
from tbcad.prototype.model import carrier_fault
from tbcad.prototype.printing.placing import PlacedSolid

ROD = one_solid("rod", cylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 5.0, 20.0))
PART = PlacedSolid("rod", ROD, meshed(ROD, 0.1), np.eye(3), np.zeros(3))


def failing(error: Exception) -> Callable[..., None]:
    def check(*_: object) -> None:
        raise error

    return check


def test_a_sound_part_has_no_fault() -> None:
    assert carrier_fault(PART) == ""


@pytest.mark.parametrize("error", [InvalidSolidError("gaps"), Standard_Failure("gaps")])
def test_what_fails_is_said(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    monkeypatch.setattr(model, "check_read_back", failing(error))
    assert "gaps" in carrier_fault(PART)
