"""Records of calls, and what follows from them: Python's keywords and the command's options."""

import ast
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from functools import cache, wraps
from inspect import Parameter, Signature, signature
from itertools import pairwise
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ParamSpec,
    Protocol,
    Self,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
    overload,
)

from typer import Option
from typer.models import ParameterInfo

from tbcad.common.progress import Progress
from tbcad.common.screen import Stages
from tbcad.errors import InputError
from tbcad.options.python_help import LinesSignature, in_python

Keywords = ParamSpec("Keywords")
Record = TypeVar("Record")
Asked_contra = TypeVar("Asked_contra", contravariant=True)
Result_co = TypeVar("Result_co", covariant=True)
Result = TypeVar("Result")
HELP_COLUMNS = 92  # of the arguments in a docstring; help() moves them by four
INDENTS: dict[str, Any] = {
    **{"initial_indent": 8 * " ", "subsequent_indent": 12 * " "},
    **{"break_long_words": False, "break_on_hyphens": False},
}


def silent(_: str) -> None:
    """Ignore a report of progress."""


@dataclass(frozen=True, kw_only=True)
class Call:
    """What a public function is called with; fields with a text below are a command's options."""

    progress: Progress = silent  # called with the name of each stage
    detail: Progress = silent  # called with the state of a stage
    # called with a line that says how a file was taken, or what is found so far
    answer: Progress = silent

    def __post_init__(self) -> None:
        """Refuse values of another type, or out of range; what lies in a folder stands for it."""
        for name, option in _annotated(type(self)).items():
            value = getattr(self, name)
            if isinstance(value, PathLike) and not isinstance(value, Path):
                object.__setattr__(self, name, Path(value))
            _check(name, getattr(self, name), *get_args(option))

    def on(self, screen: Stages) -> Self:
        """The call, with its progress on a screen."""
        return replace(self, progress=screen.stage, detail=screen.detail, answer=screen.note)


class Function(Protocol[Keywords, Asked_contra, Result_co]):
    """A public function: called with keywords, or with their record."""

    @overload
    def __call__(self, options: Asked_contra, /) -> Result_co: ...
    @overload
    def __call__(self, *args: Keywords.args, **kwargs: Keywords.kwargs) -> Result_co: ...


def keywords(
    record: Callable[Keywords, Record],
) -> Callable[[Callable[[Record], Result]], Function[Keywords, Record, Result]]:
    """Make a function of a record one of the record's fields."""
    kind = cast("type[Call]", record)

    def decorated(function: Callable[[Record], Result]) -> Function[Keywords, Record, Result]:
        @wraps(function)
        def called(*args: Any, **kwargs: Any) -> Result:
            if len(args) == 1 and not kwargs and isinstance(args[0], kind):
                return function(cast("Record", args[0]))
            try:
                return function(record(*args, **kwargs))
            except InputError as error:
                error.args = (in_python(str(error), _annotated(kind)),)
                raise

        vars(called)["__signature__"] = _signature(kind, signature(function).return_annotation)
        called.__doc__ = _with_arguments(function.__doc__ or "", kind)
        return cast("Function[Keywords, Record, Result]", called)

    return decorated


def _annotated(record: type) -> dict[str, Any]:
    """Types of the fields with an option, or with a text alone: those are keywords of Python."""
    kinds, texts = get_type_hints(record, include_extras=True), field_texts(record)
    return {
        one.name: _optional(one.name, kinds[one.name], one.default, texts.get(one.name))
        for one in fields(record)
        if get_origin(kinds[one.name]) is Annotated or one.name in texts
    }


def _optional(name: str, kind: Any, default: object, text: str | None) -> Any:
    """A field's type with its option, whose help is the text below the field."""
    if text is None:
        return kind
    kind, option = get_args(kind) if get_origin(kind) is Annotated else (kind, Option())
    option = copy(option)
    option.help = text
    if kind is bool and default is False and not option.param_decls:
        option.param_decls = (f"--{name.replace('_', '-')}",)  # alone, without its --no
    return Annotated[kind, option]


def field_texts(record: type) -> dict[str, str]:
    """The texts below the fields of a class and of those that it is derived from."""
    texts: dict[str, str] = {}
    for one in reversed(record.__mro__):
        if one.__module__.partition(".")[0] not in ("builtins", "pydantic"):
            texts |= _texts_by_class(one.__module__).get(one.__name__, {})
    return texts


