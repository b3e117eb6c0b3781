"""The designs that come with tbcad, by name."""

import os
from difflib import get_close_matches
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from tbcad.spec.errors import SpecError

PAPER = "turtleback"  # equal to the defaults of all keys
LIKENESS = 0.8


def shipped_designs() -> dict[str, Traversable]:
    """The files of all designs that come with tbcad, by name, the paper's first."""
    found = [one for one in _folder().iterdir() if one.name.endswith(".toml")]
    by_name = {one.name.removesuffix(".toml"): one for one in found}
    return {name: by_name[name] for name in sorted(by_name, key=lambda name: (name != PAPER, name))}


def _folder() -> Traversable:
    """Where a wheel puts designs/, or where a checkout has it."""
    installed = files("tbcad") / "designs"
    return installed if installed.is_dir() else Path(__file__).parents[2] / "designs"


def design_source(path: Path) -> Path | Traversable:
    """The file that a user means: the name of a design that comes with tbcad, or a path.

    Raises:
        SpecError: there is no such file, and the name is nearly that of a design.
    """
    known = shipped_designs()
    near = get_close_matches(str(path), known, 1, LIKENESS)
    if not near or os.path.lexists(path):
        return path
    if str(path) not in known:
        raise SpecError(f"{path}: no such file, and no such design: did you mean {near[0]}?")
    return known[str(path)]
