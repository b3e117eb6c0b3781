"""The command that reconstructs an object from all rays of a light field."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from tbcad.cli.app import app
from tbcad.cli.output_mode import print_result
from tbcad.cli.stopping import Stopped
from tbcad.errors import InputError
from tbcad.options.checks import check_is_capture
from tbcad.options.shared import ForceFile, JsonResult
from tbcad.screen import stages

if TYPE_CHECKING:
    from tbcad.api.reconstructions import Reconstructed


@app.command()
def reconstruct(
    capture: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER", help="Folder written by tbcad capture or merge, or its lightfield.h5."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="The field to write (.npz); by default field.npz beside the light field, which "
            "view, show and turntables then show.",
        ),
    ] = None,
    nodes: Annotated[
        int, typer.Option(metavar="N", help="Nodes along each edge of the finest grid, 16 to 512.")
    ] = 144,
    epochs: Annotated[
        int,
        typer.Option(
            metavar="N",
            help="How often each ray is used on the finest grid, 1 to 100; on the coarser grids in "
            "proportion.",
        ),
    ] = 5,
    order: Annotated[
        Literal["0", "1", "auto"],
        typer.Option(
            help="How colours depend on the direction they are seen from: 0: not; 1: linearly, for "
            "gloss; auto: by which of both mirrors that are left out are shown better."
        ),
    ] = "auto",
    rays: Annotated[
        int,
        typer.Option(
            metavar="K",
            help="Rays of a pixel on the finest grid: 1, its central ray, or 12 and more, which "
            "take its area and the lens' spread into account, in K times the time.",
        ),
    ] = 1,
    blur: Annotated[
        float | None,
        typer.Option(
            metavar="PX",
            help="With --rays: standard deviation of the lens' spread, pixels of the photograph, "
            "besides the pixel's own area; by default what the light field says, else 0.",
        ),
    ] = None,
    frame: Annotated[
        int | None,
        typer.Option(
            min=0, metavar="K", help="Frame of tbcad capture --frames to show, from 0 on."
        ),
    ] = None,
    all_frames: Annotated[
        bool,
        typer.Option(
            "--all-frames",
            help="All frames, one after the other, each started from the one before; the number of "
            "the frame is added to the names of files.",
        ),
    ] = False,
    mesh: Annotated[
        list[Path] | None,
        typer.Option(
            "--mesh",
            metavar="FILE",
            help="Also write the surface with its colours (.glb, .ply) or without (.stl); "
            "repeatable.",
        ),
    ] = None,
    volume: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also write density and colours on the whole lattice, for ParaView and PyVista "
            "(.vti).",
        ),
    ] = None,
    preview: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A picture (.png) that is written after each epoch."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of all that is random.")] = 0,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Go on with what was interrupted; with a field, make what is missing."
        ),
    ] = False,
    force: ForceFile = False,
    json: JsonResult = False,
) -> int:
    """Reconstruct one object from all rays of a light field, as a field of density and colour.

    The field is fitted to all photographed rays, from a coarse grid to a fine one. Views of it are
    sharper than those of the light field alone; they are the default where it lies beside it.
    """
    check_is_capture(capture)
    if frame is not None and all_frames:
        raise InputError("--frame and --all-frames exclude each other: leave one out")
    from tbcad.reconstruction.options import Options

    options = Options(nodes, epochs, order, rays, blur, seed)
    from tbcad.api.reconstructions import Wanted, checked_frames, expected_seconds
    from tbcad.api.reconstructions import reconstruct_files as reconstructed

    which: int | Literal["all"] | None = "all" if all_frames else frame
    wanted = Wanted(capture, out, which, tuple(mesh or ()), preview, resume, force, volume)
    numbers = checked_frames(wanted)
    try:
        with stages(expected_seconds(wanted, options, numbers)) as screen:
            done = reconstructed(wanted, options, screen.stage, screen.detail)
    except KeyboardInterrupt:
        parts = [str(part) for part in map(wanted.part_file, numbers) if part.exists()]
        if not parts:
            raise
        kept = f"{parts[0]} keeps what is done: go on with the same options and --resume"
        raise Stopped(kept) from None
    record = {"schema": "tbcad-reconstruct/1", "fields": [one.record() for one in done]}
    print_result(record, (line for one in done for line in _lines(one)), json)
    return 0


def _lines(one: "Reconstructed") -> Iterator[str]:
    """The verdict first."""
    facts: dict[str, Any] = one.field.facts
    chosen = facts["chosen"]
    out = facts["mirrors_left_out"]
    verdict = "no mirror was left out to judge the field by"
    if out:
        verdict = f"PSNR {facts['psnr_left_out_db']:.2f} dB on {out} mirrors that were left out"
    yield f"{verdict}, of {facts['rays']} rays"
    several = "1 ray" if facts["rays_a_pixel"] == 1 else f"{facts['rays_a_pixel']} rays"
    yield (
        f"view dependence of order {chosen['order']}, total variation "
        f"{chosen['smooth_density']:g}, smoothness of colours {chosen['smooth_colour']:g}, "
        f"sparsity {chosen['sparse']:g}; {several} a pixel"
    )
    yield f"{100 * facts['unexplained_light']:.2g} % of the light is outside of the hull"
    grids = ", ".join(str(level["nodes"]) for level in chosen["levels"])
    word = "was there already" if one.kept else "written"
    yield f"{one.file}: {word}, {facts['node_count']} nodes on grids of {grids} along an edge"
    for file, known in one.meshes.items():
        yield f"{file}: {known['triangles']} triangles"
        if "mean_mm" in known:
            yield (
                f"  from the true object: mean {known['mean_mm']:.3f} mm, 95 % within "
                f"{known['percentile_95_mm']:.3f} mm, at most {known['hausdorff_mm']:.2f} mm, "
                "where rays see it"
            )
