"""Answers of fake programs become checks; an unclear answer is never a pass."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from tbcad_verify.programs import ExpectedPart, check_with_programs, is_skipped
from tbcad_verify.programs.programs import QUERIES
from tbcad_verify.report.checks import Check

# Small programs that pretend to be the real ones: well-behaved, or bad in one way each.
SEEN = {"solids": 1, "invalid": 0, "open": 0, "loose": 0, "spheres": 7, "volume": 1000.0}

INFO = """
[2026-01-02 03:04:05.678901] [0x00007f4971762d80] [trace]   Initializing StaticPrintConfigs
[given.stl]
size_x = 10.0
number_of_facets = 1200
manifold = yes
number_of_parts =  1
volume = 1000.0
"""

GCODE = """
G1 X0 Y0
; filament used [mm] = 420.00
; estimated printing time (normal mode) = 1d 2h 30m 36s
; filament_diameter = 1.75
"""

GMSH = """
from types import SimpleNamespace as Space
def initialize(**options): print("chatter")
occ = Space(
    importShapes=lambda path: open(path).read() == "this is part.step" or 1 / 0,
    synchronize=lambda: None,
    getMass=lambda dim, tag: 1000.25,
)
model = Space(
    occ=occ,
    getEntities=lambda dim: [(3, 0)] if dim == 3 else [(2, tag) for tag in range(9)],
    getType=lambda dim, tag: "Sphere" if tag < 7 else "Plane",
)
option = Space(setNumber=lambda name, value: None)
"""

GOOD = {
    "freecadcmd": f"import json; json.dump({SEEN!r}, open('answer.json', 'w'))",
    "gmsh": GMSH,
    "prusa-slicer": f"""
import sys
if "--output" in sys.argv:
    open(sys.argv[sys.argv.index("--output") + 1], "w").write({GCODE!r})
else:
    print({INFO!r})
""",
}

BAD = {
    "hangs": "import time\nwhile True: time.sleep(1)",
    "crashes": "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)",
    "crashes at last": "{good}\nimport os, signal; sys_stdout = __import__('sys').stdout\n"
    "sys_stdout.flush(); os.kill(os.getpid(), signal.SIGSEGV)",
    "prints rubbish": "import os; os.write(1, os.urandom(5000))\n"
    "open('answer.json', 'wb').write(os.urandom(500))\n"
    "open('sliced.gcode', 'wb').write(os.urandom(500))",
    "prints without end": "while True: print('manifold = yes ' * 500)",
    "says nothing": "",
    "answers with words": "print('manifold = perhaps\\nsolids one volume big\\n')\n"
    "open('answer.json', 'w').write('{\"solids\": \"1\", \"volume\": NaN}')\n"
    "open('sliced.gcode', 'w').write('; filament used [mm] = lots\\n')",
    "answers with a list": "open('answer.json', 'w').write('[' * 50_000)",
    "gives up": "{good}\nprint('[error] no [/such] thing'); raise SystemExit(1)",
}


def install(folder: Path, **bodies: str) -> Path:
    """Put Python programs into a folder; `_` in a name stands for `-`, gmsh is a module."""
    folder.mkdir(exist_ok=True)
    for name, body in bodies.items():
        path = folder / ("gmsh.py" if name == "gmsh" else name.replace("_", "-"))
        path.write_text(body if name == "gmsh" else f"#!{sys.executable} -IS\n{body}\n")
        path.chmod(0o755)
    return folder


def install_good(folder: Path, **others: str) -> Path:
    return install(folder, **{name.replace("-", "_"): body for name, body in GOOD.items()} | others)


FILES = {"step": "part.step", "stl": "part.stl", "3mf": "part.3mf"}
PART = ExpectedPart("part", FILES, spheres=7, volume=1000.0, volume_error=1.0)
NAMES = [(name, PART.files[e.kind], unit) for e in QUERIES for name, unit in e.questions.items()]


@pytest.fixture
def export(tmp_path: Path) -> Path:
    folder = tmp_path / "export"
    folder.mkdir()
    for name in FILES.values():
        (folder / name).write_text(f"this is {name}")
    return folder


@pytest.fixture(autouse=True)
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The only folder in which programs are found; gmsh is a package, on our path."""
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.syspath_prepend(tmp_path / "bin")
    return install(tmp_path / "bin")


