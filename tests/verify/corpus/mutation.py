"""Ways to break a good export, what the verification must say then, and the trial of one."""

from __future__ import annotations

import re
import shutil
from collections import Counter
from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tbcad_verify import BadExport
from tbcad_verify.report.checks import Check
from tbcad_verify.run.verify import VerifyOptions, verify

from tests.verify.corpus.copies import change, copy, load, sign, store

# Breaks a copy of a good export in place, and may return what the message must name.
Job = Callable[[Path], Sequence[str] | None]
HERE = VerifyOptions(write=False, apart=False)
DROP = object()
TOGETHER = 6  # mutations of one verification: so few that none hides another


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
    alone: bool = False

    def __str__(self) -> str:
        return f"{self.kind}: {self.name}"

    @property
    def joinable(self) -> bool:
        """Whether it is measured, before which others may be made in the same copy."""
        return self.status == 1 and not self.unknown and not self.during and self.signed


def fails(name: str, kind: str, job: Job, checks: str | tuple[str, ...], *words: str) -> Mutation:
    """A mutation that a check must measure."""
    return Mutation(name, kind, job, 1, (checks,) if isinstance(checks, str) else checks, words)


def refused(name: str, kind: str, job: Job, *words: str) -> Mutation:
    """A mutation after which the folder is no export."""
    return Mutation(name, kind, job, 2, (), words)


def failing(kind: str, *rows: tuple[Any, ...], **more: Any) -> tuple[Mutation, ...]:
    """A table of mutations that are measured: name, job, check, words to be said."""
    return tuple(replace(fails(name, kind, *rest), **more) for name, *rest in rows)


def refusing(kind: str, *rows: tuple[Any, ...], **more: Any) -> tuple[Mutation, ...]:
    """A table of mutations that are refused: name, job, words to be said."""
    return tuple(replace(refused(name, kind, *rest), **more) for name, *rest in rows)


def at(path: str, to: object = DROP, file: str = "design.json") -> Job:
    """Another value at a path of keys of a JSON file, or what a function makes of it; or none.

    Items of a list are named by number, or by what the first one's name or part begins with.
    """

    def job(folder: Path) -> None:
        value = inside = load(folder, file)
        *keys, last = path.split("/")
        for key in keys:
            inside = inside[_place(inside, key)]
        place = _place(inside, last)
        if to is DROP:
            del inside[place]
        else:
            inside[place] = to(inside[place]) if callable(to) else to
        store(folder, file, value)

    return job


def _place(value: Any, key: str) -> str | int:
    if isinstance(value, dict):
        return key
    if re.fullmatch(r"-?\d+", key):
        return int(key)
    names = [(one.get("name", ""), one.get("part", "")) for one in value]
    return next(k for k, some in enumerate(names) if any(name.startswith(key) for name in some))


def plus(by: float) -> Callable[[float], float]:
    return lambda value: value + by


def together(*jobs: Job) -> Job:
    """Several changes, in order."""
    return lambda folder: [word for job in jobs for word in job(folder) or ()]


def as_bytes(name: str, how: Callable[[bytes], bytes]) -> Job:
    """Change the bytes of a file."""

    def job(folder: Path) -> None:
        change(folder, name, how)

    return job


def batches(mutations: Sequence[Mutation], solitary: Set[str] = frozenset()) -> list[Batch]:
    """Mutations that fail different checks, together: one verification must tell each of them.

    Verified alone is what cannot be read, after which other checks cannot be made, and what is
    named as solitary: other checks need what it takes away.
    """
    alike = Counter(one.checks for one in mutations)
    found: list[list[Mutation]] = []
    for one in sorted(mutations, key=lambda one: -alike[one.checks]):
        fits = (
            some
            for some in found
            if len(some) < TOGETHER
            and one.joinable
            and not {name for other in some for name in other.checks} & {*one.checks}
        )
        if not (mine := next(fits, [])) and one.joinable:
            found.append(mine)
        mine.append(one)
    alone = [one for one in mutations if one.name in solitary or not one.joinable]
    joined = [[one for one in some if one.name not in solitary] for some in found]
    return [*map(Batch, joined), *(Batch([one]) for one in alone)]


class Batch(tuple[Mutation, ...]):
    """Mutations of one verification."""

    def __str__(self) -> str:
        return str(self[0]) + (f" and {len(self) - 1} more" if len(self) > 1 else "")

    def attempt(self, export: Path, room: Path) -> str:
        """As `attempt`, all of them in one copy."""
        if len(self) == 1:
            return attempt(self[0], export, room)
        folder = copy(export, room / "export")
        words = [[*one.words, *(one.job(folder) or ())] for one in self]
        sign(folder)
        checks = verify(folder, lambda _: None, HERE).checks
        shutil.rmtree(room)
        wanting = [_verdict(*each, checks) for each in zip(self, words, strict=True)]
        told = zip(self, wanting, strict=True)
        return "\n".join(f"{one}: {words}" for one, words in told if words)


def attempt(mutation: Mutation, export: Path, room: Path) -> str:
    """Break a copy in a folder of its own, and verify it; what is wanting then, or empty."""
    folder = copy(export, room / "export")
    words = list(mutation.words)
    if not mutation.during:
        words += mutation.job(folder) or ()
        if mutation.signed and (folder / "manifest.json").is_file():
            sign(folder)

    def progress(stage: str) -> None:
        if stage == mutation.during:
            mutation.job(folder)

    try:
        checks: Sequence[Check] = verify(folder, progress, HERE).checks
    except BadExport as error:
        wanting = _missing(words, str(error)) if mutation.status == 2 else f"refused: {error}"
    else:
        wanting = _verdict(mutation, words, checks)
    shutil.rmtree(room)
    return wanting


def _verdict(mutation: Mutation, words: list[str], checks: Sequence[Check]) -> str:
    bad = [check for check in checks if check.passed is not True]
    mine = [c for c in bad if c.name in mutation.checks and (c.passed is None) == mutation.unknown]
    said = "; ".join(f"{check.name} {check.passed}: {check.detail}" for check in bad)
    if mutation.status != int(bool(bad)):
        return f"another exit status: {said}"
    if mutation.status and not mine:
        return f"none of {', '.join(mutation.checks)} says so: {said}"
    if mutation.alone and len(mine) < len(bad):
        return f"another check says so too: {said}"
    return _missing(words, "; ".join(check.detail for check in mine))


def _missing(words: list[str], said: str) -> str:
    lost = [word for word in words if word not in said]
    return f"does not say {', '.join(map(repr, lost))}: {said}" if lost else ""
