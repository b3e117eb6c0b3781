"""Help: commands in the order of the work, under headings, with examples that the tests try."""

import typer
from typer.models import CommandInfo

HEADINGS = {
    "Design and build": (
        *("init", "optimize", "build", "verify", "report", "picture", "camera"),
        *("explain", "doctor"),
    ),
    "Order and assemble": ("order", "parts", "drawings", "assembly"),
    "Run the machine": ("run", "intrinsics", "calibrate", "merge", "as-built"),
    "Simulate and analyse": ("capture", "simulate-run", "tolerance", "study"),
    "Look at light fields": ("reconstruct", "show", "view", "refocus", "export"),
}
# By the words that call the command: what is typed behind them, and what it gives.
EXAMPLES: dict[str, tuple[tuple[str, str], ...]] = {
    "init": (
        ("my.toml", "the paper's design, to change"),
        ("small.toml --from afternoon-print", "half size, prints in an afternoon"),
        ("--list", "the designs that come with tbcad"),
    ),
    "optimize": (
        ("--out better.toml", "no larger than the paper's design, more pixels where they are few"),
        ("my.toml --for size --for pixels --max-size-mm 600", "two aims, and a larger machine"),
        ("--for ssim --max-size-mm 500 --candidates 80", "for better views; a quarter of an hour"),
    ),
    "build": (
        ("--n 18 --out exports/", "the paper's design, both parts, verified"),
        ("my.toml --parts shell --out mine/", "a design of your own, its shells alone"),
        ("--n 24 --dry-run", "what it would give, in seconds"),
        ("--set shell.wall_mm=4 --for-process cnc", "another wall, and the margin milling needs"),
    ),
    "verify": (
        ("exports/", "verify again, and write verify.json"),
        ("exports/ --printer sls --json", "also whether it fits; for other programs"),
        ("exports/ --as-built calibration/", "the prototype as measured: what to shim"),
    ),
    "report": (
        ("exports/", "report.html with all pictures in the folder"),
        ("exports/ --capture captures/knot -o talk.html", "also the photograph in each mirror"),
    ),
    "picture": (
        ("exports/", "both shells: shell.png"),
        ("exports/ --of edges", "the edges of mirrors close up, with a section"),
        ("exports/ --of exploded -o exploded.png", "the prototype, taken apart"),
    ),
    "camera": (
        ("", "sensor, lens, stop and focus of the paper's design"),
        ("my.toml --lenses my-lenses.csv --json", "with lenses of your own, for other programs"),
    ),
    "explain": (
        ("theta1", "a symbol of the paper"),
        ("mirrors.margin_mm", "a key of a design"),
        ('"coverage, facets"', "a check of the verification"),
    ),
    "doctor": (("", "what is missing, and the command that repairs it"),),
    "order": (
        (
            "exports/ --out order/",
            "a page, tables, STEP with tolerances: nickel from a mandrel",
        ),
        ("exports/ --chain cnc", "what milling can hold of each limit"),
    ),
    "parts": (
        ("exports/", "totals, and what costs most"),
        ("exports/ --full --prices my_prices.csv", "every row, with prices of your own"),
    ),
    "drawings": (
        ("exports/ --out drawings/", "printed parts, assembly and optical layout"),
        ("exports/ --only bearing_head --json", "one part; what was written, as JSON"),
    ),
    "assembly": (
        ("exports/ --out assembly/", "a page with a picture for each step"),
        ("exports/ --no-pictures", "the text alone, in a second"),
    ),
    "run": (
        ("exports/ --dry-run", "how many photographs, how long, how much disk"),
        ("exports/ --port /dev/ttyUSB0 --out runs/first", "photograph every stop"),
        ("exports/ --port /dev/ttyUSB0 --out runs/first --resume", "go on after any stop"),
    ),
    "intrinsics": (
        ("boards/ --squares 9x6 --size 5 --out camera.yml", "a board of 9 x 6 squares of 5 mm"),
    ),
    "calibrate": (
        ("runs/first --exports exports/ --out calibration/", "the machine that took the run"),
        ("runs/first --process sla --intrinsics camera.yml", "printed by SLA, with a known lens"),
    ),
    "merge": (
        ("runs/first --calibration calibration/ --out captures/real", "one light field of all"),
        ("runs/first --flat even.png --encoding srgb", "JPEGs, and the lens's own vignetting"),
    ),
    "as-built": (("calibration/ --out asbuilt/", "coloured by what each ball is off"),),
    "capture": (
        ("exports/ --out captures/knot", "the built-in object"),
        ("exports/ --object my.ply --fit --prototype", "your mesh, by the balls of the prototype"),
    ),
    "simulate-run": (
        ("exports/ --process fdm --seed 3 --out runs/fdm3", "all photographs of a random build"),
        ("exports/ --shell --perfect", "two photographs by the shell, without errors"),
    ),
    "tolerance": (
        ("exports/ --process cnc", "the yield of one process, and what limits it"),
        ("exports/ --margins", "the margin that each process needs"),
        ("exports/ --as-built calibration/", "one calibrated machine"),
    ),
    "study resolution": (("--from 10 --to 24 --out studies/", "subdivisions 10 to 24"),),
    "study capture-area": (("--from 4 --to 18", "subdivisions 4 to 18"),),
    "study elevation": (
        ("", "figure and table of the paper's design"),
        ("afternoon-print", "... of another"),
    ),
    "study depth-of-field": (("--blur-px 1.5", "another limit of the blur"),),
    "study balance": (
        ("--out studies/", "which n is best for matt and glossy objects, near and far"),
        ("--n 12 --n 18 --n 26 --method blend", "three of them, by a blend"),
    ),
    "study ssim": (
        ("", "views of the built-in object"),
        ("--object my.ply --method blend", "of your mesh, by the other method"),
    ),
    "study prototype": (("exports/ --azimuths 2", "fewer viewpoints, sooner done"),),
    "study low-pass": (("exports/ --filter-px 1 --filter-px 2", "two filters"),),
    "study calibration": (("exports/ --out studies/", "tables, notes and a plot"),),
    "reconstruct": (
        ("captures/knot", "field.npz beside it, which view and show then show"),
        ("captures/knot --mesh knot.glb --preview knot.png", "also its surface, for Blender"),
        ("captures/knot --resume", "go on after any stop"),
    ),
    "show": (
        ("exports/", "the report, in the browser"),
        ("captures/knot", "drag the viewpoint, set focus and aperture; Ctrl-C ends it"),
        ("captures/knot --turntable knot.html", "a page to send to somebody"),
    ),
    "view": (
        ("captures/knot --azimuth 30 --elevation 15", "a camera anywhere around the object"),
        ("captures/knot --width 1280 --height 960 -o view.png", "a larger picture"),
        ("captures/lit --light sky.hdr", "in the light of other surroundings"),
    ),
    "refocus": (
        ("captures/knot --aperture 300 --focus 0", "a lens of 300 mm, focused on the centre"),
    ),
    "export": (
        ("captures/knot --to nerfstudio --out data/knot", "all virtual cameras, for ns-train"),
        ("captures/knot --to colmap --every 4 --size 128", "a quarter of them, as a COLMAP model"),
        ("captures/knot --to rays --cameras a --json", "the rays of camera a as numpy arrays"),
        ("captures/knot --to mitsuba --exports exports/", "the machine, for Mitsuba and Blender"),
    ),
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


def add_examples(app: typer.Typer, words: tuple[str, ...] = ()) -> None:
    """Put its examples at the end of the help of every command; one without is a fault of tbcad."""
    for command in app.registered_commands:
        command.epilog = examples_text(" ".join((*words, _name(command))))
    for group in app.registered_groups:
        if group.typer_instance is not None:
            add_examples(group.typer_instance, (*words, str(group.name)))


def examples_text(command: str) -> str:
    """The examples of a command, in Markdown: each a paragraph with its comment."""
    lines = [f"`{f'tbcad {command} {words}'.strip()}`" for words, _ in EXAMPLES[command]]
    told = [f"{line} - {about}" for line, (_, about) in zip(lines, EXAMPLES[command], strict=True)]
    return "\n\n".join(["**Examples**", *told])
