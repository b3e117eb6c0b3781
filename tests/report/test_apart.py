"""Parts apart from their places: in the order in which a screw goes through them."""

from pathlib import Path

import numpy as np

from tbcad.prototype.assembly_steps.machine import read_machine
from tbcad.report.exploded import offsets
from tests.prototype.assembly_steps.test_steps import LOOSE, belt_design, write


def test_bodies_are_moved_against_their_screws(tmp_path: Path) -> None:
    machine = read_machine(write(tmp_path, belt_design(), LOOSE))
    moved = offsets(machine, frozenset({"wheel", "zero_disc", "M3x16_1"}))
    along = [moved[name][2] for name in ("M3x16_1", "wheel", "zero_disc")]
    assert along == sorted(along)
    assert along[-1] < 0
    assert all(np.all(offset[:2] == 0) for offset in moved.values())


def test_what_a_screw_ends_in_is_moved_away_from_what_is_there(tmp_path: Path) -> None:
    machine = read_machine(write(tmp_path, belt_design(), LOOSE))
    moved = offsets(machine, frozenset({"motor", "M3x12_1"}))
    assert moved["M3x12_1"][2] < 0 < moved["motor"][2]
