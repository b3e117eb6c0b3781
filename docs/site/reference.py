"""Reference pages, generated from the code: commands, keys of a design, Python, files."""

import inspect
import json
import re
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import typer.main
from pydantic import BaseModel
from pydantic.json_schema import PydanticInvalidForJsonSchema
from tbcad_verify.record.prototype import PlateHoles

import tbcad
from tbcad.app.cli.app import app
from tbcad.app.cli.help_texts import HEADINGS
from tbcad.app.reference.keys import design_template
from tbcad.prototype.files import bom
from tbcad.records.calibration import CalibrationRecord, MachineRecord
from tbcad.records.design import DesignRecord
from tbcad.records.document import Document, Manifest
from tbcad.records.prototype import Prototype
from tbcad.records.run import Exposure, RunRecord
from tbcad.records.tables import BallRow, MirrorRow, PictureRow, RayRow, StopRow, WiringRow

ROOT = Path(__file__).parents[2]
RECORDS: dict[str, type[Document]] = {
    "design.json": DesignRecord,
    "manifest.json": Manifest,
    "prototype.json": Prototype,
    "run.json": RunRecord,
    "photographs/NAME.json": Exposure,
    "machine.json": MachineRecord,
    "calibration.json": CalibrationRecord,
}
TABLES: dict[str, type[BaseModel]] = {
    "mirrors.csv": MirrorRow,
    "balls.csv": BallRow,
    "plate_holes.csv": PlateHoles,
    "rotation_plan.csv": PictureRow,
    "stops.csv": StopRow,
    "rays.csv": RayRow,
}
PAPER = {"bom.csv": bom.COLUMNS, "wiring.csv": WiringRow.columns()}  # read by people
MARKUP = re.compile(r"\[/?[a-z]+\]")  # of rich, in help texts


def pages() -> dict[str, str]:
    """Text of every generated page by its address."""
    return {
        "reference/commands.md": "\n".join(_commands()),
        "reference/keys.md": "\n".join(_keys()),
        "reference/python.md": "\n".join(_python()),
        "reference/files.md": "\n".join(_files()),
        **{
            f"reference/{Path(name).name}.schema.json": _schema(model)
            for name, model in RECORDS.items()
        },
    }


def _commands() -> Iterator[str]:
    """Every command with its options, under the headings of `tbcad --help`."""
    group: Any = typer.main.get_command(app)
    yield "# Commands\n\nGenerated from the commands; `tbcad COMMAND --help` says the same."
    for heading, names in HEADINGS.items():
        yield f"\n## {heading}"
        for name in names:
            yield from _command((name,), group.commands[name])


def _command(words: tuple[str, ...], command: Any) -> Iterator[str]:
    inner = getattr(command, "commands", None)
    if inner is not None:
        for name in inner:
            yield from _command((*words, name), inner[name])
        return
    context = command.make_context("tbcad", [], resilient_parsing=True)
    yield f"\n### tbcad {' '.join(words)}\n"
    yield _plain(command.help or "")
    yield "\n| argument or option | meaning |\n|---|---|"
    for parameter in command.params:
        if getattr(parameter, "hidden", False):
            continue
        spelling, meaning = parameter.get_help_record(context)
        yield _row(f"`{spelling.replace('|', ' or ')}`", _plain(meaning))


def _plain(text: str) -> str:
    return MARKUP.sub("", inspect.cleandoc(text)).replace("\b\n", "")


def _keys() -> Iterator[str]:
    """What `tbcad init` writes, in which every key is explained, section by section."""
    yield (
        "# Keys of a design\n\nA design is a TOML file. These are all its keys with their "
        "defaults, as `tbcad init` writes them; a key that is left out has the value given "
        "here. On the command line: `tbcad build --set shell.wall_mm=4`."
    )
    for section in re.split(r"\n(?=(?:# .*\n)+\[)", design_template()):
        name = re.search(r"^\[(.*)\]", section, re.MULTILINE)
        yield f"\n## {name[1] if name else 'Name'}\n\n```toml\n{section.strip()}\n```"


