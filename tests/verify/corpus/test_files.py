"""Broken STEP and 3MF files and folders: each must be caught, and for its own reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.verify.corpus.broken_3mfs import THREEMFS
from tests.verify.corpus.broken_files import FILES
from tests.verify.corpus.broken_steps import STEPS
from tests.verify.corpus.mutation import Mutation
from tests.verify.corpus.trial import HERE, attempt

pytestmark = pytest.mark.corpus


@pytest.mark.parametrize("mutation", [*STEPS, *THREEMFS, *FILES], ids=lambda m: m.name)
def test_caught(mutation: Mutation, good: Path, tmp_path: Path) -> None:
    outcome = attempt(mutation, good, tmp_path, HERE)
    assert not outcome.wanting, outcome
