"""What the commands of all studies share: their subject, and where and how results are shown."""

from collections.abc import Callable
from inspect import Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from tbcad.cli.study_output import run_study
from tbcad.options.checks import check_is_export
from tbcad.options.shared import Design, Exports, JsonResult, Out, PlotFormatOption, Settings

if TYPE_CHECKING:
    from tbcad.results.study import Study
    from tbcad.spec.design import Spec
    from tbcad.types import Progress

Work: TypeAlias = "Callable[[Progress], Study]"

STUDIES = Path("studies")


def of_design(prepare: Callable[..., Work]) -> Callable[..., int]:
    """A command for a study of a design.

    Args:
        prepare: takes the design's Spec, then options of its own; returns what makes the study.
    """
    return _command(prepare, _spec)


def of_export(prepare: Callable[..., Work]) -> Callable[..., int]:
    """A command for a study of an export.

    Args:
        prepare: takes the export's folder, then options of its own; returns what makes the study.
    """
    return _command(prepare, _folder)


def _spec(design: Design[Path] = None, settings: Settings = None) -> "Spec":
    from tbcad.spec.load import load_spec

    return load_spec(design, settings or ())


def _folder(folder: Exports[Path]) -> Path:
    check_is_export(folder)
    return folder


def _command(prepare: Callable[..., Work], subject: Callable[..., object]) -> Callable[..., int]:
    """The command: options of the subject, of all studies, and of this one, in this order."""

    def command(
        out: Out[Path] = STUDIES,
        json: JsonResult = False,
        plot: PlotFormatOption = "png",
        **options: Any,
    ) -> int:
        given = {name: options.pop(name) for name in signature(subject).parameters}
        return run_study(out, json, plot, prepare(subject(**given), **options))

    shared = list(signature(command).parameters.values())[:-1]
    own = list(signature(prepare).parameters.values())[1:]
    parameters = [*signature(subject).parameters.values(), *shared, *own]
    command.__name__, command.__doc__ = prepare.__name__, prepare.__doc__
    # What typer makes options of; it would take annotations before those of the signature.
    vars(command)["__signature__"] = Signature(parameters)
    command.__annotations__ = {}
    return command
