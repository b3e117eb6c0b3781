"""FreeCAD, Gmsh and PrusaSlicer on all files: two at a time, answers always in the same order.

FreeCAD and Gmsh open a STEP file without a window. PrusaSlicer tells which repairs a mesh needs,
its parts and volume, and slices it.
"""

from __future__ import annotations

import importlib.util
import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import partial
from pathlib import Path

from tbcad_verify.programs.program_query import (
    SCRIPT_END,
    Command,
    ExpectedPart,
    ProgramQuery,
    Sandbox,
    on_path,
    sandbox,
    script_figures,
    skipped,
    text_of,
)
from tbcad_verify.record.files import open_folder
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    exactly,
    guarded,
    informative,
    unknown,
)
from tbcad_verify.run.child import Limits
from tbcad_verify.types import Progress

PROCESSES = 2
SOLID, SPHERES, VOLUME = "solids", "faces", "mm^3 off"
INSTALL_PRUSA = "apt install prusa-slicer"
GMSH_KEYS = ("solids", "spheres", "volume")

# In a process of its own: it is native code that may crash, and it takes over signals.
GMSH_SCRIPT = """
import importlib.util, json, sys

def look():
    spec = importlib.util.spec_from_file_location("gmsh", sys.argv[1])
    gmsh = sys.modules["gmsh"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(gmsh)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.importShapes("given.step")
    gmsh.model.occ.synchronize()
    solids = gmsh.model.getEntities(3)
    kinds = [gmsh.model.getType(*surface) for surface in gmsh.model.getEntities(2)]
    return {
        "solids": len(solids),
        "spheres": kinds.count("Sphere"),
        "volume": sum(gmsh.model.occ.getMass(*solid) for solid in solids),
    }

message = str
"""

FREECAD_KEYS = ("solids", "invalid", "open", "loose", "spheres", "volume")

# FreeCAD runs this inside itself and ends with 0 even when it breaks, unless it says otherwise.
FREECAD_SCRIPT = """
import json, sys

def look():
    import Part
    shape = Part.Shape()
    shape.read("given.step")
    solids = shape.Solids
    return {
        "solids": len(solids),
        "invalid": sum(not solid.isValid() for solid in solids),
        "open": sum(not solid.isClosed() for solid in solids),
        "loose": len(shape.Faces) - sum(len(solid.Faces) for solid in solids),
        "spheres": sum(type(face.Surface).__name__ == "Sphere" for face in shape.Faces),
        "volume": shape.Volume,
    }

def message(error):
    first = error.args[0] if error.args else error
    return str(first.get("sErrMsg", first)) if isinstance(first, dict) else str(error)
"""


def volume_check(check: CheckName, measured: float, part: ExpectedPart) -> Check:
    """A check that a volume, mm^3, is the same as the mesh's."""
    if not math.isfinite(part.volume + part.volume_error):
        return unknown(check, "the mesh's volume is unknown")
    detail = f"{measured:.6g} mm^3, but the mesh has {part.volume:.6g}"
    return at_most(check, abs(measured - part.volume), part.volume_error, detail)


def solid_checks(
    names: Sequence[CheckName], figures: Mapping[str, float], part: ExpectedPart
) -> list[Check]:
    """One solid; every mirror a face on an exact sphere, and nothing else; the mesh's volume.

    `figures`: of solids, spheres and volume.
    """
    solids, spheres, volume = names
    count = figures["spheres"]
    return [
        exactly(solids, figures["solids"], 1, "must be one"),
        informative(spheres, count, "no mirrors: any number is allowed")
        if part.spheres is None
        else exactly(spheres, count, part.spheres, "spherical faces, unlike the mirrors"),
        volume_check(volume, figures["volume"], part),
    ]


def find_gmsh() -> Command:
    """Python with the package's file; the program alone does not tell what faces are."""
    spec = importlib.util.find_spec("gmsh") if sys.executable else None
    if spec is None or not spec.origin or not Path(spec.origin).is_file():
        return ()
    script = GMSH_SCRIPT + SCRIPT_END
    return sys.executable, "-I", "-c", script, str(Path(spec.origin).absolute())


