"""The command that reconstructs an object from all rays of a light field."""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tbcad.app.cli.app import command
from tbcad.app.cli.endings import Stopped
from tbcad.app.cli.output_mode import print_result
from tbcad.common.screen import stages
from tbcad.errors import InputError
from tbcad.options.captures import ReconstructOptions
from tbcad.options.shared import JsonResult

if TYPE_CHECKING:
    from tbcad.app.api.reconstructions import Reconstructed


@command()
def reconstruct(
    options: ReconstructOptions,
    all_frames: Annotated[
        bool,
        typer.Option(
            "--all-frames",
            help="All frames, one after the other, each started from the one before; the number of "
            "the frame is added to the names of files.",
        ),
    ] = False,
    json: JsonResult = False,
) -> int:
    """Reconstruct one object from all rays of a light field, as a field of density and colour.

    The field is fitted to all photographed rays, from a coarse grid to a fine one. Views of it are
    sharper than those of the light field alone; they are the default where it lies beside it.
    """
    if options.frame is not None and all_frames:
        raise InputError("--frame and --all-frames exclude each other: leave one out")
    from tbcad.app.api.reconstructions import checked_frames, expected_seconds, part_of
    from tbcad.app.api.reconstructions import reconstruct_files as reconstructed

    asked = replace(options, frame="all") if all_frames else options
    numbers = checked_frames(asked)
    try:
        with stages(expected_seconds(asked, numbers)) as screen:
            done = reconstructed(asked.on(screen))
    except KeyboardInterrupt:
        parts = [str(part) for n in numbers if (part := part_of(asked, n)).exists()]
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
