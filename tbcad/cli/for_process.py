"""Build for a manufacturing process: the edges and margins that suit it, and what they cost."""

from typing import TYPE_CHECKING

from tbcad.errors import InputError

if TYPE_CHECKING:
    from tbcad.screen import Stages
    from tbcad.spec.design import Spec
    from tbcad.tolerancing.process.process import Process

DEFAULT_YIELD = 0.99


def asked_process(name: str | None, share: float | None) -> "tuple[Process | None, float]":
    """The process whose margins are wanted, and the yield: checked before anything takes long.

    Args:
        name: of the process, or its file; None where none is asked for.
        share: of good builds; None for the default.

    Raises:
        InputError: the process cannot be read, or the share has no process or is not allowed.
    """
    if name is None and share is None:
        return None, DEFAULT_YIELD
    from tbcad.options.tolerances import check_yield
    from tbcad.tolerancing.process.process import load_process

    if name is None:
        raise InputError(
            f"--yield {share:g} is of no use without --for-process: name a process, or leave "
            "--yield out"
        )
    if share is not None:
        check_yield(share)
    return load_process(name), DEFAULT_YIELD if share is None else share


def design_for(spec: "Spec", process: "Process", wanted: float, screen: "Stages") -> "Spec":
    """The design with edges and margins for a process and a yield; notes say what they cost."""
    from tbcad.tolerancing.process_design import (
        costs_text,
        edges_for_process,
        edges_text,
        margins_text,
        pixel_costs,
        ssim_costs,
        ssim_text,
    )

    choice = edges_for_process(spec, process, wanted, screen.detail)
    found = choice.made
    screen.note(edges_text(choice))
    screen.note(f"{margins_text(found)}, for {wanted:.1%} by {process.name}")
    screen.detail("pixels")
    screen.note(costs_text(pixel_costs(found, choice.pixels)))
    screen.detail("views")
    screen.note(ssim_text(ssim_costs(found)))
    return found.spec
