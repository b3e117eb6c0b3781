"""Calls about how exactly a design must be made."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

import typer

from tbcad.options.call import Call
from tbcad.options.shared import AnyPath, Exports, Force, OutReplaced


@dataclass(frozen=True)
class InspectionOptions(Call):
    """The shells of an export, and how many of them must be good."""

    exports: Exports[AnyPath]
    _: KW_ONLY
    wanted: Annotated[
        float,
        typer.Option(
            "--yield", help="Share of the shells that must be good with the standard deviations."
        ),
    ] = 0.99
    out: OutReplaced[AnyPath] = Path("inspection")
    force: Force = False
