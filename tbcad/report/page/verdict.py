"""verify.json as the page shows it: the verdict, checks and printability, as HTML."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path

from pydantic import Field
from tbcad_verify.report.as_made import GOOD, NOT_MODELLED, AsMade, ProcessYield, enough_bad
from tbcad_verify.report.methods import KEY_FIGURES

from tbcad.cad.formats.checked_files import Finite, Record, read_json
from tbcad.output.manifest import VERDICT

STATES = {True: ("pass", "✔", "pass"), False: ("fail", "✘", "fail"), None: ("unknown", "?", "?")}
NAMES = 12  # of checks that did not pass, in the headline
PRINTABLE = "printable"  # the check of a part by the printer that the design names


class CheckRow(Record):
    """A check of verify.json; passed is None where it could not be made."""

    name: str
    file: str = ""
    passed: bool | None = Field(alias="pass")
    measured: Finite | None = None
    limit: Finite | None = None
    unit: str = ""
    detail: str = ""


class PrintRow(Record):
    """A part on a printer."""

    part: str
    profile: str
    process: str = ""
    material: str = ""
    problems: tuple[str, ...] = ()


class MeasuredMirror(Record):
    """Measurements of a mirror."""

    id: str
    coverage_facet_mm: Finite | None = None
    coverage_fitted_mm: Finite | None = None
    centre_error_mm: Finite | None = None
    radius_error_mm: Finite | None = None
    pixels: Finite | None = None


class Verdict(Record):
    """verify.json."""

    passed: bool = Field(alias="pass")
    target_mm: Finite
    checks: tuple[CheckRow, ...]
    printing: tuple[PrintRow, ...] = ()
    mirrors: tuple[MeasuredMirror, ...] = ()
    programs: tuple[CheckRow, ...] = ()


def read_verdict(folder: Path) -> Verdict | None:
    """The verification of a build; None if it was not verified.

    InputError: verify.json is damaged.
    """
    path = folder / VERDICT
    if not path.is_file():
        return None
    return read_json(path, Verdict, None, "run tbcad verify")


def verdict_html(
    verdict: Verdict | None, as_made: AsMade | None, views: int, balls: int, target_mm: float
) -> Iterator[str]:
    """The top of the page: files, shells, prototype, as the command's three lines have them."""
    yield "<div class=verdicts>"
    yield from _files(verdict, views, balls, target_mm)
    yield from _shells(as_made, target_mm)
    if balls:
        yield from _prototype(verdict, as_made, target_mm)
    yield "</div>"


def _files(verdict: Verdict | None, views: int, balls: int, target_mm: float) -> Iterator[str]:
    if verdict is None:
        yield "<div class='card unknown'><h2>Files</h2><p class=big>? not verified</p>"
        yield "<p>Run <code>tbcad verify</code>, then <code>tbcad report</code> again.</p></div>"
        return
    state, sign, _ = STATES[verdict.passed]
    yield f"<div class='card {state}'><h2>Files</h2>"
    yield f"<p class=big><span aria-hidden=true>{sign}</span> {state.upper()}</p>"
    every = (*verdict.checks, *verdict.programs)
    if verdict.passed:
        too = f", and so do the prototype's {balls} balls in place of the mirrors" if balls else ""
        yield (
            f"<p>As designed {views} virtual cameras see the whole object of {target_mm:g} mm{too}."
            f" {len(every)} checks were made on the files themselves.</p>"
        )
    yield from _key_figures(verdict)
    for text, wanted in (("Failed", False), ("Unknown", None)):
        names = list(dict.fromkeys(check.name for check in every if check.passed is wanted))
        if names:
            more = f" and {len(names) - NAMES} more" if len(names) > NAMES else ""
            yield f"<p>{text}: {escape(', '.join(names[:NAMES]))}{more}.</p>"
    yield "</div>"


def _key_figures(verdict: Verdict) -> Iterator[str]:
    """Figures that decide the verdict of a build, each with its limit."""
    named = {check.name: check for check in verdict.checks}
    count = Counter(check.name for check in verdict.checks)
    yield "<table><tbody>"
    for one in KEY_FIGURES:
        check = named.get(one.check)
        if check is None or count[one.check] > 1 or check.measured is None:
            continue
        limit = "" if check.limit is None else f"limit {_figure(check.limit)}"
        unit = _unit(check.unit if one.unit is None else one.unit)
        state, sign, _ = STATES[check.passed]
        yield (
            f"<tr><th>{escape(one.label)}<td class=n>{_figure(check.measured, 4)} {unit}"
            f"<td class=n>{limit}<td class='state {state}'>{sign}</tr>"
        )
    yield "</tbody></table>"