def _python() -> Iterator[str]:
    """The public names with their docstrings."""
    yield (
        "# Python\n\nThe public names, `tbcad.__all__`. Loading `tbcad` is quick; each name is "
        "loaded when it is first used."
    )
    for name in sorted(tbcad.__all__):
        if not name.startswith("__"):
            thing = getattr(tbcad, name)
            yield f"\n::: {thing.__module__}.{thing.__qualname__}"
            yield f"    options:\n      heading: tbcad.{name}"


def _files() -> Iterator[str]:
    """The records and tables of an export, field by field."""
    yield (
        "# Files\n\nRecords and tables of builds, runs and calibrations, as they are written and "
        "read. Names end with their unit. Frames and directions: [conventions](../conventions.md). "
        "Solids are STEP AP214 in mm; meshes are binary STL and 3MF."
    )
    for file, model in RECORDS.items():
        name = f"{Path(file).name}.schema.json"
        yield f"\n## {file}\n\nJSON schema: [{name}]({name})."
        for part in _below(model):
            yield from _fields(part, "###")
    for file, table in TABLES.items():
        yield from _fields(table, "##", title=file)
    for file, columns in PAPER.items():
        names = ", ".join(f"`{name}`" for name in columns)
        yield f"\n## {file}\n\nFor people; no program reads it again. Columns: {names}."


def _below(model: type[BaseModel]) -> list[type[BaseModel]]:
    """A model and all models in its fields, each once, in the order of their fields."""
    seen: dict[type[BaseModel], None] = {model: None}
    for field in model.model_fields.values():
        for inner in _models(field.annotation):
            seen |= dict.fromkeys(_below(inner))
    return list(seen)


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models(inner)


def _fields(model: type[BaseModel], level: str, title: str = "") -> Iterator[str]:
    """A table of a model's fields, with what its docstring says of each."""
    doc = inspect.cleandoc(model.__doc__ or "")
    said = dict(re.findall(r"(?m)^ +(\w+): ((?:.|\n {8})*)", doc.partition("Attributes:")[2]))
    summary = doc.partition("Attributes:")[0].strip()
    yield f"\n{level} {title or model.__name__}\n\n{summary}\n"
    yield "| field | type | meaning |\n|---|---|---|" if said else "| field | type |\n|---|---|"
    for name, field in model.model_fields.items():
        meaning = [said.get(name, "")] if said else []
        yield _row(f"`{field.alias or name}`", _type(field.annotation), *meaning)


WORDS = {float: "number", int: "whole number", str: "text", bool: "true or false"}


def _type(annotation: Any) -> str:
    """A type in words."""
    inner = get_args(annotation)
    match get_origin(annotation):
        case origin if origin is Annotated:
            text = _type(inner[0])
        case origin if origin is Literal:
            text = " or ".join(f"`{one}`" for one in inner)
        case origin if origin in (Union, types.UnionType):
            text = " or ".join(_type(one) for one in inner)
        case origin if origin in (tuple, list):
            text = f"list of {_type(inner[0])}"
        case origin if origin is dict:
            text = f"object of {_type(inner[1])}"
        case _ if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            text = f"[{annotation.__name__}](#{annotation.__name__.lower()})"
        case _:
            text = WORDS.get(annotation, "column" if "ndarray" in str(annotation) else "value")
    return text


def _row(*cells: str) -> str:
    escaped = (" ".join(cell.split()).replace("|", "\\|") for cell in cells)
    return f"| {' | '.join(escaped)} |"


def _schema(model: type[BaseModel]) -> str:
    """JSON schema of a record."""
    try:
        return json.dumps(model.model_json_schema(), indent=1) + "\n"
    except PydanticInvalidForJsonSchema as error:
        raise SystemExit(f"{model.__name__} has no JSON schema: {error}") from None
