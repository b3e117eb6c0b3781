"""The command that shows the list of parts."""

import json as json_text
from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.options.checks import check_is_folder
from tbcad.options.shared import Exports

PriceList = Annotated[
    Path | None,
    typer.Option(
        "--prices",
        metavar="FILE",
        help="CSV list of prices to use in place of the build's, with the columns of "
        "docs/prototype.md; bom.csv stays as it is.",
    ),
]


@app.command()
def parts(
    folder: Exports[Path],
    prices: PriceList = None,
    full: Annotated[bool, typer.Option("--full", help="Show every row.")] = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print totals and all rows as JSON.")
    ] = False,
) -> int:
    """Show what an export's prototype needs: totals of price, mass, filament and hours, then rows.

    Without --full the rows are those that cost most. Exit code 0, or 2 for bad input.
    """
    from tbcad.prototype.files.bom_view import read_parts_list
    from tbcad.prototype.purchased.prices import load_prices

    check_is_folder(folder)
    listed = read_parts_list(folder, load_prices([str(prices)]) if prices else None)
    shown = json_text.dumps(listed.record(), indent=1) if json else None
    typer.echo(shown or "\n".join(listed.lines(full=full)))
    return 0
