"""The closed grammar of STEP files: what a build does not write is refused, whatever it means.

A reader obeys what the solids do not show: units, layers, invisible items, notes of a product, a
solid that is listed twice. So every entity has one of the forms of `forms.toml`, and refers to
entities of the forms that it may. Geometry is measured elsewhere, and has no names but those of a
shell's faces.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Mapping
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from tbcad_verify.step.part21 import LABEL, SHOWN, StepTable

PLACE = re.compile(r"#([A-Z]\w*)(\*?)|(%)|(@)")
REFERENCE, NUMBER, NAME = r"#\d+", r"[-+]?\d+(?:\.\d*)?(?:E[-+]?\d+)?", r"'([\w-]+)'"
SOLID, PRODUCT, FACE = "MANIFOLD_SOLID_BREP", "PRODUCT", "ADVANCED_FACE"
SHAPES = {"ADVANCED_BREP_SHAPE_REPRESENTATION", "SHAPE_REPRESENTATION"}
DEPTH = 2  # of references by which forms of the same look differ
NAMED = ("shell_", "mandrel_")  # products whose faces have names
POINT = "'centre point'"
RATIONAL = re.compile(r"\(BOUNDED_(?:CURVE|SURFACE)\(\)B_SPLINE_[^']*REPRESENTATION_ITEM\(''\)\)")


class Form(NamedTuple):
    """How an entity may look."""

    name: str
    text: str  # as `forms.toml` has it
    pattern: re.Pattern[str]  # of its text without blanks; a group for each place
    places: tuple[str, ...]  # names of the forms that it may refer to there; empty: no reference


def refuse_foreign(table: StepTable) -> None:
    """Refuse a file that has an entity, a reference or a header that no build writes.

    ValueError: it says which, and what is allowed.
    """
    rules = _rules()
    if not _form("", rules["header"]).pattern.fullmatch("".join(table.head.split())):
        raise ValueError(f"the header is none of tbcad's: {table.head[:SHOWN]!r}")
    bodies, count = table.bodies, Counter[str]()
    found: dict[int, list[tuple[Form, tuple[str, ...]]]] = {}
    for kind, every in table.numbered.items():
        numbers = every
        if kind in rules["geometry"]:
            count[kind] += len(every)
            nameless = ("",) if kind == FACE else ("''", POINT)
            numbers = [one for one in every if not bodies[one].startswith(nameless)]
        found |= {one: _matched(one, kind, bodies[one]) for one in numbers}
    names = {number: {form.name for form, _ in forms} for number, forms in found.items()}
    for _ in range(DEPTH):
        for number, forms in found.items():
            names[number] = {form.name for form, at in forms if _fits(table, names, form, at)}
            if not names[number]:
                allowed = " or ".join(", ".join(form.places) for form, _ in forms)
                raise ValueError(f"#{number}, {forms[0][0].name}, refers to others than {allowed}")
    count.update(chain.from_iterable(names.values()))
    _refuse_counts(table, count)


def _fits(
    table: StepTable, names: Mapping[int, set[str]], form: Form, places: tuple[str, ...]
) -> bool:
    """Whether what is at the places are references, each once, to what they may refer to."""
    for allowed, text in zip(form.places, places, strict=True):
        numbers = [int(one) for one in re.findall(r"\d+", text)] if allowed else []
        kinds = SHAPES if allowed == "SHAPE" else {allowed}
        others = (names[k] if k in names else {table.kinds[k]} for k in numbers)
        if len(set(numbers)) < len(numbers) or any(not some & kinds for some in others):
            return False
    return True


def _refuse_counts(table: StepTable, count: Counter[str]) -> None:
    """A solid, product, unit or occurrence too many, and names where no face has one."""
    rules = _rules()
    wanted = {
        **dict.fromkeys(rules["each_product"], count[PRODUCT]),
        **dict.fromkeys(rules["each_occurrence"], count[PRODUCT] - 1),
        **dict.fromkeys(rules["each_solid"], count[SOLID]),
    }
    for name, number in wanted.items():
        if count[name] != number:
            raise ValueError(f"{count[name]} times {name}, allowed is {number}")
    occurrences = table.of("NEXT_ASSEMBLY_USAGE_OCCURRENCE")
    inner = [table.product(table.references(one)[1]) for one in occurrences]
    if len(set(inner)) != len(inner):
        raise ValueError("a product is in the assembly twice")
    for one, product in zip(occurrences, inner, strict=True):
        if LABEL.findall(table.bodies[one])[1][1:-1] != product:
            raise ValueError(f"#{one} names {product} otherwise")
    labels = [name for face in table.of(FACE) if (name := table.label(face))]
    products = [table.label(one) for one in table.of(PRODUCT)]
    if (named := LABEL.findall(table.head)[2][1:-1]) not in products:
        raise ValueError(f"the file is named {named}, its product {products[0]}")
    if labels and not products[0].startswith(NAMED):
        raise ValueError(f"a face of {products[0]} is named {labels[0]}, allowed is no name")
    if other := [one for one in labels if not re.fullmatch(rules["face"], one)]:
        raise ValueError(f"a face is named {other[0]}, allowed is {rules['face']}")


def _matched(number: int, kind: str, body: str) -> list[tuple[Form, tuple[str, ...]]]:
    """The forms that an entity may have, and what is at their places."""
    text = f"{kind}({''.join(body.split())})"
    forms = [(form, form.pattern.fullmatch(text)) for form in _forms().get(kind, ())]
    if found := [(form, match.groups()) for form, match in forms if match]:
        return found
    allowed = " or ".join(one.text for one in _forms().get(kind, ())) or "no such entity"
    raise ValueError(f"#{number} is {text[:SHOWN]}, allowed is {allowed}")


@cache
def _rules() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_name("forms.toml").read_text(encoding="utf-8"))


@cache
def _forms() -> dict[str, list[Form]]:
    """Forms by kind; that of complex entities is empty."""
    rules = _rules()
    whole = [(text.partition("(")[0], name, text) for name, text in rules["whole"].items()]
    parts = [
        (name, name, f"{name}({text})")
        for name, texts in rules["forms"].items()
        for text in ([texts] if isinstance(texts, str) else texts)
    ]
    forms: dict[str, list[Form]] = {"": [Form("RATIONAL", "a rational curve", RATIONAL, ())]}
    for kind, name, text in (*whole, *parts):
        forms.setdefault(kind, []).append(_form(name, text))
    return forms


def _form(name: str, text: str) -> Form:
    """A form of the text that describes it."""
    pattern, places, end = "", [], 0
    for place in PLACE.finditer(text):
        kind, many, number, _ = place.groups()
        pattern += re.escape(text[end : place.start()])
        if kind:
            pattern += rf"({REFERENCE}(?:,{REFERENCE})*)" if many else rf"({REFERENCE})"
            places.append(kind)
        elif number:
            pattern += NUMBER
        else:
            again = rf"'\{places.index('') + 1}'" if "" in places else ""
            pattern += again or NAME
            places += [] if again else [""]
        end = place.end()
    return Form(name, text, re.compile(pattern + re.escape(text[end:])), tuple(places))
