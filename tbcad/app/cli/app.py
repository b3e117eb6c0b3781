"""The command `tbcad` itself, and what its subcommands share: how they are added, and print."""

import tomllib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from importlib.resources import files
from inspect import Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar

import typer

from tbcad.app.cli.help_texts import PlainGroup
from tbcad.common.screen import paragraph, report_console, stages
from tbcad.common.told import told
from tbcad.errors import InputError
from tbcad.options.call import Call, parameters, tell_options
from tbcad.options.checks import check_is_export
from tbcad.options.shared import Design, Exports, JsonResult, Out, PlotFormatOption, Settings
from tbcad.version import __version__

if TYPE_CHECKING:
    from tbcad_verify.report.report import Output

    from tbcad.common.figure_files import PlotFormat
    from tbcad.common.results import Study
    from tbcad.core.spec.design import Spec
    from tbcad.types import Progress

app = typer.Typer(
    name="tbcad",
    cls=PlainGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Mirror arrays for light-field cameras: from the optical design to parts that can be "
    "made, verified on the files written. Start with tbcad build --out exports.",
)
HEAD_COLUMNS = 18
Told = TypeVar("Told", bound=Callable[..., int])
Full = Annotated[bool, typer.Option("--full")]
"""Print every check before the summary."""
Quiet = Annotated[bool, typer.Option("--quiet", "-q")]
"""Print the verdict only."""
Json = Annotated[bool, typer.Option("--json")]
"""Print the summary as JSON; see verify/README."""


def command(name: str | None = None) -> Callable[[Told], Told]:
    """Add a command whose options are the fields of the record that its function takes first.

    What else the function takes are options of the command line alone.
    """

    def added(function: Told) -> Told:
        shown = list(parameters(function))

        def called(**given: Any) -> int:
            # An option that is left out has the record's default.
            told = {key: value for key, value in given.items() if value is not None}
            record = function.__annotations__["options"]
            own = {key: told.pop(key) for key in function.__annotations__ if key in told}
            return function(record(**told), **own)

        called.__name__, called.__doc__ = function.__name__, function.__doc__
        vars(called)["__signature__"] = Signature(shown)
        # typer would take annotations before those of the signature.
        called.__annotations__ = {}
        app.command(name)(called)
        return function

    return added


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"tbcad {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    del version


def on_screen(number: int, function: str, options: Call) -> Any:
    """Call a function of the API by its name, about so many stages of it on the screen."""
    from tbcad.app import api

    with stages(number) as screen:
        return getattr(api, function)(options.on(screen))


def output_mode(full: bool, quiet: bool, json: bool) -> "Output":
    """The output that is asked for; more than one is refused."""
    asked: dict[Output, bool] = {"full": full, "quiet": quiet, "json": json}
    chosen = [name for name, wanted in asked.items() if wanted]
    if len(chosen) > 1:
        given = " and ".join(f"--{name}" for name in chosen)
        raise InputError(f"{given} exclude each other: give only one of them")
    return chosen[0] if chosen else "summary"


def print_result(record: object, lines: Iterable[str], json: bool) -> None:
    """Print what was found, for other programs or in words."""
    if json:
        print_json(record)
        return
    for line in lines:
        typer.echo(line)


def result_lines(name: str, **values: Any) -> Iterator[str]:
    """The lines that a command prints, by their name in results.toml."""
    text = (files("tbcad.app.cli") / "results.toml").read_text(encoding="utf-8")
    for head, words in told(tomllib.loads(text)[name], values):
        yield f"{head:{HEAD_COLUMNS}}{words}" if head else words


def print_json(record: object) -> None:
    """Print a record for other programs."""
    import json

    typer.echo(json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False))


tell_options(__name__)


Work: TypeAlias = "Callable[[Progress], Study]"

STUDIES = Path("studies")


def of_design(prepare: Callable[..., Work]) -> Callable[..., int]:
    """A command for a study of a design: takes its Spec, then options of its own."""
    return _command(prepare, _spec)


def of_export(prepare: Callable[..., Work]) -> Callable[..., int]:
    """A command for a study of a build: takes its folder, then options of its own."""
    return _command(prepare, _folder)


def _spec(design: Design[Path] = None, settings: Settings = None) -> "Spec":
    from tbcad.core.spec.load import load_spec

    return load_spec(design, settings or ())


def _folder(folder: Exports[Path]) -> Path:
    check_is_export(folder)
    return folder


def _command(prepare: Callable[..., Work], subject: Callable[..., object]) -> Callable[..., int]:
    """The command: options of the subject, of all studies, and of this one, in this order."""

    def command(
        out: Out[Path] = STUDIES,
        json: JsonResult = False,
        plot: PlotFormatOption = "svg",
        **options: Any,
    ) -> int:
        given = {name: options.pop(name) for name in signature(subject).parameters}
        return _run_study(out, json, plot, prepare(subject(**given), **options))

    shared = list(signature(command).parameters.values())[:-1]
    own = list(signature(prepare).parameters.values())[1:]
    parameters = [*signature(subject).parameters.values(), *shared, *own]
    command.__name__, command.__doc__ = prepare.__name__, prepare.__doc__
    # What typer makes options of; it would take annotations before those of the signature.
    vars(command)["__signature__"] = Signature(parameters)
    command.__annotations__ = {}
    return command


def _run_study(out: Path, json: bool, plot: "PlotFormat", work: Work) -> int:
    """Make a study, write its files, and show its figures next to the paper's."""
    from tbcad.common.results import write_study
    from tbcad.output.single_files import check_tables

    check_tables(out)
    with stages(2) as screen:
        screen.stage("study: mirrors and rays")
        result = work(screen.detail)
        screen.stage("study: files")
        files = write_study(result, out, plot=plot)
    if json:
        print_json(_record(result, files))
        return 0
    _show(result)
    typer.echo(paragraph(f"{out}: {', '.join(file.name for file in files)}"))
    return 0


def _record(result: "Study", files: list[Path]) -> dict[str, object]:
    """The result for other programs."""
    return {
        "schema": "tbcad-study/1",
        "study": result.name,
        "figures": [asdict(figure) for figure in result.figures],
        "notes": list(result.notes),
        "files": [str(file) for file in files],
    }


def _show(result: "Study") -> None:
    from rich.table import Table

    table = Table(box=None)
    for heading in ("quantity", "tbcad", "the paper", "where in the paper"):
        table.add_column(heading, overflow="fold")
    for quantity, unit, ours, paper, where in result.summary.rows:
        table.add_row(str(quantity), _shown(ours, unit), _shown(paper, unit), str(where))
    report_console().print(table)


def _shown(value: str | int | float | None, unit: str | int | float | None) -> str:
    """A figure with four digits; the files have all of them."""
    short = f"{value:.4g}" if isinstance(value, float) else "-" if value is None else str(value)
    return f"{short} {unit}".rstrip() if value is not None else short
