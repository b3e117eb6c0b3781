"""The whole corpus on copies of a given export: a table, and how many mutations were caught.

python -m tests.verify.corpus.run_corpus EXPORT [--jobs 2] [--only WORD ...] [--heavy]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tbcad_verify.run.verify import VerifyOptions

from tests.verify.corpus.copies import digests
from tests.verify.corpus.harmless import HARMLESS
from tests.verify.corpus.mutation import Mutation
from tests.verify.corpus.readings import remembered
from tests.verify.corpus.trial import Outcome, attempt
from tests.verify.corpus.whole_corpus import ALL

HEADING = "| mutation | breaks | expected | found | caught | s |\n|---|---|---|---|---|---|"
LONGEST = 160  # characters of a cell
STATUS = {0: "verified", 1: "not verified", 2: "refused", 3: "crashed"}


def main(argv: Sequence[str] | None = None) -> int:
    options = arguments(argv)
    before = digests(options.export)
    print(HEADING)
    with remembered():
        caught, count = told(options, [m for m in ALL if options.heavy or not m.heavy])
        good, harmless = told(options, HARMLESS)
    if digests(options.export) != before:
        print("\nthe export itself was changed")
        return 1
    print(f"\n{good} of {harmless} harmless changes pass\n{caught} of {count} caught")
    return int(caught < count or good < harmless)


def arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("export", type=Path, help="a good export that tbcad build wrote")
    parser.add_argument("--jobs", type=int, default=2, help="verifications at once")
    parser.add_argument("--only", nargs="+", default=[""], help="words in their names")
    parser.add_argument("--heavy", action="store_true", help="also those that want much memory")
    return parser.parse_args(argv)


def told(options: argparse.Namespace, mutations: Sequence[Mutation]) -> tuple[int, int]:
    """A row for each; how many were caught, of how many."""
    some = [
        mutation for mutation in mutations if any(word in mutation.name for word in options.only)
    ]
    count = 0
    for mutation, outcome in zip(some, tried(options, some), strict=True):
        print(row(mutation, outcome), flush=True)
        count += not outcome.wanting
    return count, len(some)


def tried(options: argparse.Namespace, mutations: Sequence[Mutation]) -> Iterator[Outcome]:
    with tempfile.TemporaryDirectory(dir=options.export.resolve().parent) as place:

        def one(mutation: Mutation) -> Outcome:
            room = Path(tempfile.mkdtemp(dir=place))
            return attempt(mutation, options.export, room, VerifyOptions(write=False))

        with ThreadPoolExecutor(options.jobs) as pool:
            yield from pool.map(one, mutations)


def row(mutation: Mutation, outcome: Outcome) -> str:
    cells = (
        mutation.name,
        mutation.kind,
        expected(mutation),
        f"{STATUS[outcome.status]}: {outcome.said}" if outcome.said else STATUS[outcome.status],
        f"NO: {outcome.wanting}" if outcome.wanting else "yes",
        f"{outcome.seconds:.1f}",
    )
    return "| " + " | ".join(shortened(cell) for cell in cells) + " |"


def expected(mutation: Mutation) -> str:
    said = " or ".join(mutation.checks) or ", ".join(mutation.words)
    how = "unknown: " if mutation.unknown else ""
    return f"{STATUS[mutation.status]}: {how}{said}" if said else STATUS[mutation.status]


def shortened(cell: str) -> str:
    plain = cell.replace("|", "/").replace("\n", " ")
    return plain if len(plain) <= LONGEST else plain[:LONGEST] + " ..."


if __name__ == "__main__":
    sys.exit(main())
