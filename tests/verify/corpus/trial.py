"""Trying one mutation: break a copy, verify it, and judge what the verification says."""

from __future__ import annotations

import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tbcad_verify import BadExport
from tbcad_verify.report.checks import Check
from tbcad_verify.run.verify import VerifyOptions, verify

from tests.verify.corpus.copies import copy, sign
from tests.verify.corpus.mutation import Mutation

HERE = VerifyOptions(write=False, apart=False)


@dataclass(frozen=True)
class Outcome:
    """What the verification said.

    Attributes:
        status: exit status; 3 for a traceback.
        said: every check that did not pass, or the refusal.
        wanting: what it should have said and did not; empty: the mutation was caught.
        seconds: of the verification.
    """

    status: int
    said: str
    wanting: str
    seconds: float


def attempt(mutation: Mutation, export: Path, room: Path, options: VerifyOptions) -> Outcome:
    """Break a copy in an empty folder of its own, and verify it."""
    folder = copy(export, room / "export")
    words = list(mutation.words)
    if not mutation.during:
        words += _broken(mutation, folder)
    begin = time.perf_counter()
    try:
        checks = verify(folder, _interference(mutation, folder), options).checks
    except BadExport as error:
        outcome = _refusal(mutation, words, str(error))
    except Exception as error:
        outcome = 3, f"{type(error).__name__}: {error}", "a traceback"
    else:
        outcome = _verdict(mutation, words, checks)
    seconds = time.perf_counter() - begin
    shutil.rmtree(room)
    return Outcome(*outcome, seconds)


def _broken(mutation: Mutation, folder: Path) -> Sequence[str]:
    words = mutation.job(folder)
    if mutation.signed and (folder / "manifest.json").is_file():
        sign(folder)
    return words


def _interference(mutation: Mutation, folder: Path):
    def progress(stage: str) -> None:
        if stage == mutation.during:
            mutation.job(folder)

    return progress


def _refusal(mutation: Mutation, words: list[str], said: str) -> tuple[int, str, str]:
    if mutation.status != 2:
        return 2, said, "refused instead of measured"
    return 2, said, _missing(words, said)


def _verdict(mutation: Mutation, words: list[str], checks: Sequence[Check]) -> tuple[int, str, str]:
    bad = [check for check in checks if check.passed is not True]
    said = "; ".join(f"{_mark(check)}{check.name}: {check.detail}" for check in bad)
    if mutation.status != int(bool(bad)):
        return int(bool(bad)), said, "another exit status"
    mine = [c for c in bad if c.name in mutation.checks and (c.passed is None) == mutation.unknown]
    if not mine and mutation.status:
        return 1, said, f"none of {', '.join(mutation.checks)} says so"
    if mutation.alone and len(mine) < len(bad):
        return 1, said, "another check says so too"
    return int(bool(bad)), said, _missing(words, "; ".join(check.detail for check in mine))


def _mark(check: Check) -> str:
    return "unknown " if check.passed is None else ""


def _missing(words: list[str], said: str) -> str:
    lost = [word for word in words if word not in said]
    return f"does not say {', '.join(map(repr, lost))}" if lost else ""
