"""What both readers of STEP are asked: one solid, its spherical faces, its volume."""

from __future__ import annotations

from collections.abc import Mapping

from tbcad_verify.programs.answers import count_check, volume_check
from tbcad_verify.programs.program_query import ExpectedPart
from tbcad_verify.report.checks import Check, informative

SOLID, SPHERES, VOLUME = "solids", "faces", "mm^3 off"


def one_solid(program: str, file: str, seen: Mapping[str, float]) -> Check:
    """The file holds one solid."""
    return count_check((f"{program} solids", file, SOLID), seen["solids"], 1, "must be one")


def spheres(program: str, file: str, seen: Mapping[str, float], wanted: ExpectedPart) -> Check:
    """Every mirror is a face on an exact sphere, and nothing else is."""
    name = (f"{program} spheres", file, SPHERES)
    if wanted.spheres is None:
        return informative(name, seen["spheres"], "no mirrors: any number will do")
    return count_check(name, seen["spheres"], wanted.spheres, "spherical faces, unlike the mirrors")


def volume(program: str, file: str, seen: Mapping[str, float], wanted: ExpectedPart) -> Check:
    """Solid and mesh enclose the same volume."""
    name = (f"{program} volume", file, VOLUME)
    return volume_check(name, seen["volume"], wanted.volume, wanted.volume_error)
