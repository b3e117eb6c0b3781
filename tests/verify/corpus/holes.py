"""Mutations that the verification is known to pass; one that it catches moves to its own list."""

from __future__ import annotations

from tests.verify.corpus.mutation import Mutation, fails
from tests.verify.corpus.record_changes import TABLE, Row, mirror


def coverage(one: Row) -> None:
    """What a mirror is said to see, for a person to read; what it sees is measured."""
    one["coverage_mm"] *= 1.05


HOLES: tuple[Mutation, ...] = (
    fails("a mirror's recorded coverage", TABLE, mirror(coverage), "figures"),
)
