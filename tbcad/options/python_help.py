"""Words of Python about a call: signatures as `help` shows them, and keywords in refusals."""

import re
from collections.abc import Callable, Iterator, Mapping
from inspect import Parameter, Signature, signature
from os import PathLike
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

Made = TypeVar("Made", bound=Callable[..., Any])
OPTION = re.compile(r"--[a-z][a-z-]*[a-z]")


class LinesSignature(Signature):
    """A signature with each parameter on a line of its own."""

    __slots__ = ()

    def __str__(self) -> str:
        """Return it as `help` shows it."""
        lines = "".join(f"    {line},\n" for line in self._lines())
        returned = self.return_annotation
        return f"(\n{lines}) -> {returned if isinstance(returned, str) else short_type(returned)}"

    def _lines(self) -> Iterator[str]:
        starred = False
        for one in self.parameters.values():
            if one.kind is Parameter.KEYWORD_ONLY and not starred:
                starred = True
                yield "*"
            text = f"{one.name}: {short_type(one.annotation)}"
            yield text if one.default is Parameter.empty else f"{text} = {_value(one.default)}"


def in_lines(function: Made) -> Made:
    """Let `help` show a function's signature with each parameter on a line of its own."""
    own = signature(function)
    shown = LinesSignature([*own.parameters.values()], return_annotation=own.return_annotation)
    vars(function)["__signature__"] = shown
    return function


def _value(default: object) -> str:
    """A default as it is written: a function by its name, a path as text."""
    if callable(default):
        return str(getattr(default, "__name__", default))
    return repr(str(default)) if isinstance(default, PathLike) else repr(default)


def short_type(kind: Any) -> str:
    """A type in few words: `Path | str` for all that names a file, `'y' | 'z'` for two words."""
    origin, args = get_origin(kind), get_args(kind)
    if isinstance(kind, list):
        return f"[{', '.join(map(short_type, kind))}]"
    if origin in (Union, UnionType):
        return " | ".join(short_type(one) for one in args if get_origin(one) is not PathLike)
    if origin is Literal:
        return " | ".join(map(repr, args))
    if origin is not None:
        return f"{origin.__name__}[{', '.join(map(short_type, args))}]"
    return "None" if kind in (None, NoneType) else str(getattr(kind, "__name__", kind))


def in_python(text: str, options: Mapping[str, Any]) -> str:
    """A line for the screen with keywords of Python in place of a command's options.

    options: annotated types of the keywords by their names.
    """
    words = dict(_words(options))
    return OPTION.sub(lambda found: words.get(found[0], found[0]), text)


def _words(options: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Options as they are written, and how Python has them: size, force=True."""
    for name, kind in options.items():
        of, option = get_args(kind)[:2]
        # Of an annotation, typer takes its first way of writing for a default.
        given = (getattr(option, "default", None), *(getattr(option, "param_decls", None) or ()))
        ways = "/".join(one for one in given if isinstance(one, str)).split("/")
        plain = name.replace("_", "-")
        for way in (f"--{plain}", f"--no-{plain}", *ways):
            yield way, f"{name}={not way.startswith('--no-')}" if of is bool else name
