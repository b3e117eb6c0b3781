"""Mirrors of a spec, and a search for better ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import short_text
from tbcad.core.spec.load import load_spec, option_texts
from tbcad.errors import InputError
from tbcad.options.builds import AnyDesign, OptimizeOptions
from tbcad.options.call import keywords, silent
from tbcad.options.python_help import in_lines

if TYPE_CHECKING:
    from build123d import Part
    from cadquery import Workplane

    from tbcad.app.whole_design import Design
    from tbcad.optimizing.search import SearchResult
    from tbcad.types import Progress


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


@in_lines
def design(
    spec: Spec | Path | str | None = None,
    *,
    n: int | None = None,
    settings: Settings = (),
    detail: Progress = silent,
) -> Design:
    """Compute the mirrors of both cameras.

    Args:
        spec: a spec, a design file (TOML), or None for the design of the paper.
        n: subdivision of the icosahedron, in place of the spec's.
        settings: "key=value" texts or a mapping of them, on top of a design file.
        detail: called with the state of the search for the radii.

    Raises:
        SpecError: the spec is not allowed, or its mirrors cannot be made; it says what to change.

    >>> import tbcad
    >>> tbcad.design(n=4)
    <Design 'turtleback': n = 4, 49 + 49 mirrors, minimum coverage 60.60 mm>
    """
    from tbcad.app.whole_design import Design
    from tbcad.core.mirrors.array import design as mirror_design

    mirrors = mirror_design(chosen_spec(spec, n, settings), detail)
    return Design(mirrors.spec, mirrors.arrays)


@keywords(OptimizeOptions)
def optimize(options: OptimizeOptions) -> SearchResult:
    """Search better places of cameras and mirrors for the same sensor and number of mirrors.

    Returns:
        The first design and the best one with their figures, and all candidates.

    Raises:
        InputError: the design is not allowed or cannot be made, or a file exists.
    """
    from tbcad.common.atomic_files import replace_files
    from tbcad.common.schedule import one_client
    from tbcad.optimizing.search import search, search_files

    options.check()
    spec = chosen_spec(options.design, None, options.settings)
    store = _checked_store(options)
    options.progress("optimize: candidates")
    with one_client(options.scheduler):
        result = search(spec, options, store)
    options.progress("optimize: files")
    replace_files(store.parent, search_files(result, spec, options))
    return result


def _checked_store(asked: OptimizeOptions) -> Path:
    """Refuse, before any work, what would be lost; where candidates are kept for `--resume`.

    Raises:
        InputError: a file exists or cannot be written.
    """
    from tbcad.common.atomic_files import write_errors_as_input_errors
    from tbcad.output.single_files import check_file

    out, table, plot = asked.files
    store = table.with_suffix(".jsonl")
    begun = Path(asked.design) if isinstance(asked.design, Path | str) else None
    with write_errors_as_input_errors(out):
        if out.is_dir():
            raise InputError(f"{out} is a folder: name a TOML file with --out")
        for file in (out, table, plot):
            check_file(file, asked.force or asked.resume, (begun,))
        if store.exists() and not (asked.resume or asked.force):
            raise InputError(f"{store} exists: go on with --resume, or begin anew with --force")
        out.parent.mkdir(parents=True, exist_ok=True)
        if not asked.resume:
            store.unlink(missing_ok=True)
    return store


def to_cadquery(part: Part) -> Workplane:
    """Return a part as a cadquery workplane, to model on; both share one kernel and the geometry.

    Args:
        part: of `Design.shell`, `mandrel` or `printed_parts`, or of build123d, mm. Its label
            becomes the workplane's tag.

    Raises:
        InputError: cadquery is not installed.
    """
    from tbcad.cad.kernel.solids import as_workplane

    return as_workplane(part)
