"""Plots of what calibration can reach."""

import numpy as np

from tbcad.results.plots import Panel, Series
from tbcad.results.tables import Record, Table
from tbcad.types import Floats


def panels(whole: Table, process: str) -> tuple[Panel, ...]:
    """Errors at the object of whole machines, by noise and by number of LEDs."""
    records = whole.records()
    noise = [r for r in records if r["layout"] == "design" and r["process"] == process]
    leds = [r for r in records if r["layout"] == "best"]
    return tuple(
        Panel(
            title,
            label,
            "mm at the object's centre",
            tuple(
                Series(name, _values(rows, x), _values(rows, f"mm_{share}"), style)
                for name, share, style in (("median", 50, "C0o-"), ("95 %", 95, "C1o-"))
            ),
        )
        for title, label, x, rows in (
            (
                "Rays after a run, fdm, LEDs of the design",
                "noise of highlights, px",
                "noise_px",
                noise,
            ),
            ("Rays after a run, fdm, best LEDs", "number of LEDs", "leds", leds),
        )
    )


def _values(records: list[Record], name: str) -> Floats:
    return np.array([r[name] for r in records], dtype=np.float64)
