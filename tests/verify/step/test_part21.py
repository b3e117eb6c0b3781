"""The reader of STEP text against steputils, a parser of the whole grammar."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from steputils import p21
from tbcad_verify.step.part21 import NUMBER, StepTable

SAMPLE = Path(__file__).parents[3] / "docs" / "sample" / "shell_a.step"
HEAD = "ISO-10303-21;\nHEADER;\nFILE_NAME('a;b','ENDSEC;');\nENDSEC;\nDATA;\n"
END = "ENDSEC;\nEND-ISO-10303-21;\n"


def leaves(value: Any) -> Iterator[Any]:
    """What is in a parameter of steputils, however deep."""
    if isinstance(value, p21.TypedParameter):
        yield from leaves(value.param)
    elif isinstance(value, tuple | list):
        for one in value:
            yield from leaves(one)
    else:
        yield value


def test_every_entity_of_a_shell() -> None:
    table = StepTable(SAMPLE.read_text())
    (section,) = p21.readfile(str(SAMPLE)).data
    simple = {
        int(reference[1:]): instance.entity
        for reference, instance in section.instances.items()
        if hasattr(instance, "entity")
    }
    assert table.kinds == {number: entity.name for number, entity in simple.items()}
    for number, entity in simple.items():
        values = list(leaves(entity.params))
        references = [int(one[1:]) for one in values if isinstance(one, p21.Reference)]
        assert table.references(number) == references
        assert table.numbers(number) == [one for one in values if isinstance(one, float)]
    faces = {number: simple[number].params for number in table.of("ADVANCED_FACE")}
    assert {number: table.label(number) for number in faces} == {n: p[0] for n, p in faces.items()}
    assert all(table.forward(n) == (str(p[-1]) == ".T.") for n, p in faces.items())


def test_a_text_in_an_entity_may_have_any_signs() -> None:
    table = StepTable(f"{HEAD}#1=A('it''s;)');\n#3 = C(#1);\n{END}")
    assert (table.kinds[1], table.bodies[1]) == ("A", "'it''s;)'")


MANY = 200_000
ENDLESS = {
    "comments": "/**/" * MANY,
    "comments without an end": "/*" * MANY,
    "stars": "/*" + "*" * MANY,
    "texts": "''" * MANY,
    "an open text": "'" + "''" * MANY,
    "blanks": " " * MANY,
    "ends of a header": "ENDSEC; " * MANY,
    "digits": "#" + "1" * MANY,
    "lists": "#1=A(" + "(" * MANY,
    "lists with an end": "#1=A(" + "(" * MANY + ")" * MANY + ");",
    "names": "#1=" + "A" * MANY,
    "complex": "#1=(" + "A(" * MANY + ")" * MANY + ");",
    "entities without an end": "#1 = A(" * MANY,
    "entities of one line": "#1 = A();" * MANY,
}


@pytest.mark.parametrize("text", ENDLESS.values(), ids=ENDLESS.keys())
@pytest.mark.parametrize("head", ["", "ISO-10303-21;HEADER;", HEAD])
def test_no_text_is_read_again_and_again(head: str, text: str) -> None:
    """Twice the text takes twice the time; a quadratic search would take hours."""
    for tail in ("x", ""):
        with pytest.raises(ValueError, match="broken STEP text") as error:
            StepTable(head + text + tail)
        assert len(str(error.value)) < 200
    assert NUMBER.findall("1" * MANY) == []


@given(
    values=st.lists(st.floats(allow_nan=False, allow_infinity=False), max_size=5),
    label=st.text("abc();,#'$* ", max_size=8),
    blank=st.sampled_from(["", " "]),
)
def test_what_is_written_is_read(values: list[float], label: str, blank: str) -> None:
    quoted, digits = label.replace("'", "''"), ",".join(f"{value:#.17E}" for value in values)
    text = f"{HEAD}#7{blank}={blank}THING('{quoted}',({digits}));\n{END}"
    table = StepTable(text)
    assert table.of("THING") == [7]
    assert (table.label(7), table.numbers(7)) == (label, values)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no header"),
        ("#1=A();", "no header"),
        (HEAD + "#1=A()", "broken STEP text at '#1=A"),
        (HEAD, "broken STEP text at ''"),
        (HEAD + "#1=A();\n#1=B();\n" + END, "one number"),
        (HEAD + "#1=A();\nx" + END, "broken STEP text at 'x"),
        (HEAD + "#1=A();#2=B();\n" + END, "broken STEP text at '#1=A"),
        (HEAD + "#1=A();\n" + END + "more", "broken STEP text at 'ENDSEC;"),
        (HEAD + "#1=A('an open text);\n" + END, "#1=A"),
        (HEAD + "#1=(((((\n#2=B();\n" + END, "a bracket too many"),
        (HEAD + "#1=A((1.);\n" + END, "a bracket too many"),
        (HEAD + "#1=A(/*1.*/);\n" + END, "a comment"),
    ],
)
def test_what_is_no_file_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match="broken STEP text") as error:
        StepTable(text)
    assert reason in str(error.value)


def test_what_is_no_point_is_refused() -> None:
    table = StepTable(
        f"{HEAD}#1=A('',(1.,2.,3.));\n#2=DIRECTION('',(1.,2.));\n"
        f"#3=DIRECTION('',(1.,2.,1.E400));\n{END}"
    )
    for number, reason in ((1, "A where a point"), (2, "where a point"), (3, "too large")):
        with pytest.raises(ValueError, match=reason):
            table.triple(number)
