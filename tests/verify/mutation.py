"""Mutation of the verification itself: single lines changed, and the tests that should notice.

python tests/verify/mutation.py [--count 40] [--seed 1] [--module WORD ...] [--seconds 300]

Each mutation is made in a private copy of `verify/`, which the tests import. One that no test
notices survives, and is printed with its line: it wants a test, or a line in verify/README.md that
says why it changes nothing.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "verify" / "tbcad_verify"
# Modules whose changes are looked for, and the tests that should notice them.
TESTS: dict[str, list[str]] = {
    "mesh/threemf_structure.py": ["tests/verify/corpus/test_files.py", "-m", "corpus", "-k", "3MF"],
    "prototype/gcode_lines.py": ["tests/verify/prototype/test_gcode.py"],
    "prototype/gcode_machine.py": ["tests/verify/prototype/test_gcode.py"],
    "prototype/gcode_checks.py": ["tests/verify/prototype/test_gcode.py"],
    "step/solids_text.py": ["tests/verify/step/test_solids_text.py"],
    "step/casing.py": ["tests/verify/step/test_solids_text.py"],
    "record/radius_rule.py": ["tests/verify/record/test_radius_rule.py"],
}
COMPARISONS = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
ARITHMETIC = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
SCALE = 3.0  # of numbers


@dataclass(frozen=True)
class Change:
    """One change of a module.

    Attributes:
        module: path in the package.
        index: of the node, as `ast.walk` has it.
        line: from 1.
        what: in words.
    """

    module: str
    index: int
    line: int
    what: str


def changes(module: str) -> Iterator[Change]:
    """All changes of a module: comparisons turned, signs exchanged, numbers scaled, not dropped."""
    for index, node in enumerate(ast.walk(ast.parse((PACKAGE / module).read_text()))):
        what = _changed(node)
        if what:
            yield Change(module, index, node.lineno, what)  # type: ignore[attr-defined]


def mutated(change: Change) -> str:
    """The module's text with the change."""
    tree = ast.parse((PACKAGE / change.module).read_text())
    node = next(one for k, one in enumerate(ast.walk(tree)) if k == change.index)
    if _changed(node) != change.what:
        raise SystemExit(f"{change.module} was edited while mutations of it were tried")
    return ast.unparse(tree)


def _changed(node: ast.AST) -> str:
    """Change a node in place; what was done, or empty."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
        old = type(node.ops[0])
        node.ops[0] = COMPARISONS[old]()
        return f"{old.__name__} to {COMPARISONS[old].__name__}"
    if isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
        kind = type(node.op)
        node.op = ARITHMETIC[kind]()
        return f"{kind.__name__} to {ARITHMETIC[kind].__name__}"
    if isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value:
        node.value = node.value * SCALE if isinstance(node.value, float) else node.value + 1
        return f"number to {node.value:g}"
    if isinstance(node, ast.BoolOp):
        kind = type(node.op)
        node.op = ast.And() if kind is ast.Or else ast.Or()
        return f"{kind.__name__} to {type(node.op).__name__}"
    return ""


def survives(change: Change, seconds: float) -> bool:
    """Whether no test notices a change."""
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place) / "tbcad_verify"
        shutil.copytree(PACKAGE, copy)
        (copy / change.module).write_text(mutated(change))
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider"]
        # pyproject.toml puts the real package first.
        command += ["-o", f"pythonpath={ROOT} {place}"]
        try:
            done = subprocess.run(
                [*command, *TESTS[change.module]],
                cwd=ROOT,
                env={**os.environ, "PYTHONPATH": place},
                capture_output=True,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return False
        return done.returncode == 0


def main() -> int:
    """Make mutations, and print those that survive."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=40, help="mutations")
    parser.add_argument("--seed", type=int, default=1, help="of the choice")
    parser.add_argument("--module", nargs="+", default=[""], help="words in modules' paths")
    parser.add_argument("--seconds", type=float, default=300, help="limit of one mutation's tests")
    options = parser.parse_args()
    every = [
        change
        for module in TESTS
        if any(word in module for word in options.module)
        for change in changes(module)
    ]
    some = random.Random(options.seed).sample(every, min(options.count, len(every)))
    alive = 0
    for change in some:
        survivor = survives(change, options.seconds)
        alive += survivor
        line = (PACKAGE / change.module).read_text().splitlines()[change.line - 1].strip()
        mark = "SURVIVES" if survivor else "caught  "
        print(f"{mark} {change.module}:{change.line} {change.what}: {line}", flush=True)
    print(f"{len(some) - alive} of {len(some)} caught")
    return int(alive > 0)


if __name__ == "__main__":
    sys.exit(main())
