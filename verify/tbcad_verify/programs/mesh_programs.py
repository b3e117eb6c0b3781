"""PrusaSlicer and admesh: repairs that a mesh needs, its parts and volume, and its print."""

from __future__ import annotations

import math
import re
from pathlib import Path

from tbcad_verify.programs.program_query import (
    VOLUME,
    Command,
    ExpectedPart,
    ProgramQuery,
    Sandbox,
    mesh_checks,
    on_path,
    text_of,
)
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, informative, unknown

INSTALL = "apt install prusa-slicer"
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
FLAWS = (
    "Total disconnected facets",
    "Degenerate facets",
    "Edges fixed",
    "Facets removed",
    "Facets added",
    "Facets reversed",
    "Backwards edges",
    "Normals fixed",
)
MIN_FACETS = 4


def find_prusa() -> Command:
    """The program, by either of its names."""
    return on_path("prusa-slicer", "PrusaSlicer")


def ask_info(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """Manifold without repair, one part, the mesh's volume.

    Unknown: the program gives no answer.
    """
    lines = _lines(
        text_of(sandbox.run("--datadir", sandbox.folder / "home", "--info", sandbox.copy))
    )
    parts, volume = (_required(lines, key) for key in ("number_of_parts", "volume"))
    return [_manifold(names[0], lines), *mesh_checks(names[1:], parts, volume, expected)]


def ask_slices(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """The print's volume is the mesh's; filament and time inform.

    Unknown: the program gives no answer.
    """
    slices, filament, time = names
    length, hours = _sliced(sandbox)
    return [
        _slices(slices, length, expected.volume),
        informative(filament, length / 1e3),
        informative(time, round(hours, 1)),  # seconds differ from run to run
    ]


def _sliced(sandbox: Sandbox) -> tuple[float, float]:
    """Length of filament, mm, and time, h, of a solid print."""
    code = sandbox.folder / "sliced.gcode"
    data = ("--datadir", sandbox.folder / "home")
    text_of(sandbox.run(*data, "--export-gcode", *PROFILE, "--output", code, sandbox.copy))
    return _print(_tail(code))


def _lines(text: str) -> list[tuple[str, str]]:
    """Key and value of every line; keys repeat for each object of the file."""
    return re.findall(r"^(\w{1,40}) = +?(\S{1,40}) *$", text, flags=re.MULTILINE)


def _manifold(name: CheckName, lines: list[tuple[str, str]]) -> Check:
    verdicts = [value for key, value in lines if key == "manifold"]
    if not verdicts or {*verdicts} - {"yes", "no"}:
        raise Unknown("ended without error, but did not say whether the mesh is manifold")
    repairs = {key: _sum(lines, key) for key in REPAIRS if any(one == key for one, _ in lines)}
    flaws = verdicts.count("no") + sum(map(abs, repairs.values()))
    named = ", ".join(f"{key} {count:.0f}" for key, count in repairs.items())
    detail = f"manifold: {', '.join(verdicts)}; {named or 'no repairs'}"
    return at_most(name, flaws, 0, detail)


def _required(lines: list[tuple[str, str]], key: str) -> float:
    if not any(name == key for name, _ in lines):
        raise Unknown(f"ended without error, but did not say its {key}")
    return _sum(lines, key)


def _sum(lines: list[tuple[str, str]], key: str) -> float:
    try:
        return sum([float(value) for name, value in lines if name == key]) + 0.0
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


def _info(kind: str) -> ProgramQuery:
    questions = {"prusa manifold": "flaws", "prusa parts": "parts", "prusa volume": VOLUME}
    return ProgramQuery("prusa", kind, INSTALL, questions, find_prusa, ask_info)


PRUSA_STL = _info("stl")
PRUSA_3MF = _info("3mf")
PRUSA_SLICES = ProgramQuery(
    program="prusa",
    kind="stl",
    install=INSTALL,
    questions={"prusa slices": "%", "prusa filament": "m", "prusa time": "h"},
    find=find_prusa,
    ask=ask_slices,
)


def ask_admesh(sandbox: Sandbox, expected: ExpectedPart, names: list[CheckName]) -> list[Check]:
    """Nothing to repair, one part, the mesh's volume. Unknown: the program gives no answer."""
    report = _admesh_figures(text_of(sandbox.run(sandbox.copy)))
    flaws = {key: report[key] for key in FLAWS}
    repairs = ", ".join(f"{key} {count:.0f}" for key, count in flaws.items() if count)
    return [
        at_most(names[0], sum(flaws.values()), 0, repairs),
        *mesh_checks(names[1:], report["Number of parts"], report["Volume"], expected),
    ]


def _admesh_figures(text: str) -> dict[str, float]:
    """Every figure by its label; the first of two columns, "Original"."""
    rows = re.findall(r"(\w[\w ]{0,40}?) +: +(-?\d{1,20}(?:\.\d{1,9})?)\b", text)
    report = {label: float(figure) for label, figure in rows}
    labels = {*FLAWS, "Number of facets", "Number of parts", "Volume"}
    if not labels <= {*report} or report["Number of facets"] < MIN_FACETS:
        raise Unknown("ended without error, but without its report")
    return report


ADMESH = ProgramQuery(
    program="admesh",
    kind="stl",
    install="apt install admesh",
    questions={"admesh repairs": "flaws", "admesh parts": "parts", "admesh volume": VOLUME},
    find=lambda: on_path("admesh"),
    ask=ask_admesh,
)
