"""Soft limits need homing before them; without homing both are switched off in any order."""

import pytest
from tbcad_verify.prototype.homing_checks import _parsed


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ("$22=1\n$20=1", False),
        ("$20=0\n$21=0\n$22=0", False),
        ("$20=1\n$22=1", True),
        ("$20=1", True),
    ],
)
def test_order_of_soft_limits_and_homing(text: str, refused: bool) -> None:
    assert bool(_parsed(text)[1]) == refused
