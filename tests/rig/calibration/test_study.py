"""The study of what calibration can reach, on a small design."""

import numpy as np
import pytest

from tbcad.common.results import study_files
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.rig.calibration.led_layout import NUMBERS
from tbcad.rig.calibration.study import (
    NOISES_PX,
    ONE_BALL,
    PROCESSES,
    SHARES,
    calibration_study,
)


@pytest.mark.slow
def test_every_case_has_figures(export: ExportedDesign) -> None:
    """More of the best LEDs and less noise bring rays closer."""
    found = calibration_study(export, lambda _: None)
    alone, whole, places = found.tables
    layouts = len(NUMBERS) + 1
    assert len(alone.rows) == 3 * layouts + 1
    assert len(whole.rows) == len(NOISES_PX) + len(PROCESSES) - 1 + len(NUMBERS)
    assert len(places.rows) == sum(NUMBERS) + 4
    for table in (alone, whole):
        for unit in ("mm", "mrad"):
            low, high = (
                np.array(table.column(f"{unit}_{share}"), dtype=np.float64) for share in SHARES
            )
            assert (low > 0).all()
            assert (low <= high).all()
    assert ONE_BALL in alone.column("centre and radius")
    files = study_files(found)
    assert files["calibration.png"].startswith(b"\x89PNG")
    records = whole.records()
    leds = [row["mm_50"] for row in records if row["layout"] == "best"]
    noises = [row["mm_50"] for row in records if row["layout"] == "design"][: len(NOISES_PX)]
    assert leds == sorted(leds, reverse=True)
    assert noises == sorted(noises)
