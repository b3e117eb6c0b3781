"""Mutation of the verification itself: single lines changed, and the tests that should notice.

python tests/verify/mutation.py [--count 54] [--seed 1] [--module WORD ...] [--jobs 1]

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
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "verify" / "tbcad_verify"
# Modules whose changes are looked for, and the tests that should notice them.
PRINTING = ["tests/verify/printing"]
MEASURES = ["tests/verify/printing/test_part_measures.py"]
GCODE = ["tests/verify/prototype/test_gcode.py"]
PROTOTYPE = ["tests/verify/prototype/test_measured_prototype.py"]
CASING = ["tests/verify/shell/test_mesh_casing.py"]
TESTS: dict[str, list[str]] = {
    "mesh/fits.py": ["tests/verify/mesh"],
    "mesh/holes.py": ["tests/verify/mesh/test_circles.py", *MEASURES, *CASING],
    "mesh/lines.py": ["tests/verify/mesh"],
    "mesh/mesh.py": ["tests/verify/mesh"],
    "mesh/rays.py": ["tests/verify/mesh/test_rays.py", *CASING, *MEASURES],
    "mesh/segments.py": ["tests/verify/mesh", "tests/verify/shell/test_recovery.py"],
    "mesh/surfaces.py": ["tests/verify/mesh"],
    "mesh/threemf_structure.py": ["tests/verify/corpus/test_files.py", "-m", "corpus", "-k", "3MF"],
    "printing/assessment.py": PRINTING,
    "printing/placement.py": PRINTING,
    "printing/walls.py": MEASURES,
    "prototype/gcode_checks.py": GCODE,
    "prototype/gcode_lines.py": GCODE,
    "prototype/gcode_machine.py": GCODE,
    "prototype/record_checks.py": ["tests/verify/prototype/test_stages.py"],
    "prototype/seats.py": PROTOTYPE,
    "record/columns.py": ["tests/verify/record/test_bad_input.py"],
    "record/flange_holes.py": ["tests/verify/record/test_flange_holes.py"],
    "record/joining_planes.py": ["tests/verify/shell/test_seam_and_foot.py"],
    "record/poses.py": ["tests/verify/record/test_poses.py"],
    "record/radius_rule.py": ["tests/verify/record/test_radius_rule.py"],
    "record/spec.py": ["tests/verify/record/test_spec.py"],
    "report/checks.py": ["tests/verify/report/test_checks.py"],
    "shell/mesh_casing.py": CASING,
    "step/casing.py": ["tests/verify/step/test_solids_text.py"],
    "step/part21.py": ["tests/verify/step/test_part21.py", "tests/verify/step/test_solids_text.py"],
    "step/pedestals.py": ["tests/verify/step/test_pedestals.py"],
    "step/solids_text.py": ["tests/verify/step/test_solids_text.py"],
    "step/sphere_union.py": ["tests/verify/step/test_sphere_union.py"],
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
    parser.add_argument("--count", type=int, default=54, help="mutations")
    parser.add_argument("--seed", type=int, default=1, help="of the choice")
    parser.add_argument("--module", nargs="+", default=[""], help="words in modules' paths")
    parser.add_argument("--jobs", type=int, default=1, help="mutations at a time")
    parser.add_argument("--seconds", type=float, default=300, help="limit of one mutation's tests")
    options = parser.parse_args()
    every = [
        change
        for module in TESTS
        if any(word in module for word in options.module)
        for change in changes(module)
    ]
    dice = random.Random(options.seed)
    dice.shuffle(every)
    # One of each module, then the second of each ..., so that no module is passed over.
    modules = [change.module for change in every]
    rank = {change: modules[:k].count(change.module) for k, change in enumerate(every)}
    some = sorted(every, key=rank.__getitem__)[: options.count]
    alive = 0
    with ThreadPoolExecutor(options.jobs) as pool:
        outcomes = pool.map(lambda change: survives(change, options.seconds), some)
        for change, survivor in zip(some, outcomes, strict=True):
            alive += survivor
            line = (PACKAGE / change.module).read_text().splitlines()[change.line - 1].strip()
            mark = "SURVIVES" if survivor else "caught  "
            print(f"{mark} {change.module}:{change.line} {change.what}: {line}", flush=True)
    print(f"{len(some) - alive} of {len(some)} caught")
    return int(alive > 0)


if __name__ == "__main__":
    sys.exit(main())
