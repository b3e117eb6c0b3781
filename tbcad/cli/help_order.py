"""Commands in the help in the order of the work, under headings."""

import typer
from typer.models import CommandInfo

HEADINGS = {
    "Design and build": (
        *("init", "optimize", "build", "verify", "report", "picture", "camera"),
        *("explain", "doctor"),
    ),
    "Order and assemble": ("inspection", "parts", "drawings", "assembly"),
    "Run the machine": ("run", "intrinsics", "calibrate", "merge", "as-built"),
    "Simulate and analyse": ("capture", "simulate-run", "tolerance", "study"),
    "Look at light fields": ("reconstruct", "show", "view", "refocus", "export"),
}


def order_help(app: typer.Typer) -> None:
    """Put every command under its heading; one without a heading is a fault of tbcad."""
    heading = {name: title for title, names in HEADINGS.items() for name in names}
    place = list(heading)
    for command in app.registered_commands:
        command.rich_help_panel = heading[_name(command)]
    for group in app.registered_groups:
        group.rich_help_panel = heading[str(group.name)]
    app.registered_commands.sort(key=lambda one: place.index(_name(one)))


def _name(command: CommandInfo) -> str:
    return str(command.name or getattr(command.callback, "__name__", ""))
