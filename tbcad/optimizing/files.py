"""The files of a search: the better design, all candidates, and a plot."""

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from tbcad.cad.formats.checked_files import toml_text
from tbcad.common.results import PlotPanel, Series, Table, csv_text, plot_file
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import spec_dict
from tbcad.optimizing.candidate import DesignCandidate, Figures, placed
from tbcad.optimizing.search import SearchResult
from tbcad.options.designs import OptimizeOptions
from tbcad.types import Floats

FIGURES = tuple(field.name for field in fields(Figures))
VARIABLES = ("camera_x_mm", "camera_z_mm", "semi_minor_mm", "stretch_x", "stretch_y")
COLUMNS = (*VARIABLES, *FIGURES, "on_front", "reason")
LABELS = {
    "minimum_px": "pixels, minimum",
    "median_px": "pixels, median",
    "mean_log_px": "pixels, mean of logarithms",
    "variation": "coefficient of variation",
    "size_mm": "longest side, mm",
    "view_angle_deg": "angle of view, deg",
    "ssim": "SSIM of views",
}


Groups = dict[str, tuple[list[Figures], str]]
"""By label: what is drawn, and in which style."""


def search_files(result: SearchResult, spec: Spec, asked: OptimizeOptions) -> dict[str, bytes]:
    """The files of a search by name: the same search gives the same bytes."""
    contents = (
        design_text(result, spec).encode(),
        csv_text(candidate_table(result)).encode(),
        plot_file(panels(result), asked.plot),
    )
    return {file.name: data for file, data in zip(asked.files, contents, strict=True)}


def design_text(result: SearchResult, spec: Spec) -> str:
    """The best design as TOML: every key that is not the default, under what it gives."""
    lines = [
        f"# {spec.name}, with other places and directions: what tbcad optimize found.",
        "#",
    ]
    lines += [f"# {line}" for line in comparison(result)]
    changed = placed(spec, result.best.place)
    defaults = Spec.model_validate({"optics": {"n": spec.optics.n}})  # some follow from n
    rest = _assignments(spec_dict(changed), spec_dict(defaults))
    lines += ["", f"optics.n = {spec.optics.n}", *rest]
    return "\n".join(lines) + "\n"


def comparison(result: SearchResult) -> Iterator[str]:
    """Every figure of the first design and of the best one, a line each."""
    start, best = result.start.figures, result.best.figures
    yield f"{'':28} {'before':>9} {'after':>9}"
    for name, label in LABELS.items():
        before, after = getattr(start, name), getattr(best, name)
        if before is None or after is None:
            continue
        yield f"{label:28} {before:9.4g} {after:9.4g}"


def candidate_table(result: SearchResult) -> Table:
    """All candidates, in the order in which they were judged."""
    records = [_record(one) for one in result.candidates]
    for record, on_front in zip(records, result.on_front, strict=True):
        record["on_front"] = int(on_front)
    return Table.of_records("candidates", records, columns=COLUMNS)


def panels(result: SearchResult) -> tuple[PlotPanel, ...]:
    """Candidates by pixels and evenness, by pixels and size, and by SSIM where it was measured."""
    figures = [one.figures for one in result.candidates if one.figures]
    kept = [one for one in figures if result.limits.excess(one) == 0]
    front = zip(result.candidates, result.on_front, strict=True)
    best = [one.figures for one, on_front in front if on_front and one.figures]
    assert result.start.figures
    assert result.best.figures
    groups: Groups = {
        "candidates": (figures, "C2."),
        "within the limits": (kept, "C0."),
        "not bettered by any other": (best, "C1o"),
        "before": ([result.start.figures], "kx"),
        "after": ([result.best.figures], "k+"),
    }
    axes = [
        ("Pixels of the virtual cameras", "minimum_px", "variation"),
        ("Pixels and size", "size_mm", "minimum_px"),
    ]
    if result.best.figures.ssim is not None:
        axes.append(("Views and size", "size_mm", "ssim"))
    return tuple(_panel(title, groups, (x, y)) for title, x, y in axes)


def _panel(title: str, groups: Groups, axes: tuple[str, str]) -> PlotPanel:
    x, y = axes
    measured = {
        label: ([one for one in some if getattr(one, y) is not None], style)
        for label, (some, style) in groups.items()
    }
    series = tuple(
        Series(label, _column(some, x), _column(some, y), style)
        for label, (some, style) in measured.items()
    )
    return PlotPanel(title, LABELS[x], LABELS[y], series, logarithmic="xy")


def _column(some: list[Figures], name: str) -> Floats:
    return np.array([getattr(one, name) for one in some])


def _record(one: DesignCandidate) -> dict[str, str | int | float | None]:
    numbers = {name: getattr(one.figures, name, None) for name in FIGURES}
    place = dict(zip(COLUMNS, one.place, strict=False))
    return {**place, **numbers, "reason": one.reason}


def _assignments(values: dict[str, Any], defaults: dict[str, Any], name: str = "") -> Iterator[str]:
    """Lines of TOML for what differs from the defaults, by dotted keys."""
    for key, value in values.items():
        default = defaults.get(key)
        if isinstance(value, dict) and isinstance(default, dict):
            yield from _assignments(value, default, f"{name}{key}.")
        elif value != default:
            yield f"{name}{key} = {toml_text(value)}"
