"""Figures against limits: what passes, what fails, and what is said of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tbcad_verify.report.checks import (
    MAX_NAMED,
    Check,
    Unknown,
    at_least,
    at_most,
    attempt,
    each_at_most,
    exactly,
    guarded,
    guarded_each,
    informative,
    require,
    short_list,
    worst_offenders,
)

NAME = ("wall", "shell.stl", "mm")


@pytest.mark.parametrize(
    ("make", "passes"),
    [
        (at_most, [True, True, False]),
        (at_least, [False, True, True]),
        (exactly, [False, True, False]),
    ],
)
def test_a_limit_is_allowed_itself_and_nan_never(make, passes: list[bool]) -> None:
    assert [make(NAME, 2.0 + by, 2.0).passed for by in (-1e-9, 0, 1e-9)] == passes
    assert make(NAME, math.nan, 2.0).passed is False
    assert make(NAME, math.nan, 2.0).measured is None


def test_details_are_of_what_fails_only() -> None:
    assert at_most(NAME, 3.0, 2.0, "thick") == Check(
        "wall", "shell.stl", False, 3.0, 2.0, "mm", "thick", "at most"
    )
    assert at_most(NAME, 1.0, 2.0, "thick").detail == ""
    assert informative(NAME, math.inf, "why").passed is True
    assert informative(NAME, math.inf, "why").measured is None


def test_each_is_held_against_the_limit() -> None:
    names, errors = ["a", "b", "c"], np.array([1.0, 3.0, 2.0])
    assert each_at_most(NAME, names, errors, 3.0, "mm").passed
    failed = each_at_most(NAME, names, errors, 1.5, "mm", "off: ")
    assert (failed.passed, failed.measured, failed.limit) == (False, 3.0, 1.5)
    assert failed.detail == "off: b 3 mm, c 2 mm"
    assert each_at_most(NAME, [], np.empty(0), 1.0, "mm").measured == 0
    lost = each_at_most(NAME, names, np.array([0, math.nan, 0]), 1.0, "mm")
    assert lost.passed is False
    assert lost.detail == "b nan mm"


@pytest.mark.parametrize(("more", "end"), [(-1, "s3"), (0, "s4"), (1, "s4 and 1 more")])
def test_lists_are_short(more: int, end: str) -> None:
    names = [f"s{k}" for k in range(MAX_NAMED + more)]
    assert short_list(names).endswith(end)
    values = -np.arange(len(names), dtype=float)
    said = worst_offenders(names, values, "mm", np.ones(len(names), dtype=bool), ".0f")
    assert said.startswith("s0 -0 mm, s1 -1 mm")
    assert said.endswith(" and 1 more") == (more > 0)


def test_what_breaks_is_unknown() -> None:
    def breaks(*_: object) -> Check:
        raise ValueError("no\nlines")

    (lost,) = guarded([NAME], lambda: [breaks()])
    assert (lost.passed, lost.detail) == (None, "ValueError: no")
    both = guarded_each([NAME, NAME], [breaks, lambda name: at_most(name, 1, 2)])
    assert [one.passed for one in both] == [None, True]
    assert attempt(breaks) == (None, "ValueError: no")
    assert attempt(lambda: 3) == (3, "")
    assert require(0, "why") == 0
    with pytest.raises(Unknown, match="why"):
        require(None, "why")