def ask_gmsh(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """One solid with the mirrors' faces and the mesh's volume.

    Unknown: the package gives no answer.
    """
    figures = script_figures(sandbox.run(), sandbox.folder, GMSH_KEYS)
    return solid_checks(names, figures, expected)


GMSH = ProgramQuery(
    program="gmsh",
    kind="step",
    install="pip install gmsh",
    questions={"gmsh solids": SOLID, "gmsh spheres": SPHERES, "gmsh volume": VOLUME},
    find=find_gmsh,
    ask=ask_gmsh,
)


def ask_freecad(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """One valid, closed solid with the mirrors' faces and the mesh's volume.

    Unknown: the program gives no answer.
    """
    script = sandbox.folder / "look.py"
    script.write_text(FREECAD_SCRIPT + SCRIPT_END, encoding="utf-8")
    figures = script_figures(sandbox.run(script), sandbox.folder, FREECAD_KEYS)
    solids, spheres, volume = solid_checks([names[0], *names[2:]], figures, expected)
    return [solids, _valid(names[1], figures), spheres, volume]


def _valid(name: CheckName, figures: dict[str, float]) -> Check:
    flaws = sum(abs(figures[key]) for key in ("invalid", "open", "loose"))
    detail = (
        f"{figures['solids']:.0f} solids, {figures['invalid']:.0f} of them not valid, "
        f"{figures['open']:.0f} not closed; {figures['loose']:.0f} faces of no solid"
    )
    return at_most(name, flaws + (figures["solids"] < 1), 0, detail)


FREECAD = ProgramQuery(
    program="freecad",
    kind="step",
    install="apt install freecad",
    questions={
        "freecad solids": SOLID,
        "freecad valid": "flaws",
        "freecad spheres": SPHERES,
        "freecad volume": VOLUME,
    },
    find=lambda: on_path("freecadcmd", "FreeCADCmd"),
    ask=ask_freecad,
)


REPAIRS = (
    "open_edges",
    "degenerate_facets",
    "edges_fixed",
    "facets_removed",
    "facets_reversed",
    "backwards_edges",
)
FILAMENT_MM = 1.75
SOLID_PERCENT = 5.0  # a print's volume is that of its lines; 1.0 to 1.8 too much were measured
TAIL = 1_000_000  # bytes of G-code that hold the figures at its end
HOURS = {"d": 24.0, "h": 1.0, "m": 1 / 60, "s": 1 / 3600}

# A solid print on a bed that is large enough; coordinates end at 2 m.
PROFILE = (
    *("--bed-shape", "0x0,1000x0,1000x1000,0x1000"),
    *("--filament-diameter", str(FILAMENT_MM), "--nozzle-diameter", "0.4", "--skirts", "0"),
    *("--layer-height", "0.3", "--first-layer-height", "0.3"),
    *("--fill-density", "100%", "--fill-pattern", "rectilinear"),
)


def ask_info(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """Manifold without repair, one part, the mesh's volume.

    Unknown: the program gives no answer.
    """
    outcome = sandbox.run("--datadir", sandbox.folder / "home", "--info", sandbox.copy)
    values = _values(text_of(outcome))
    return [
        _manifold(names[0], values),
        exactly(names[1], _sum(values, "number_of_parts"), 1, "must be one"),
        volume_check(names[2], _sum(values, "volume"), expected),
    ]


def ask_slices(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """The print's volume is the mesh's; filament and time inform.

    Unknown: the program gives no answer.
    """
    slices, filament, time = names
    code = sandbox.folder / "sliced.gcode"
    data = ("--datadir", sandbox.folder / "home")
    text_of(sandbox.run(*data, "--export-gcode", *PROFILE, "--output", code, sandbox.copy))
    length, hours = _print(_tail(code))
    return [
        _slices(slices, length, expected.volume),
        informative(filament, length / 1e3),
        informative(time, round(hours, 1)),  # seconds differ from run to run
    ]


def _values(text: str) -> dict[str, list[str]]:
    """Values by key, one for each object of the file."""
    found: dict[str, list[str]] = {}
    for key, value in re.findall(r"^(\w{1,40}) = +?(\S{1,40}) *$", text, flags=re.MULTILINE):
        found.setdefault(key, []).append(value)
    return found


def _manifold(name: CheckName, values: dict[str, list[str]]) -> Check:
    verdicts = values.get("manifold", [])
    if not verdicts or {*verdicts} - {"yes", "no"}:
        raise Unknown("ended without error, but did not say whether the mesh is manifold")
    repairs = {key: _sum(values, key) for key in REPAIRS if key in values}
    flaws = verdicts.count("no") + sum(map(abs, repairs.values()))
    named = ", ".join(f"{key} {count:.0f}" for key, count in repairs.items())
    detail = f"manifold: {', '.join(verdicts)}; {named or 'no repairs'}"
    return at_most(name, flaws, 0, detail)


def _sum(values: dict[str, list[str]], key: str) -> float:
    if key not in values:
        raise Unknown(f"ended without error, but did not say its {key}")
    try:
        return sum(map(float, values[key]))
    except ValueError as error:
        raise Unknown(f"ended without error, but its {key} is no number") from error


def _slices(name: CheckName, length: float, mesh: float) -> Check:
    if not math.isfinite(mesh) or mesh <= 0:
        return unknown(name, "the mesh's volume is unknown")
    printed = length * math.pi / 4 * FILAMENT_MM**2  # mm^3
    detail = f"a solid print takes {printed:.6g} mm^3, but the mesh has {mesh:.6g}"
    return at_most(name, 100 * abs(printed / mesh - 1), SOLID_PERCENT, detail)


def _tail(code: Path) -> str:
    try:
        with code.open("rb") as stream:
            stream.seek(max(0, code.stat().st_size - TAIL))
            return stream.read(TAIL).decode("utf-8", "replace")
    except OSError as error:
        raise Unknown("ended without error, but wrote no G-code") from error


def _print(code: str) -> tuple[float, float]:
    """Length of filament, mm, and time, h."""
    length = re.search(r"^; filament used \[mm\] = (\d{1,12}(?:\.\d{1,9})?)$", code, re.MULTILINE)
    time = re.search(r"^; estimated printing time \(normal mode\) = (.{2,40})$", code, re.MULTILINE)
    spans = re.findall(r"(\d{1,9})([dhms])", time[1]) if time else []
    if length is None or not spans:
        raise Unknown("ended without error, but its G-code tells neither filament nor time")
    return float(length[1]), sum(int(count) * HOURS[unit] for count, unit in spans)


PRUSA = partial(on_path, "prusa-slicer", "PrusaSlicer")


def _info(kind: str) -> ProgramQuery:
    questions = {"prusa manifold": "flaws", "prusa parts": "parts", "prusa volume": VOLUME}
    return ProgramQuery("prusa", kind, INSTALL_PRUSA, questions, PRUSA, ask_info)


PRUSA_STL = _info("stl")
PRUSA_3MF = _info("3mf")
PRUSA_SLICES = ProgramQuery(
    program="prusa",
    kind="stl",
    install=INSTALL_PRUSA,
    questions={"prusa slices": "%", "prusa filament": "m", "prusa time": "h"},
    find=PRUSA,
    ask=ask_slices,
)
QUERIES = (FREECAD, GMSH, PRUSA_STL, PRUSA_3MF, PRUSA_SLICES)


def check_with_programs(
    folder: Path,
    parts: Sequence[ExpectedPart],
    seconds: float = 300.0,
    progress: Progress = lambda _: None,
    queries: Sequence[ProgramQuery] = QUERIES,
) -> list[Check]:
    """Ask the programs about every file that they open.

    The checks of a program that is not installed are skipped: see `is_skipped`. Those of one that
    crashes, runs out of time or gives no clear answer are unknown. An interrupt kills all of them.

    `folder`: the build; its files should have been compared with the manifest before.
    `progress`: called with program and file before each run, from several threads.

    BadExport: the folder is missing or is no folder.
    """
    limits = Limits(seconds)
    root = open_folder(folder)
    jobs = [
        partial(_answers, root, part, query, limits, progress)
        for part in parts
        for query in queries
    ]
    return [check for checks in _two_at_a_time(jobs, limits) for check in checks]


def _two_at_a_time(jobs: Sequence[Callable[[], list[Check]]], limits: Limits) -> list[list[Check]]:
    with ThreadPoolExecutor(PROCESSES) as pool:
        try:
            running = [pool.submit(job) for job in jobs]
            done, _ = wait(running, return_when=FIRST_EXCEPTION)
            for one in done:
                one.result()  # raises what broke
            return [one.result() for one in running]
        except BaseException:
            limits.stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _answers(
    folder: Path, part: ExpectedPart, query: ProgramQuery, limits: Limits, progress: Progress
) -> list[Check]:
    """The checks that one program answers about one file, or why they are skipped."""
    file, command, names = part.files.get(query.kind, ""), query.find(), query.names(part)
    if not file or not command:
        missing = f"not installed: {query.install}"
        reason = missing if file else f"the record names no {query.kind} file"
        return [skipped(name, reason) for name in names]
    progress(f"{query.program}: {file}")

    def ask() -> Sequence[Check]:
        with sandbox(command, folder, file, query.kind, limits) as private:
            return query.ask(private, part, names)

    return guarded(names, ask)
