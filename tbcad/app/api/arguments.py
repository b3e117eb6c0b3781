"""What several public functions take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import short_text
from tbcad.core.spec.load import load_spec, option_texts
from tbcad.errors import InputError
from tbcad.options.designs import AnyDesign

Settings = Mapping[str, str] | Sequence[str]


def chosen_spec(spec: AnyDesign | None, n: int | str | None, settings: Settings) -> Spec:
    """Return a spec as it is, or read a design file; None: the design of the paper.

    Raises:
        InputError: a spec comes with settings, or the file is not allowed.
    """
    if isinstance(spec, Spec):
        if settings or n is not None:
            raise InputError("n and settings go with a design file: give them to load_spec")
        return spec
    if spec is not None and not isinstance(spec, Path | str):
        raise InputError(
            f"design is {short_text(spec)}, allowed is a spec, a design file (TOML) or the name of "
            "a design: change it"
        )
    options = option_texts(settings) + ([f"optics.n={n}"] if n is not None else [])
    return load_spec(None if spec is None else Path(spec), options)
