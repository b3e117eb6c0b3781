"""What to do about a check that failed: one table."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tbcad_verify.report.checks import Check

_DAMAGED = "a file was changed or damaged after the build: build again"
_EDITED = "leave out --strict if the edit is meant, else build again"
_RECORD = "the record is not what was built: build again"
_MESH = "the mesh is not as it was written: build again, and do not repair it"
_MIRROR = "the mesh is off the record: build again, with a smaller chord_error_mm"
_SEES = "mirrors.radius_rule traced, a larger margin_mm, a smaller chord_error_mm"
_BALLS = "a larger mirrors.margin_mm, or more balls: prototype.k"
_SPACE = "more clearance: keys of [prototype.base], .stage and .frame"
_LEDS = "move LEDs or stage: keys in [prototype.stage]"
_LIGHT = "lamps farther from what the base sweeps: prototype.light.lamp_z_mm"
_PLAN = "the plan was changed after the build: build again"
_PRINT = "another --printer, or other keys of [shell] and [printer]"
_STEP = "the STEP file differs from record or mesh: build again, else report it"
_SEATS = "shim or re-seat the balls that fall short, then calibrate again"
_PROGRAM = "the program reads the file otherwise: see --full, try its newest version"

# The remedy for a check is that of the longest beginning of its name in this table.
REMEDIES = {
    "3MF": _DAMAGED,
    "manifest": _DAMAGED,
    "paper": _EDITED,
    "requirements": _RECORD,
    "prototype requirements": _RECORD,
    "ids": _RECORD,
    "poses": _RECORD,
    "figures": _RECORD,
    "directions": _RECORD,
    "radius rule": _RECORD,
    "camera mount": _RECORD,
    "camera gauge": _RECORD,
    "camera place": "more pixels: camera.width_px, or a wider picture: camera.hfov_deg fit",
    "drive": "the drive bears too little: fewer balls, a lower acceleration_deg_s2",
    "motor bearing": "the belt pulls hard: a smaller prototype.largest_ball_mm, fewer balls",
    "hold ratio": "a ball is held weakly: larger prototype.base.magnets_mm or a smaller gap",
    "inventory": _RECORD,
    "drawings": _RECORD,
    "plate holes": _RECORD,
    "homing": _RECORD,
    "klipper": _RECORD,
    "controller settings": _RECORD,
    "leds as designed": _RECORD,
    "cell areas": _RECORD,
    "watertight": _MESH,
    "facets": _MESH,
    "signed volume": _MESH,
    "components": _MESH,
    "manifold3d": _MESH,
    "folds": _MESH,
    "mirrors found": _MESH,
    "mesh wall": _MESH,
    "mesh holes": _MESH,
    "mesh seam and foot": _MESH,
    "mandrel": _MESH,
    "mandrel draft, deviation from record": _RECORD,
    "form error": _MIRROR,
    "centre error": _MIRROR,
    "radius error": _MIRROR,
    "surface error": _MIRROR,
    "coverage": _SEES,
    "mirrors visible": _SEES,
    "seam gap": _SEES,
    "light paths": "parts stand in the light: a thinner flange or wall, keys of [shell]",
    "object clearance": "a smaller optics.capture_diameter_mm, or a larger optics.semi_minor_mm",
    "pixels, minimum": "fewer mirrors (--n), or more pixels: camera.width_px, height_px",
    "frame margin": "mirrors are out of the picture: a larger camera.hfov_deg",
    "ball": _RECORD,
    "ball centres": _MESH,
    "balls clear": _MESH,
    "pads": _MESH,
    "cap": _MESH,
    "cap tilt": "prototype.base.cap_play_mm smaller",
    "cells": _BALLS,
    "coverage, balls": _BALLS,
    "light paths, balls": _SPACE,
    "swing": _SPACE,
    "key access": "a part stands in the way of a key: other keys of [prototype.frame]",
    "power off": "the zero pin bears too little: fewer or smaller balls",
    "parts apart": _SPACE,
    "balls apart": _SPACE,
    "assembly": "prototype.glb differs from the parts: build again",
    "leds": _LEDS,
    "object room": _LEDS,
    "lamps": _RECORD,
    "shroud": _RECORD,
    "light before and after": _LIGHT,
    "light in the stage's shadow": _LEDS,
    "dark background": "list what the camera sees as matt black, and paint it",
    "plan": _PLAN,
    "print pose": _RECORD,
    "on the bed": _RECORD,
    "print": _PRINT,
    "as built: coverage": _SEATS,
    "as built: stops": "photograph what is missing, tbcad run --resume, and calibrate again",
    "as built: windows in the picture": "turn the camera until all mirrors are in its picture",
    "as built: object clearance": "put the camera where the drawing has it, or use smaller objects",
    "step": _STEP,
    "freecad": _PROGRAM,
    "gmsh": _PROGRAM,
    "prusa": _PROGRAM,
    "admesh": _PROGRAM,
}
UNKNOWN = "it could not be measured: verify again, with a larger --time-limit"
ELSE = "build again; if it stays, report it with verify.json"


def remedy(check: Check) -> str:
    """What to do about a check that did not pass."""
    if check.passed is None:
        return UNKNOWN
    return remedy_by_name(check.name)


def remedy_by_name(check: str) -> str:
    """What to do about a check that fails, by its name."""
    matching = [name for name in REMEDIES if check.startswith(name)]
    return REMEDIES[max(matching, key=len)] if matching else ELSE
