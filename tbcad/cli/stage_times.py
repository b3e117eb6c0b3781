"""How long each stage of a build and of a verification takes, for the estimate of the time left.

Measured: the paper's design (n = 18) on two cores, both parts. The stages of the shell are scaled
by the number of mirrors, which grows with n squared, but for a fixed share; those of the prototype,
whose number of parts hardly depends on n, are not. The pace of the computer at hand is taken from
the stages as they end.
"""

from collections.abc import Sequence
from pathlib import Path

from tbcad.output.parts import PARTS, PROTOTYPE, SHELL

N = 18  # of the design that was measured
# Of the time at n = 18, what a stage takes even with a few mirrors: imports, pixels, processes.
FIXED_SHARE = 0.2

Seconds = dict[str, float]

MIRRORS: Seconds = {"mirrors: radii and cells": 1.0}
SHELLS: Seconds = {
    "shell_a: solid": 2.0,
    "shell_a: files": 2.0,
    "shell_b: solid": 2.0,
    "shell_b: files": 2.0,
}
PROTOTYPE_PARTS: Seconds = {
    "prototype: balls, their places, stops": 3.0,
    "prototype: base": 10.0,
    "prototype: stage and frame": 2.0,
    "prototype: caps and coupon": 0.3,
    "prototype: files": 0.5,
    "prototype: assembly": 3.0,
}
WAIT_FOR_SHELLS: Seconds = {"shells": 1.0}
MANIFEST: Seconds = {"manifest": 1.0}
REPORT: Seconds = {"report": 1.5}
VERIFY: Seconds = {
    "verification: reading": 0.5,
    "verification: 3MF": 2.0,
    "verification: files and record": 0.3,
    "verification: meshes and mirrors": 3.5,
    "verification: printability": 4.0,
}
VERIFY_SHELLS: Seconds = {
    "verification: optical setup": 1.5,
    "verification: coverage": 0.7,
    "verification: every pixel": 2.5,
}
# Most of it runs beside the stages of the shells.
VERIFY_PROTOTYPE: Seconds = {
    "verification: prototype's record": 0.1,
    "verification: printed parts": 0.1,
    "verification: parts and fits": 0.1,
    "verification: seats": 0.1,
    "verification: light paths of the balls": 0.1,
    "verification: swing": 0.1,
    "verification: printability of the prototype": 0.1,
}
VERIFY_SHELL_STEP: Seconds = {"verification: STEP": 0.3}
VERIFY_PROTOTYPE_STEP: Seconds = {"verification: STEP of the prototype": 0.2}
AS_MADE: Seconds = {"simulated builds by each process": 3.0}
# A search for edges and margins by cnc, and what they cost in pixels and SSIM; by sla, sls and fdm
# it takes two or three times as long, as margins for pedestals are searched for too.
MARGIN_SECONDS = 100.0


def build_times(n: int, parts: Sequence[str], verify: bool, process: str | None) -> Seconds:
    """Expected seconds of each stage of a build.

    Args:
        n: subdivision of the icosahedron.
        parts: what is built.
        verify: whether it is verified.
        process: whose margin is searched for, by name; None: none is.
    """
    shells = scaled(SHELLS, n) if SHELL in parts else {}
    prototype = PROTOTYPE_PARTS if PROTOTYPE in parts else {}
    both = set(PARTS) <= {*parts}
    solids = prototype | scaled(WAIT_FOR_SHELLS, n) if both else shells | prototype
    margin = {} if process is None else scaled({margin_stage(process): MARGIN_SECONDS}, n)
    times = margin | scaled(MIRRORS, n) | solids | MANIFEST
    return times | (verify_times(n, parts) if verify else {}) | scaled(REPORT, n)


def report_times(folder: Path) -> Seconds:
    """Expected seconds of the page of a folder, after its simulated builds."""
    n, parts = look_at(folder)
    return as_made_times(n, parts) | scaled(REPORT, n)


def margin_stage(process: str) -> str:
    """Title of the search for edges and margins for a process."""
    return f"edges and margins for {process}"


def verify_times(n: int, parts: Sequence[str]) -> Seconds:
    """Expected seconds of each stage of a verification."""
    shell, prototype = SHELL in parts, PROTOTYPE in parts
    times = scaled(VERIFY, n)
    times |= scaled(VERIFY_SHELLS, n) if shell else {}
    times |= VERIFY_PROTOTYPE if prototype else {}
    times |= scaled(VERIFY_SHELL_STEP, n) if shell else {}
    return times | (VERIFY_PROTOTYPE_STEP if prototype else {})


def as_made_times(n: int, parts: Sequence[str]) -> Seconds:
    """Expected seconds of the simulated builds."""
    return scaled(AS_MADE, n) if SHELL in parts else {}


def scaled(times: Seconds, n: int) -> Seconds:
    """The times of the paper's design for another number of mirrors."""
    factor = FIXED_SHARE + (1 - FIXED_SHARE) * (n / N) ** 2
    return {stage: seconds * factor for stage, seconds in times.items()}


def export_times(folder: Path) -> Seconds:
    """Expected seconds of the verification of a folder, after its simulated builds."""
    n, parts = look_at(folder)
    return as_made_times(n, parts) | verify_times(n, parts)


def look_at(folder: Path) -> tuple[int, tuple[str, ...]]:
    """What a folder seems to hold; it may be no export: that is for others to say."""
    from tbcad.formats.checked_files import parse_json

    try:
        file = folder / "design.json"
        document = parse_json(file.read_text(encoding="utf-8") if file.is_file() else "{}")
        n = int(document["spec"]["optics"]["n"])
    except (OSError, ValueError, TypeError, LookupError):
        n = N
    files = {SHELL: "shell_a.stl", PROTOTYPE: "prototype.json"}
    return n, tuple(part for part, name in files.items() if (folder / name).exists())
