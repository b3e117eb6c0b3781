"""One record a command: keywords of Python, options of the command, and one-line refusals."""

import inspect
import pydoc
from dataclasses import KW_ONLY, dataclass, replace
from itertools import repeat
from pathlib import Path
from typing import Annotated, Literal
from unittest.mock import Mock

import pytest
import typer

import tbcad
import tbcad.app.cli  # noqa: F401 - adds all commands
from tbcad.errors import InputError
from tbcad.options.builds import BuildOptions
from tbcad.options.call import Call, keywords, parameters
from tbcad.options.machines import CalibrateOptions
from tbcad.options.shared import AnyPath
from tbcad.rig.calibration.run import WrittenCalibration
from tbcad.rig.runs import Run
from tests.app.cli.commands import leaves

ONLY_WRITTEN = {
    *("json", "all_frames", "mesh", "prototype"),
    *("no_preflight", "preflight_only", "yes", "dry_run", "full", "quiet", "as_built"),
}
ONLY_PYTHON = {"progress", "detail", "answer", "ask", "show", "preflight", "geometry"}


@dataclass(frozen=True)
class Polish(Call):
    """A mirror, and how it is polished."""

    mirror: Annotated[AnyPath, typer.Argument(help="File of the mirror.")]
    _: KW_ONLY
    passes: Annotated[int, typer.Option(min=1, max=9)] = 2
    """How often."""
    grits: tuple[float, ...] = ()
    """One after the other."""
    side: Annotated[Literal["back", "front"], "Which is polished."] = "front"


@keywords(Polish)
def polish(options: Polish) -> str:
    """Polish a mirror.

    Returns:
        What was done.
    """
    options.progress("polishing")
    return f"{options.mirror} {options.passes}"


def test_fields_are_keywords() -> None:
    assert polish("m.step", passes=3) == polish(Path("m.step"), passes=3) == "m.step 3"
    assert polish(Polish("m.step")) == "m.step 2"
    shown = inspect.signature(polish)
    assert shown.parameters["passes"].default == 2
    assert shown.parameters["passes"].kind is inspect.Parameter.KEYWORD_ONLY
    assert shown.parameters["passes"].annotation is int
    assert " ".join(shown.parameters) == "mirror passes grits side progress detail answer"
    assert shown.return_annotation is str
    with pytest.raises(TypeError, match="passs"):
        polish("m.step", passs=3)  # type: ignore[call-overload]


def test_what_lies_in_a_folder_stands_for_its_path() -> None:
    run = Run(Path("runs/first"), *repeat(Mock(), 3))
    assert Polish(run).mirror == Path("runs/first")
    halves = [WrittenCalibration(Path(f"c/{name}"), *repeat(Mock(), 4)) for name in "ab"]
    assert Path(halves[0]) == Path("c/a")
    assert Path(replace(halves[0], others=(halves[1],))) == Path("c")


def test_help_texts_are_the_arguments() -> None:
    assert inspect.getdoc(polish) == (
        "Polish a mirror.\n\nArgs:\n    mirror: File of the mirror.\n    passes: How often.\n"
        "    grits: One after the other.\n    side: Which is polished.\n\n"
        "Returns:\n    What was done."
    )


def test_wrong_values_are_one_line() -> None:
    assert [polish("m.step", passes=passes) for passes in (1, 9)] == ["m.step 1", "m.step 9"]
    for name, value, allowed in (
        ("passes", 10, "a whole number from 1 to 9"),
        ("passes", "2", "a whole number from 1 to 9"),
        ("mirror", 3, "a path"),
        ("side", "left", "back or front"),
    ):
        with pytest.raises(InputError) as caught:
            polish(**{"mirror": "m.step", name: value})  # type: ignore[call-overload]
        assert str(caught.value) == f"{name} is {value!r}, allowed is {allowed}: change it"


def test_a_command_takes_paths_and_its_own_options() -> None:
    def command(options: CalibrateOptions, loud: Annotated[bool, typer.Option()] = False) -> int:
        return 0

    shown = {one.name: one for one in parameters(command)}
    assert next(iter(shown)) == "run"
    assert [*shown][-1] == "loud"
    assert "progress" not in shown
    assert shown["exports"].annotation.__origin__ is Path


def test_public_functions_have_the_options_of_their_commands() -> None:
    names = "build calibrate capture dataset intrinsics merge reconstruct run simulate_run verify"
    for name in names.split():
        command = {one.name for one in leaves()[(name.replace("_", "-"),)].params}
        python = set(inspect.signature(getattr(tbcad, name)).parameters)
        assert command - ONLY_WRITTEN == python - ONLY_PYTHON


def test_refusals_in_python_name_its_keywords(tmp_path: Path) -> None:
    for wrong, said in (
        (
            lambda: tbcad.build(n=3, wanted_yield=0.9),
            "wanted_yield 0.9 is of no use without process",
        ),
        (lambda: tbcad.build(n=3, process=" "), "process is ' ', allowed is one of fdm"),
        (
            lambda: tbcad.dataset(tmp_path, to="colmap", exports="x"),
            "exports x is for to mitsuba",
        ),
    ):
        with pytest.raises(InputError) as error:
            wrong()
        assert str(error.value).startswith(said)


def test_a_record_is_refused_by_the_options_of_the_command() -> None:
    with pytest.raises(InputError, match=r"^--yield .* without --process"):
        tbcad.build(BuildOptions(n=3, wanted_yield=0.9))


def test_help_has_a_line_for_each_parameter() -> None:
    """No addresses, no types of pathlib, nothing wider than a page; options by their keywords."""
    for name in (one for one in tbcad.__all__ if inspect.isfunction(getattr(tbcad, one))):
        text = pydoc.plaintext.document(getattr(tbcad, name))
        assert max(map(len, text.splitlines())) <= 100, name
        assert " at 0x" not in text
        assert "pathlib." not in text
    text = pydoc.plaintext.document(tbcad.build)
    assert "\n    out: Path | str = 'exports',\n    *,\n" in text
    assert "With process: share of simulated builds" in text
