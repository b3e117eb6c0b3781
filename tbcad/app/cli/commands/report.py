"""The command that writes the page of an export."""

import typer

from tbcad.app.cli.app import command
from tbcad.common.screen import stages
from tbcad.options.builds import ReportOptions


@command()
def report(options: ReportOptions) -> int:
    """Write report.html: verdict, 3D view, map of the virtual cameras, tables, pictures.

    One file that opens from disk in any browser, without a network. tbcad build writes it too;
    write it again after a new verification, or to add pictures. Exit code 0, or 2 for bad input.
    """
    from tbcad.app.api import report_page

    with stages(2) as screen:
        file = report_page(options.on(screen))
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")
    return 0
