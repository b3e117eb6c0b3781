"""Broken STEP and 3MF files and folders: each must be caught, and for its own reason."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.verify.corpus.broken_3mfs import THREEMFS
from tests.verify.corpus.broken_files import FILES
from tests.verify.corpus.broken_steps import STEPS
from tests.verify.corpus.good import HERE, export
from tests.verify.corpus.mutation import Mutation
from tests.verify.corpus.readings import remembered
from tests.verify.corpus.trial import attempt

pytestmark = pytest.mark.corpus


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with export(tmp_path_factory.mktemp("corpus")) as folder, remembered():
        yield folder


@pytest.mark.parametrize("mutation", [*STEPS, *THREEMFS, *FILES], ids=lambda m: m.name)
def test_caught(mutation: Mutation, good: Path, tmp_path: Path) -> None:
    outcome = attempt(mutation, good, tmp_path, HERE)
    assert not outcome.wanting, outcome
