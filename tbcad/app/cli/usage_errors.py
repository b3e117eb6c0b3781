"""Wrong command lines: one line with what is wrong, where, what is allowed and what to do."""

import re
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from pydantic import ValidationError

# The typer library keeps the classes of its errors to itself: they differ in what they hold.
_PARAMETER, _OPTION, _LIKELY = "param", "option_name", "possibilities"

_EXTRA = re.compile(r"^Got unexpected extra argument\(s\) \(")


def usage_error_text(error: typer.TyperException) -> str:
    """Return the line for the screen, in place of typer's and pydantic's own sentences.

    Args:
        error: what typer found wrong with a command line.
    """
    from pydantic import ValidationError

    parameter = getattr(error, _PARAMETER, None)
    if parameter is not None and isinstance(error.__cause__, ValidationError):
        return _wrong_value(parameter, error.__cause__)
    if parameter is not None:
        return f"{_name(parameter)} is missing: name the {_first_lower(parameter.help.rstrip('.'))}"
    if likely := getattr(error, _LIKELY, None):
        option = getattr(error, _OPTION, "")
        return f"there is no option {option}: did you mean {' or '.join(sorted(likely))}?"
    fault = _EXTRA.sub("too many arguments: ", error.message.rstrip(".)"))
    fault = _first_lower(fault).replace(". Did", ": did")
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "tbcad"
    return f"{fault or 'no command is named'}: see {command} --help"


def _wrong_value(parameter: Any, error: "ValidationError") -> str:
    from tbcad.core.spec.errors import short_text

    given = error.errors(include_url=False)[0]["input"]
    return f"{_name(parameter)} is {short_text(given)}, allowed is {_allowed(parameter)}: change it"


def _allowed(parameter: Any) -> str:
    from annotated_types import Ge, Le

    from tbcad.core.spec.errors import allowed_text

    kind, limits = parameter.type_descriptor, parameter.type_descriptor.parameter_info
    between = [
        limit(bound) for limit, bound in ((Ge, limits.min), (Le, limits.max)) if bound is not None
    ]
    return " or ".join(kind.choices) if kind.is_choice else allowed_text(kind.annotation, between)


def _name(parameter: Any) -> str:
    """An option as it is written, its long form; an argument as the help calls it."""
    options = [name for name in parameter.opts if name.startswith("-")]
    return str(max(options, key=len, default=parameter.display_name_raw))


def _first_lower(text: str) -> str:
    return text[:1].lower() + text[1:]