def _shells(as_made: AsMade | None, target_mm: float) -> Iterator[str]:
    """By which chains the shells can be made."""
    if as_made is None or not as_made.processes:
        reason = (as_made and as_made.reason) or "no shell was built, or it was not verified"
        yield "<div class='card unknown'><h2>Shells</h2>"
        yield f"<p class=big>? not simulated</p><p>{escape(reason)}.</p></div>"
        return
    good = [f"{one.text} by {one.process}" for one in as_made.processes if one.is_good]
    state, sign, _ = STATES[bool(good)]
    yield f"<div class='card {state}'><h2>Shells</h2><p class=big>"
    yield f"<span aria-hidden=true>{sign}</span> "
    text = f"yield {', '.join(good)}" if good else f"no built-in process yields {GOOD:.0%}"
    yield f"{escape(text)}</p>"
    yield _yield_words(as_made.builds, target_mm)
    yield _yields(as_made.processes)
    yield (
        "<p class=note>Larger margins give larger yields: <code>tbcad build --process NAME</code>; "
        "causes: <code>tbcad tolerance</code>.</p>"
    )
    yield f"<p class=note>Left out: {NOT_MODELLED}.</p></div>"


def _prototype(verdict: Verdict | None, as_made: AsMade | None, target_mm: float) -> Iterator[str]:
    """The yield of calibrated prototypes, and what the printer cannot make."""
    made = as_made.prototype if as_made else None
    parts = [one for one in verdict.checks if one.name == PRINTABLE] if verdict else []
    failed = [one for one in parts if one.passed is not True]
    good = None if made is None or not parts else made.is_good and not failed
    state, sign, _ = STATES[good]
    yield f"<div class='card {state}'><h2>Prototype</h2><p class=big>"
    yield f"<span aria-hidden=true>{sign}</span> "
    yield "not simulated</p>" if made is None else f"yield {made.text} once calibrated</p>"
    if as_made and made:
        yield _yield_words(as_made.builds, target_mm)
        yield _yields([made])
    if parts and not failed:
        yield f"<p>All {len(parts)} parts can be made.</p>"
    for one in failed:
        yield f"<p>Cannot be made: {escape(one.file)}: {escape(one.detail)}.</p>"
    yield "</div>"


def _yield_words(builds: int, target_mm: float) -> str:
    return (
        f"<p>Share of {builds} simulated builds, or fewer where {enough_bad(builds)} failed, in "
        f"which every virtual camera sees {target_mm:g} mm; median of their minimum coverage:</p>"
    )


def _yields(yields: Sequence[ProcessYield]) -> str:
    rows = (
        f"<tr><th>{escape(one.process)}<td class=n>{one.share:.0%} of {one.builds}"
        f"<td class=bar><meter min=0 max=1 value={one.share:.3f} "
        f"aria-label='yield of {escape(one.process, quote=True)}'>{one.share:.0%}</meter>"
        f"<td class=n>{one.coverage_mm:.2f} mm</tr>"
        for one in yields
    )
    heads = "<tr><th>Process<th colspan=2>Yield<th>Coverage</tr>"
    return f"<table class=made><thead>{heads}</thead><tbody>{''.join(rows)}</tbody></table>"


def checks_html(verdict: Verdict | None) -> Iterator[str]:
    """Failed checks, then all checks by name."""
    if verdict is None:
        yield "<p>This build is not verified.</p>"
        return
    every = (*verdict.checks, *verdict.programs)
    failed = [check for check in every if check.passed is not True]
    if failed:
        yield from _check_table(failed)
    place = {name: k for k, name in enumerate(dict.fromkeys(check.name for check in every))}
    passed = sum(check.passed is True for check in every)
    yield f"<p>{passed} of {len(every)} checks passed.</p>"
    yield f"<details><summary>All {len(every)} checks, by name</summary>"
    yield from _check_table(sorted(every, key=lambda check: place[check.name]))
    yield "</details>"


def _check_table(checks: Iterable[CheckRow]) -> Iterator[str]:
    yield (
        "<div class=wide><table class=checks><thead><tr><th>Result<th>Check<th>File<th>Measured"
        "<th>Limit<th>Unit<th>Detail</tr></thead><tbody>"
    )
    for check in checks:
        state, sign, text = STATES[check.passed]
        yield (
            f"<tr><td class='state {state}'>{sign} {text}<td>{escape(check.name)}"
            f"<td>{escape(check.file)}<td class=n>{_figure(check.measured)}"
            f"<td class=n>{_figure(check.limit)}<td>{_unit(check.unit)}<td>{escape(check.detail)}"
            "</tr>"
        )
    yield "</tbody></table></div>"


def _unit(text: str) -> str:
    return escape("µm" if text == "um" else text)


def _figure(value: float | None, digits: int = 5) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def printing_html(rows: Sequence[PrintRow]) -> Iterator[str]:
    """Parts against processes: can be made, or why not."""
    if not rows:
        yield "<p>Not known: this build is not verified.</p>"
        return
    printers = {row.profile: row for row in rows}
    cells = {(row.part, row.profile): row for row in rows}
    yield "<div class=wide><table class=matrix><thead><tr><th>Part"
    for name, row in printers.items():
        yield f"<th>{escape(name.upper())}<br><small>{escape(row.material)}</small>"
    yield "</tr></thead><tbody>"
    for part in dict.fromkeys(row.part for row in rows):
        yield f"<tr><th>{escape(part)}"
        yield from (_print_cell(cells.get((part, name))) for name in printers)
        yield "</tr>"
    yield "</tbody></table></div>"


def _print_cell(row: PrintRow | None) -> str:
    if row is None:
        return "<td>"
    if not row.problems:
        return "<td class='state pass'>✔ yes"
    return f"<td class='state fail'>✘ no: <small>{escape('; '.join(row.problems))}</small>"
