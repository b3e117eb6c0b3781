"""assembly.pdf: all words and parts of the steps, inside its borders, the same bytes each time."""

import re
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import pytest
import trimesh
from tbcad_verify.prototype.drawing_files import sheet_faults
from tbcad_verify.record.files import read

from tbcad.cad.drafting.sheet import BORDER_MM, LEFT_MM
from tbcad.cad.formats.entities import Entity, Layer, Line, Polyline, Text
from tbcad.cad.formats.glb import ColouredMesh
from tbcad.cad.formats.pdf import drawable, text_width
from tbcad.cad.kernel.mesh import Mesh
from tbcad.core.spec.design import PrinterSpec
from tbcad.prototype.assembly_steps.book import NAME, PAPER, TITLE, book, write_book
from tbcad.prototype.assembly_steps.instructions import (
    _words,
    designation,
    hours_text,
    instructions,
    work_minutes,
)
from tbcad.prototype.assembly_steps.machine import AssembledMachine, read_machine
from tbcad.prototype.assembly_steps.views import _chained, _clipped
from tbcad.prototype.purchased.parts import load_parts
from tests.prototype.assembly_steps.test_steps import LOOSE, belt_design, write

Bodies = dict[str, trimesh.Trimesh]
MAKERS = re.compile(r"SS-5GL2|17HS|TMC\d|JST|Omron|Trinamic|Meanwell", re.IGNORECASE)
BORDERS = np.array([LEFT_MM, BORDER_MM, PAPER[0] - BORDER_MM, PAPER[1] - BORDER_MM])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write(tmp_path, belt_design(), LOOSE)


@pytest.fixture
def machine(folder: Path) -> AssembledMachine:
    return read_machine(folder)


