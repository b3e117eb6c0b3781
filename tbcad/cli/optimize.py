"""The command that searches a better design."""

from dataclasses import replace
from typing import TYPE_CHECKING

import typer

from tbcad.cli.app import command
from tbcad.cli.output_mode import print_json
from tbcad.options.designs import OptimizeOptions
from tbcad.options.shared import JsonResult
from tbcad.screen import stages

if TYPE_CHECKING:
    from pathlib import Path

    from tbcad.optimizing.search import SearchResult


@command()
def optimize(options: OptimizeOptions, json: JsonResult = False) -> int:
    """Search better places of cameras and mirrors for the same sensor and number of mirrors.

    Camera and ellipsoid are moved, directions stretched and the lens fitted; every candidate's
    mirrors are solved by exact rays, and pixels counted one by one. Object, sensor, number of
    mirrors and all else stay.
    """
    from tbcad.api import optimize as searched

    with stages(2) as screen:
        result = searched(replace(options, progress=screen.stage, detail=screen.detail))
    if json:
        print_json(_record(result, options.files))
        return 0
    _show(result, *options.files)
    return 0


def _record(result: "SearchResult", files: "tuple[Path, ...]") -> dict[str, object]:
    """What was found, for other programs."""
    from dataclasses import asdict

    return {
        "schema": "tbcad-optimize/1",
        "before": asdict(result.start),
        "after": asdict(result.best),
        "limits": asdict(result.limits),
        "candidates": len(result.candidates),
        "front": [
            asdict(one)
            for one, kept in zip(result.candidates, result.on_front, strict=True)
            if kept
        ],
        "files": [str(file) for file in files],
    }


def _show(result: "SearchResult", out: "Path", *others: "Path") -> None:
    from tbcad.optimizing.files import comparison

    if result.best.place == result.start.place:
        typer.echo(f"No better one among {len(result.candidates)} candidates within the limits.")
    for line in comparison(result):
        typer.echo(line)
    x, z, semi_minor, *stretch = result.best.place
    typer.echo(
        f"camera at x = {x:g}, z = {z:g} mm; semi-minor axis {semi_minor:g} mm; "
        f"directions stretched by {stretch[0]:g} and {stretch[1]:g}"
    )
    beside = ", ".join(file.name for file in others)
    typer.echo(f"{out}: written, with {beside}; build and verify it by tbcad build {out}")