@cache
def _texts_by_class(module: str) -> dict[str, dict[str, str]]:
    """The texts below the fields of all classes of a module, from its source."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    classes = [one for one in tree.body if isinstance(one, ast.ClassDef)]
    return {"": dict(_texts(tree)), **{one.name: dict(_texts(one)) for one in classes}}


def _texts(section: ast.Module | ast.ClassDef) -> Iterator[tuple[str, str]]:
    for key, text in pairwise(section.body):
        match key, text:
            case (
                ast.AnnAssign(target=ast.Name(id=name)) | ast.Assign(targets=[ast.Name(id=name)]),
                ast.Expr(value=ast.Constant(value=str(words))),
            ):
                yield name, " ".join(words.split())


def tell_options(module: str) -> None:
    """Give each option that a module declares the text below it as its help."""
    for name, text in _texts_by_class(module)[""].items():
        for option in get_args(getattr(sys.modules[module], name)):
            if isinstance(option, ParameterInfo):
                option.help = text


def parameters(function: Callable[..., int]) -> Iterator[Parameter]:
    """What typer makes options of: a record's fields, then what else a command's function takes."""
    first, *own = signature(function, eval_str=True).parameters.values()
    options = _annotated(first.annotation)
    for one in signature(first.annotation).parameters.values():
        kind = options.get(one.name)
        if kind is not None and isinstance(get_args(kind)[1], ParameterInfo):
            yield _typed(one.replace(annotation=kind))
    yield from map(_typed, own)


def _signature(record: type[Call], returned: object) -> Signature:
    """Keywords as a person reads them: options in the order of the command, then callbacks."""
    options, every = _annotated(record), signature(record).parameters.values()
    own = [
        one.replace(annotation=get_args(options[one.name])[0])
        for one in every
        if one.name in options
    ]
    rest = [one for one in every if one.name not in options]
    return LinesSignature([*own, *rest], return_annotation=returned)


def _typed(parameter: Parameter) -> Parameter:
    kind, *more = get_args(parameter.annotation)
    default = None if parameter.default == () else parameter.default
    kind = _written(kind) | None if default is None else _written(kind)
    return parameter.replace(
        kind=Parameter.KEYWORD_ONLY, annotation=Annotated[kind, *more], default=default
    )


def _written(kind: Any) -> Any:
    """The type of what is written on a command line: of several, a path, text or number."""
    if get_origin(kind) is Sequence:
        return list[_written(get_args(kind)[0])]  # type: ignore[misc]
    if get_origin(kind) not in (Union, UnionType):
        return kind
    for word in (Path, str, int):
        if word in get_args(kind):
            return word | None if NoneType in get_args(kind) else word
    for several in (one for one in get_args(kind) if get_origin(one) is Sequence):
        return _written(several)
    return kind


@cache
def _reader(kind: Any) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


def _check(name: str, value: object, kind: Any, option: ParameterInfo | str) -> None:
    from pydantic import ValidationError

    low, high = getattr(option, "min", None), getattr(option, "max", None)
    try:
        _reader(kind).validate_python(value, strict=True)
        number = value if isinstance(value, int | float) else low or 0
        inside = (low is None or low <= number) and (high is None or number <= high)
    except ValidationError:
        inside = False
    if not inside:
        raise InputError(refusal(name, value, _allowed(kind, low, high)))


def refusal(name: str, value: object, allowed: str) -> str:
    """The line about a wrong value of an option."""
    from tbcad.core.spec.errors import short_text

    return f"{name} is {short_text(value)}, allowed is {allowed}: change it"


def allowed_between(kind: Any, low: float | None, high: float | None) -> str:
    """What values of a simple type are allowed, in words."""
    from annotated_types import Ge, Le

    from tbcad.core.spec.errors import allowed_text

    limits = [of(bound) for of, bound in ((Ge, low), (Le, high)) if bound is not None]
    return allowed_text(kind, limits)


def _allowed(kind: Any, low: float | None, high: float | None) -> str:
    kinds = [one for one in get_args(kind) if one is not NoneType]
    if get_origin(kind) is Sequence:
        return f"a list, each of them {_allowed(kinds[0], low, high)}"
    if get_origin(kind) not in (Union, UnionType):
        return allowed_between(kind, low, high)
    if Path in kinds:
        return "a path"
    return " or ".join(_allowed(one, low, high) for one in kinds)


def _with_arguments(text: str, record: type[Call]) -> str:
    """A docstring with the record's help texts as its arguments."""
    options = _annotated(record)
    texts = {name: get_args(kind)[1] for name, kind in options.items()}
    told = [
        textwrap.fill(
            in_python(f"{name}: {getattr(text, 'help', text)}", options), HELP_COLUMNS, **INDENTS
        )
        for name, text in texts.items()
    ]
    summary, *sections = text.rstrip().split("\n\n    ")
    return "\n\n    ".join([summary, "Args:\n" + "\n".join(told), *sections]) + "\n    "
