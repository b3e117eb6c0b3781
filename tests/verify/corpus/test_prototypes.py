"""Broken copies of a real prototype must be caught, each for its own reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.verify.corpus.broken_prototypes import GOOD, PROTOTYPES
from tests.verify.corpus.mutation import Mutation
from tests.verify.corpus.trial import HERE, attempt

pytestmark = pytest.mark.corpus


@pytest.mark.parametrize("mutation", [*GOOD, *PROTOTYPES], ids=lambda m: m.name)
def test_caught(mutation: Mutation, good_prototype: Path, tmp_path: Path) -> None:
    outcome = attempt(mutation, good_prototype, tmp_path, HERE)
    assert not outcome.wanting, outcome
