"""What a build is asked to make; read before anything heavy is loaded."""

from tbcad.errors import InputError
from tbcad.spec.design import Spec

SHELL, PROTOTYPE = "shell", "prototype"
PARTS = (SHELL, PROTOTYPE)


def parse_parts(text: str) -> tuple[str, ...]:
    """The parts that a list with commas names, in the order they are built.

    Raises:
        InputError: it names none, or one that there is not.
    """
    named = {name.strip() for name in text.split(",") if name.strip()}
    if odd := sorted(named - {*PARTS}):
        raise InputError(f"--parts: {odd[0]!r} is no part: name {', '.join(PARTS)} or one of them")
    if not named:
        raise InputError(f"--parts: nothing to build: name {', '.join(PARTS)} or one of them")
    return tuple(name for name in PARTS if name in named)


def default_parts(spec: Spec) -> tuple[str, ...]:
    """What is built when nobody says what: all, but no balls for planar mirrors."""
    return (SHELL,) if spec.mirrors.radius_rule == "flat" else PARTS
