"""One way to break a good export, and what the verification must say then."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

# Breaks a copy of a good export in place, and returns what the message must name (mirrors, files).
Job = Callable[[Path], Sequence[str]]


@dataclass(frozen=True)
class Mutation:
    """One broken export.

    Attributes:
        name: what is wrong with it.
        kind: the kind of file that is broken.
        job: breaks it.
        status: exit status that the verification must end with: 1 not verified, 2 no export.
        checks: of these one at least must fail (exit 1).
        words: must be in what the failed checks of that name say, or in the refusal; so must what
            the job returns.
        unknown: the checks cannot be made, instead of being made and failing.
        during: the stage at whose beginning the job is done; empty: before the verification.
        signed: the manifest is written anew, so that measuring and not hashing must catch it.
        heavy: wants gigabytes of memory; not for every test run.
        alone: no other check may fail.
    """

    name: str
    kind: str
    job: Job
    status: int
    checks: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    unknown: bool = False
    during: str = ""
    signed: bool = True
    heavy: bool = False
    alone: bool = False


def fails(name: str, kind: str, job: Job, checks: str | tuple[str, ...], *words: str) -> Mutation:
    """A mutation that a check must measure."""
    return Mutation(name, kind, job, 1, (checks,) if isinstance(checks, str) else checks, words)


def refused(name: str, kind: str, job: Job, *words: str) -> Mutation:
    """A mutation after which the folder is no export."""
    return Mutation(name, kind, job, 2, (), words)


def only(mutation: Mutation) -> Mutation:
    """The same, of which no other check may say anything."""
    return replace(mutation, alone=True)