@pytest.fixture
def bodies(machine: AssembledMachine) -> Bodies:
    """A box in a place of its own for each body."""
    names = [*machine.bodies, *(one.name for one in machine.fasteners)]
    found = {
        name: trimesh.creation.box((8.0, 6.0, 4.0))
        for name in names
        if name not in ("camera", "ball_1")
    }
    for k, one in enumerate(found.values()):
        one.apply_translation([12.0 * (k % 4), 10.0 * (k // 4), 3.0 * k])
    return found


@pytest.fixture
def sheets(machine: AssembledMachine, bodies: Bodies) -> list[list[Entity]]:
    return book(machine, bodies, "some, n = 4", PrinterSpec())


def texts(entities: list[Entity]) -> list[Text]:
    return [one for one in entities if isinstance(one, Text)]


def test_all_words_are_there(machine: AssembledMachine, sheets: list[list[Entity]]) -> None:
    told = instructions(machine, PrinterSpec())
    shown = " ".join(one.text for sheet in sheets for one in texts(sheet))
    steps = [text for step in told.steps for text in (*step.does, *step.fits, *step.checks)]
    for text in (
        *told.about,
        *told.tools,
        *told.times,
        *told.not_drawn,
        *sum(told.printing, ()),
        *steps,
    ):
        assert " ".join(text.split()) in shown
        assert drawable(text) == text  # no question marks for what Helvetica lacks
    for step in told.steps:
        assert f"{step.number}. {step.title}" in shown
        assert f"About {hours_text(told.minutes[step.key])}." in shown
    assert all(result.startswith("not tested") for _, result in told.tested)
    assert all(what in shown for what, _ in told.tested)


def test_parts_of_the_steps_are_those_of_the_list(
    machine: AssembledMachine, sheets: list[list[Entity]]
) -> None:
    """As printed: number, quantity and name in rows of the sheets of steps."""
    sums, names = Counter[str](), {str(item): part for part, item in machine.bill.items.items()}
    for sheet in sheets:
        rows: dict[float, list[str]] = defaultdict(list)
        for one in texts(sheet):
            rows[round(one.place[1], 3)].append(one.text)
        if any(one.text == TITLE for one in texts(sheet)):
            continue  # the whole list
        for first, *others in rows.values():
            if len(others) == 3 and names.get(first) == others[1]:
                sums[others[1]] += int(others[0])
    assert sums == Counter(machine.bill.quantities)


def test_nothing_is_beyond_the_border(sheets: list[list[Entity]]) -> None:
    for number, sheet in enumerate(sheets, 1):
        assert f"{number} of {len(sheets)}" in [one.text for one in texts(sheet)]
        for one in texts(sheet):
            width = text_width(one.text, one.height)
            left = one.place[0] - {"left": 0.0, "centre": 0.5, "right": 1.0}[one.align] * width
            assert BORDERS[0] < left, one
            assert left + width < BORDERS[2], one
            assert BORDERS[1] < one.place[1] < BORDERS[3] - one.height, one
        for line in (one for one in sheet if isinstance(one, Polyline)):
            corners = np.array(line.corners)
            assert (corners >= BORDERS[:2]).all()
            assert (corners <= BORDERS[2:]).all()


def test_the_same_bytes_which_the_verification_takes(folder: Path, bodies: Bodies) -> None:
    meshes = [
        ColouredMesh(name, "g", Mesh(np.array(one.vertices), one.faces), (1.0, 1.0, 1.0, 1.0))
        for name, one in bodies.items()
    ]
    write_book(folder, meshes, "some, n = 4", PrinterSpec())
    data = (folder / NAME).read_bytes()
    write_book(folder, meshes, "some, n = 4", PrinterSpec())
    assert (folder / NAME).read_bytes() == data
    assert sheet_faults(read(folder, NAME, 10**7)) == []
    broken = {
        b"/Pages 2 0 R>>": b"/Pages 2 0 R/OpenAction<</S/JavaScript/JS(app.alert(1))>>>>",
        b"[0 0 595.2756 841.8898]": b"[0 0 842 595]",
        b"1 J 1 j": b"/X Do",
        b"/Info": b"/Names 3 0 R/Info",
        b" S\n": b" S\n(x) Tj\n",
        b"endobj\n6 0 obj": b"endobj\n99 0 obj\n<</S/Launch/F(a)>>\nendobj\n6 0 obj",
    }
    for old, new in broken.items():
        assert old in data
        (folder / NAME).write_bytes(data.replace(old, new, 1))
        assert sheet_faults(read(folder, NAME, 10**7)), new


def test_no_designation_has_a_makers_number() -> None:
    for name, part in load_parts().items():
        told = designation({"what": part.what})
        assert told
        assert not MAKERS.search(f"{name} {told}")


def test_times_are_sums(machine: AssembledMachine) -> None:
    told = instructions(machine, PrinterSpec())
    motor = next(step for step in told.steps if step.key == "motor")
    # Motor 3, pinion 2, a screw 0.8; 1.5 for each instruction and 1 for each check.
    expected = 3 + 2 + 0.8 + 1.5 * len(motor.does) + len(motor.checks)
    assert work_minutes(machine, motor) == pytest.approx(expected)
    kinds = {part.kind for part in load_parts().values()}
    assert kinds <= {*_words()["minutes"]}
    assert [hours_text(one) for one in (1.0, 57.0, 58.0, 130.0)] == [
        *("5 min", "55 min", "1 h", "2 h 10 min")
    ]


def test_lines_are_cut_at_the_room() -> None:
    room = (0.0, 0.0, 10.0, 5.0)
    assert _clipped((-5.0, 1.0), (15.0, 1.0), room) == ((0.0, 1.0), (10.0, 1.0))
    assert _clipped((-5.0, 6.0), (15.0, 6.0), room) is None
    assert _clipped((-2.0, 0.0), (0.0, 8.0), room) is None
    assert _clipped((1.0, 1.0), (1.0, 9.0), room) == ((1.0, 1.0), (1.0, 5.0))


def test_chains_have_each_line_once() -> None:
    rng = np.random.default_rng(1)
    ends = [tuple(map(float, pair)) for pair in rng.integers(0, 4, (80, 4))]
    lines = {Line(Layer.CUT, *sorted(((a, b), (c, d)))) for a, b, c, d in ends if (a, b) != (c, d)}
    chains = [one for one in _chained(lines) if isinstance(one, Polyline)]
    found = [
        Line(one.layer, *sorted(pair))
        for one in chains
        for pair in zip(one.corners, one.corners[1:], strict=False)
    ]
    assert len(chains) < len(lines) / 2
    assert Counter(found) == Counter(lines)