def ask(export: Path, part: ExpectedPart = PART, seconds: float = 20) -> list[Check]:
    return check_with_programs(export, [part], seconds)


def failed(checks: Sequence[Check]) -> list[str]:
    return [check.name for check in checks if check.passed is False]


def figure(checks: Sequence[Check], name: str) -> float | None:
    return next(check.measured for check in checks if check.name == name)


def test_good_programs_pass(export: Path, programs: Path) -> None:
    install_good(programs)
    checks = ask(export)
    assert [(check.name, check.file, check.unit) for check in checks] == NAMES
    assert all(check.passed for check in checks)
    free = [check.name for check in checks if check.limit is None]
    assert free == ["prusa filament", "prusa time"]
    assert figure(checks, "gmsh volume") == 0.25
    assert figure(checks, "prusa slices") == pytest.approx(42 * math.pi * 1.75**2 / 4 - 100)
    assert figure(checks, "prusa filament") == 0.42
    assert figure(checks, "prusa time") == 26.5


@pytest.mark.parametrize("program", sorted(GOOD.keys() - {"gmsh"}))
def test_checks_of_an_absent_program_are_skipped(
    export: Path, programs: Path, program: str
) -> None:
    install_good(programs)
    (programs / program).unlink()
    name = program.removesuffix("cmd").removesuffix("-slicer")
    checks = ask(export)
    assert [(check.name, check.file, check.unit) for check in checks] == NAMES
    skipped = [check for check in checks if is_skipped(check)]
    assert {check.name.split()[0] for check in skipped} == {name}
    assert all(check.passed for check in checks)
    assert all(check.detail.startswith("skipped: not installed: ") for check in skipped)


@pytest.mark.parametrize("behaviour", BAD)
def test_bad_programs_leave_all_unknown(export: Path, programs: Path, behaviour: str) -> None:
    install_good(programs)
    for name, good in GOOD.items():
        install(programs, **{name.replace("-", "_"): BAD[behaviour].replace("{good}", good)})
    checks = ask(export, seconds=0.5 if behaviour == "hangs" else 60)
    assert [(check.name, check.file, check.unit) for check in checks] == NAMES
    assert {check.passed for check in checks} == {None}
    assert all(check.detail for check in checks)


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({"solids": 2}, ["solids"]),
        ({"spheres": 6}, ["spheres"]),
        ({"spheres": 8}, ["spheres"]),
        ({"volume": 998.5}, ["volume"]),
        ({"volume": 1001.5}, ["volume"]),
        *(({key: 2}, ["valid"]) for key in ("invalid", "open", "loose")),
        (dict.fromkeys(SEEN, 0), ["solids", "valid", "spheres", "volume"]),
    ],
)
def test_freecad(export: Path, programs: Path, changes: dict[str, float], wrong: list[str]) -> None:
    text = json.dumps(SEEN | changes)
    install(programs, freecadcmd=f"open('answer.json', 'w').write({text!r})")
    checks = ask(export)
    assert failed(checks) == [f"freecad {name}" for name in wrong]
    flaws = sum(changes.values()) if wrong == ["valid"] else int("valid" in wrong)
    assert figure(checks, "freecad valid") == flaws


@pytest.mark.parametrize(
    ("old", "new", "wrong"),
    [
        ("manifold = yes", "manifold = no\nopen_edges = 3", ["manifold"]),
        ("manifold = yes", "manifold = yes\nfacets_reversed = 2", ["manifold"]),
        ("manifold = yes", "manifold = yes\nedges_fixed = 1", ["manifold"]),
        ("parts =  1", "parts =  2", ["parts"]),
        ("volume = 1000.0", "volume = 1002.0", ["volume"]),
        ("volume = 1000.0", "volume = nan", ["volume"]),
        ("volume = 1000.0", f"volume = 500.0\n{INFO}", ["parts", "volume"]),
        # without a figure all is unknown
        *((f"{key} = ", "", None) for key in ("manifold", "number_of_parts", "volume")),
    ],
)
def test_reports_of_meshes(
    export: Path, programs: Path, old: str, new: str, wrong: list[str] | None
) -> None:
    assert old in INFO
    install(programs, prusa_slicer=f"print({INFO.replace(old, new)!r})")
    checks = [check for check in ask(export) if check.name.startswith("prusa")]
    if wrong is None:
        assert {check.passed for check in checks} == {None}
    else:
        assert failed(checks) == [f"prusa {name}" for name in wrong] * 2  # STL and 3MF


