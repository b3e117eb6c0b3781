"""A good prototype passes; one broken in one way fails, for that reason and not for another."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tbcad_verify import BadExport, main, verify
from tbcad_verify.prototype import record_checks
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.export import read_export
from tbcad_verify.record.prototype import read_prototype
from tbcad_verify.report.checks import Check
from tbcad_verify.report.report import Report

from tests.exported_files import Rows, contents
from tests.verify.corpus.broken_prototypes import record, table
from tests.verify.corpus.mutation import Job, together
from tests.verify.optical_setups import IN_PROCESS
from tests.verify.prototype.synthetic_prototype import (
    NOT_MADE,
    SyntheticPrototype,
    export,
    make_balls,
)
from tests.verify.synthetic_export import sign

pytestmark = pytest.mark.usefixtures("standing")

Row = dict[str, Any]

# Checks that are unknown where a ball's stop is, and where its place is.
ON_STOPS = ("cells", "coverage, balls", "light paths, balls", "rays, balls", "pixels, balls")
SAG = "sag left", "sag as written", "balls under weight", "turns as written"
ON_BALLS = (*ON_STOPS, "swing", "swing clearance", "balls apart", *SAG)


def failures(folder: Path) -> dict[str, Check]:
    """Failed and unknown checks by name."""
    report = judged(verify(folder, options=replace(IN_PROCESS, write=False)))
    return {check.name: check for check in report.checks if check.passed is not True}


def judged(report: Report) -> Report:
    """A report without the checks of what the synthetic prototype has not."""
    assert {check.name for check in report.checks} >= NOT_MADE - {"radius rule"}
    return replace(report, checks=tuple(c for c in report.checks if c.name not in NOT_MADE))


def moved(row: dict[str, str], name: str, by: float) -> None:
    row[name + "x"] = repr(float(row[name + "x"]) + by)


def test_a_good_prototype_passes_in_this_process_and_in_another(prototype_folder: Path) -> None:
    report = judged(verify(prototype_folder, options=IN_PROCESS))
    assert report.passed, [c for c in report.checks if not c.passed]
    assert report.verdict.startswith("Files: PASS, as designed all mirrors see 25 mm on 4 balls")
    names = {check.name for check in report.checks}
    assert "poses" in names
    assert not names & {"coverage, spheres", "light paths", "mirrors found"}
    apart = judged(verify(prototype_folder, options=replace(IN_PROCESS, write=False, apart=True)))
    assert apart.to_json() == report.to_json()


def test_a_prototype_beside_a_shell(tmp_path: Path) -> None:
    folder = export(tmp_path / "x", SyntheticPrototype(shell=True))
    report = judged(verify(folder, options=IN_PROCESS))
    assert report.passed, [c for c in report.checks if not c.passed]
    assert "virtual cameras see" in report.verdict
    assert report.verdict.endswith(", on 4 balls too")


def row_of(name: str) -> Callable[[Rows], None]:
    return lambda rows: rows.remove(next(row for row in rows if row["mirror"] == name))


def exchanged(rows: Rows) -> None:
    """Two of camera b's mirrors take each other's pictures."""
    one, two = (next(row for row in rows if row["mirror"] == name) for name in ("b0007", "b0030"))
    one["mirror"], two["mirror"] = two["mirror"], one["mirror"]


def nudged(key: str, by: float, row: int = 3) -> Callable[[Rows], None]:
    return lambda rows: rows[row].update({key: repr(float(rows[row][key]) + by)})


def stop_nudged(rows: Rows) -> None:
    for row in rows:
        if row["stop"] == "4":
            row["base_angle_deg"] = repr(float(row["base_angle_deg"]) + 1e-3)


def ball(number: int, change: Callable[[dict[str, str]], object]) -> Job:
    return table("balls.csv", lambda rows: change(rows[number - 1]))


PLAN, ANGLE = "rotation_plan.csv", "base_angle_deg"
Said = dict[str, tuple[str, ...]]  # words of the detail of each check that must fail
# How tables are broken, and what must fail.
TABLES: dict[str, tuple[Job, Said]] = {
    "apex off": (ball(1, lambda row: moved(row, "p", 1e-6)), {"ball positions": ("ball 1",)}),
    "larger than stock": (
        ball(1, lambda row: row.update(diameter_mm="10.1")),
        {"ball sizes": ("ball 1",)},
    ),
    "without weight": (
        ball(1, lambda row: row.update(mass_g="0.001")),
        {"ball sizes": ("ball 1",)},
    ),
    "mirror missing in the plan": (table(PLAN, row_of("a0007")), {"plan": ("a0007",)}),
    "twin missing": (table(PLAN, row_of("b0007")), {"plan": ("b0007",)}),
    "twins exchanged": (table(PLAN, exchanged), {"plan": ("b0007",)}),
    "angle off": (table(PLAN, nudged(ANGLE, 1e-3)), {"plan": ("row 4",)}),
    "stops and plan agree on a wrong angle": (
        together(table("stops.csv", stop_nudged), table(PLAN, stop_nudged)),
        {"plan program": ("deg",)},
    ),
    "a stop beyond the swing": (
        record("swing_deg", lambda swing: [swing[0], swing[1] - 1e-6]),
        {"plan": ("beyond the swing",)},
    ),
}
# Things wrong at once, what must fail, and what may be unknown for it.
RECORDS: dict[str, tuple[Job, Said, tuple[str, ...]]] = {
    "a ball, a part, a light and a picture": (
        together(
            ball(1, lambda row: moved(row, "p", 1e-6)),
            record("parts/4/axes", lambda axes: [[-x for x in row] for row in axes]),
            record("leds/0/position_mm", [0.0, 0.0, -13.0]),
            table(PLAN, row_of("a0007")),
        ),
        {
            "ball positions": ("ball 1",),
            "print pose": ("no rotation",),
            "leds inside": ("led_1",),
            "plan": ("a0007",),
        },
        ON_STOPS,
    ),
    "no cap for its ball": (
        record("parts/1/ball", 2),
        {"cap fronts": ("no sphere",)},
        ("cap bodies", "cap form", *ON_BALLS),
    ),
}
Made = SyntheticPrototype
SHOWN, PATHS = "coverage, balls", "light paths, balls"
FIN = 0.5 * make_balls(SyntheticPrototype())[1].p  # half way from the object to a ball
# What is made, what must fail, and what may be unknown for it.
PROTOTYPES: dict[str, tuple[SyntheticPrototype, Said, tuple[str, ...]]] = {
    "a low seat, a knob in a seat, a large cap, pictures left where they are, bodies in the way": (
        Made(
            moved=False,
            pads={(1, j): 0.05 for j in range(3)},
            bump=0.01,
            grown=0.02,
            motor=([90, -4, 60], [150, 4, 62]),
            drawn_off={"ball_1": 0.5},
            more={
                "leaf": ("frame", [200, 200, 0], [200.5, 230, 30]),
                "brick": ("frame", [-10, -10, -295], [10, 10, -250]),
            },
        ),
        {
            SHOWN: ("shows too little",),
            "ball centres": ("ball 2",),
            "balls clear": ("ball 1",),
            "cap fronts": ("ball 4",),
            "swing": ("motor",),
            "bodies apart": ("ball_1", "brick and foot"),
            "printable": ("fdm: minimum wall 0.5 mm, 1.2 required",),
        },
        (PATHS,),
    ),
    "no pad": (
        Made(pads={(0, 0): 3.0}),
        {"ball centres": ("no pad",)},
        ("pads", "balls clear", *ON_BALLS),
    ),
    "cap shows too little": (Made(target=40.0, front=400.0), {SHOWN: ("a00",)}, (PATHS,)),
    "a wall, a fin on the base and a stage in the light": (
        Made(
            stage_mm=16.0,
            more={"wall": ("frame", [25, -8, 30], [27, 8, 60]), "fin": ("base", FIN - 3, FIN + 3)},
        ),
        {PATHS: ("blocked by", "wall", "fin", "stage")},
        ("swing",),
    ),
}


def assert_fails(failed: dict[str, Check], said: Said, others: tuple[str, ...] = ()) -> None:
    assert set(said) <= set(failed) <= {*said, *others}
    for name, words in said.items():
        assert all(one in failed[name].detail for one in words), failed[name]


@pytest.mark.parametrize("how", TABLES)
def test_a_broken_table_fails(prototype_folder: Path, how: str) -> None:
    change, said = TABLES[how]
    change(prototype_folder)
    export = read_export(sign(prototype_folder))
    assert export.prototype
    found = record_checks.checks(PrototypeContext(export, export.prototype))
    assert_fails({one.name: one for one in found if one.passed is not True}, said)


@pytest.mark.parametrize("how", RECORDS)
def test_a_broken_record_fails(prototype_folder: Path, how: str) -> None:
    change, said, others = RECORDS[how]
    change(prototype_folder)
    assert_fails(failures(sign(prototype_folder)), said, others)


@pytest.mark.parametrize("how", PROTOTYPES)
def test_a_broken_prototype_fails(tmp_path: Path, how: str) -> None:
    spec, said, others = PROTOTYPES[how]
    assert_fails(failures(export(tmp_path / "x", spec)), said, others)


def test_a_prototype_that_the_manifest_does_not_list_fails(prototype_folder: Path) -> None:
    sign(prototype_folder, contents(prototype_folder).keys() - {"manifest.json", "prototype.json"})
    assert "prototype.json" in failures(prototype_folder)["manifest"].detail


def test_a_mesh_with_a_hole_fails(prototype_folder: Path) -> None:
    data = (prototype_folder / "stage.stl").read_bytes()
    count = int.from_bytes(data[80:84], "little") - 1
    (prototype_folder / "stage.stl").write_bytes(
        data[:80] + np.uint32(count).tobytes() + data[84:-50]
    )
    failed = failures(sign(prototype_folder))
    assert failed["watertight"].file == "stage.stl"


def test_a_machine_that_cannot_make_the_parts_fails(prototype_folder: Path) -> None:
    report = verify(prototype_folder, options=replace(IN_PROCESS, write=False, printers=("sla",)))
    assert {c.file for c in report.checks if c.name == "print sla" and not c.passed} >= {"foot.stl"}


REFUSED: dict[str, tuple[Job, str]] = {
    "schema before": (
        record("schema", "tbcad-prototype/1"),
        "schema is tbcad-prototype/1, this version verifies tbcad-prototype/2; write",
    ),
    "many balls": (table("balls.csv", lambda rows: rows.extend(rows * 400)), "1604 rows"),
    "ball missing": (table("balls.csv", list.pop), "one for each ball"),
    "ball kind": (
        ball(2, lambda row: row.update(kind="cube")),
        "line 3: kind is cube: it should be 'ball' or 'cap'",
    ),
    "mesh twice": (record("parts/0/stl", "stage.stl"), "STL of their own"),
    "cap of no ball": (record("parts/1/ball", 9), "a cap's ball or null"),
    "program no text": (lambda f: (f / "rotation_plan.nc").write_bytes(b"\xff\xfe"), "UTF-8"),
}


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all values of a JSON object that are no objects; of lists those of the first."""
    for key, one in value.items() if isinstance(value, dict) else enumerate(value[:1]):
        yield from leaves(one, (*path, key)) if isinstance(one, dict | list) else [(*path, key)]


def test_no_field_of_the_record_may_be_of_another_kind(prototype_folder: Path) -> None:
    """All of the synthetic record is used; the refusal names the field."""
    path = prototype_folder / "prototype.json"
    whole = path.read_text()
    for place in leaves(json.loads(whole)):
        record("/".join(map(str, place)), {"no": "value"})(prototype_folder)
        with pytest.raises(BadExport, match=str(place[0])):
            read_prototype(prototype_folder, {"a", "b"}, "grblhal")
        path.write_text(whole)


@pytest.mark.parametrize("how", REFUSED)
def test_a_malformed_prototype_is_refused(
    prototype_folder: Path, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    change, words = REFUSED[how]
    change(prototype_folder)
    assert main([str(prototype_folder), "-q"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert words in lines[0]
    assert not (prototype_folder / "verify.json").exists()
