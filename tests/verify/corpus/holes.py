"""Mutations that the proof is known to let pass. Whoever mends one moves it to its kind's list."""

from __future__ import annotations

from tests.verify.corpus.mutation import Mutation, fails
from tests.verify.corpus.record_changes import JSON, TABLE, Design, Row, design, mirror


def derived(one: Row) -> None:
    """Figures of one mirror that follow from others."""
    for key in ("size_mm", "theta0_deg", "theta1_deg", "polar_deg", "azimuth_deg", "coverage_mm"):
        one[key] *= 1.05


def loose(value: Design) -> None:
    """A mesh error of 5 mm in the spec, which widens what STEP and mesh may differ by."""
    value["spec"]["mesh"]["structure_error_mm"] = 5.0


HOLES: tuple[Mutation, ...] = (
    fails("a mirror's derived figures", TABLE, mirror(derived), "poses"),
    fails("a mesh error of 5 mm", JSON, design(loose), "requirements"),
)
