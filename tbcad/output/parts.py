"""What a build is asked to make; read before anything heavy is loaded."""

from collections.abc import Sequence

from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError
from tbcad.errors import InputError
from tbcad.prototype.suitable import check_suitable

SHELL, PROTOTYPE = "shell", "prototype"
PARTS = (SHELL, PROTOTYPE)
NAMED = "name shell, prototype or shell,prototype"


def parse_parts(text: str) -> tuple[str, ...]:
    """The parts that a list with commas names, in the order they are built.

    InputError: it names none, or one that there is not.
    """
    named = {name.strip() for name in text.split(",") if name.strip()}
    if odd := sorted(named - {*PARTS}):
        raise InputError(f"--parts: {odd[0]!r} is no part: {NAMED}")
    if not named:
        raise InputError(f"--parts: nothing to build: {NAMED}")
    return tuple(name for name in PARTS if name in named)


def default_parts(spec: Spec) -> tuple[str, ...]:
    """What is built when nobody says what: all, but no balls for planar mirrors."""
    return (SHELL,) if spec.mirrors.radius_rule == "flat" else PARTS


def check_parts(spec: Spec, parts: Sequence[str]) -> None:
    """Refuse a prototype where the spec alone says that none can be made; SpecError as said."""
    if PROTOTYPE not in parts:
        return
    try:
        check_suitable(spec)
    except SpecError as error:
        raise (only_shell_remains(error) if SHELL in parts else error) from None


def check_is_used(spec: Spec, parts: Sequence[str]) -> None:
    """Refuse what is asked of a prototype where none is built, so that it is not silently lost."""
    if spec.prototype.light.upper is True and PROTOTYPE not in parts:
        raise SpecError(
            "prototype.light.upper is true, but no prototype is built: set it to false or auto, or "
            "build --parts shell,prototype, with mirrors that are not flat"
        )


def check_lists(spec: Spec, parts: Sequence[str]) -> None:
    """Refuse lists of balls and prices that cannot be read: no reason to leave a prototype out.

    SpecError as said; it names line and column.
    """
    if PROTOTYPE in parts:
        from tbcad.prototype.balls.catalogue import load_catalogue
        from tbcad.prototype.purchased.parts import load_prices

        load_catalogue(spec.prototype.catalogues)
        load_prices(spec.prototype.prices)


def only_shell_remains(error: SpecError) -> SpecError:
    """The error of a prototype that is built with the shell, and could be left out."""
    return SpecError(f"{error}; or leave the prototype out with --parts shell")