def test_a_print_of_another_volume_fails(export: Path, programs: Path) -> None:
    install(programs, prusa_slicer=GOOD["prusa-slicer"].replace("420.00", "390.00"))
    assert failed(ask(export)) == ["prusa slices"]


@pytest.mark.parametrize("gap", ["volume", "volume_error"])
def test_an_unknown_volume_is_no_pass(export: Path, programs: Path, gap: str) -> None:
    install_good(programs)
    checks = ask(export, replace(PART, **{gap: math.nan}))
    unsure = {check.name for check in checks if check.passed is None}
    volumes = {name for name, _, unit in NAMES if "mm^3" in unit}
    assert unsure == volumes | ({"prusa slices"} if gap == "volume" else set())


ECHO = "import sys; print(sys.argv[1:], open(sys.argv[-1]).read()); raise SystemExit(9)"


@pytest.mark.parametrize("name", ["-b=x.stl", "--help", "a part.stl", "$(touch x);.stl", "ä\n.stl"])
def test_names_are_only_names(export: Path, programs: Path, name: str) -> None:
    """The program gets a copy, by an absolute path of our own."""
    (export / name).write_text("right file")
    install(programs, prusa_slicer=ECHO)
    checks = ask(export, replace(PART, files={"stl": name}))
    answers = [c for c in checks if c.name.startswith("prusa") and c.file == name]
    assert {(c.file, c.passed) for c in answers} == {(name, None)}
    assert answers[0].detail.endswith("'--info', './given.stl'] right file")


def test_the_export_and_the_home_stay_as_they_are(
    export: Path, programs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even by programs that write beside the file, over it, into the home and where they stand."""
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(home))
    writes = """
import os, sys
for place in (".", os.environ["HOME"], os.environ.get("XDG_CONFIG_HOME", "."),
              os.path.dirname(sys.argv[-1]) or "."):
    os.makedirs(place, exist_ok=True)
    open(os.path.join(place, "litter"), "w").write("litter")
open(sys.argv[-1], "w").write("changed")
"""
    install(programs, freecadcmd=writes, gmsh=writes, prusa_slicer=writes)
    before = {path: path.read_bytes() for path in export.iterdir()}
    ask(export)
    assert {path: path.read_bytes() for path in export.iterdir()} == before
    assert not list(home.iterdir())
    assert not list(Path.cwd().glob("litter"))


def test_order_and_number_at_a_time(export: Path, programs: Path, tmp_path: Path) -> None:
    """Answers come in the order of parts and queries; never do three programs run at once."""
    log = tmp_path / "log"
    noted = f"""
import time
def note(word): open({str(log)!r}, "a").write(word)
note("+"); time.sleep(0.05)
BODY
note("-")
"""
    bodies = {n.replace("-", "_"): noted.replace("BODY", body) for n, body in GOOD.items()}
    install(programs, **bodies)
    parts = [replace(PART, name=name) for name in "ab"]
    begun: list[str] = []
    checks = check_with_programs(export, parts, 20, begun.append)
    assert [(check.name, check.file, check.unit) for check in checks] == NAMES * 2
    assert sorted(begun) == sorted(f"{e.program}: {PART.files[e.kind]}" for e in QUERIES * 2)
    running = [log.read_text()[:k].count("+") - log.read_text()[:k].count("-") for k in range(25)]
    assert max(running) == 2


class Broken(Exception):
    pass


def broken() -> None:
    raise Broken


def ctrl_c() -> None:
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize(
    ("event", "error"), [(ctrl_c, KeyboardInterrupt), (broken, Broken)], ids=["ctrl-c", "broken"]
)
def test_an_interrupt_does_not_wait(
    export: Path, programs: Path, event: Callable[[], None], error: type[BaseException]
) -> None:
    install(programs, freecadcmd=BAD["hangs"], prusa_slicer=BAD["hangs"])

    def progress(stage: str) -> None:
        if stage == "prusa: part.stl":
            time.sleep(0.3)
            event()

    start = time.monotonic()
    with pytest.raises(error):
        check_with_programs(export, [PART], 600, progress)
    assert time.monotonic() - start < 300
