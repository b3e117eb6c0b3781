"""The reader of STEP text against steputils, a parser of the whole grammar."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from steputils import p21
from tbcad_verify.step.mirror_image import LABEL, NAME, STATEMENT
from tbcad_verify.step.part21 import (
    Enumeration,
    Reference,
    Typed,
    Value,
    parameters,
    read_entities,
)
from tbcad_verify.step.solids_text import NUMBER

SAMPLE = Path(__file__).parents[3] / "docs" / "sample" / "shell_a.step"
HEAD = "ISO-10303-21;\nHEADER;\nFILE_NAME('a;b','ENDSEC;');\nENDSEC;\nDATA;\n"
END = "ENDSEC;\nEND-ISO-10303-21;\n"


def as_ours(value: Any) -> Value:
    """A value of steputils as ours; it has no type for words in periods."""
    if isinstance(value, p21.Reference):
        return Reference(int(value[1:]))
    if isinstance(value, p21.Enumeration):
        return Enumeration(str(value).strip("."))
    if isinstance(value, p21.UnsetParameter):
        return None
    if isinstance(value, p21.TypedParameter):
        return Typed(value.type_name, [as_ours(value.param)])
    if isinstance(value, tuple):
        return [as_ours(one) for one in value]
    return value if isinstance(value, str) else float(value)


def test_every_entity_of_a_shell() -> None:
    entities = read_entities(SAMPLE.read_text())
    (section,) = p21.readfile(str(SAMPLE)).data
    simple = {
        int(reference[1:]): instance.entity
        for reference, instance in section.instances.items()
        if hasattr(instance, "entity")
    }
    assert entities.texts.keys() == simple.keys()
    for number, entity in simple.items():
        name, text = entities.texts[number]
        assert name == entity.name
        assert parameters(text) == [as_ours(one) for one in entity.params]


@pytest.mark.parametrize(
    ("entity", "texts"),
    [
        ("A(1)/* ) ;#2=B(2); */;", "1"),
        ("A(1)/*)*/;", "1"),
        ("A('it''s;)','/*')\n ;", "'it''s;)','/*'"),
        ("A(/* x) ;*/'y');", " 'y'"),
        ("/**//* ' */A/***/(2)/**/;", "2"),
    ],
)
def test_comments_and_texts_in_an_entity(entity: str, texts: str) -> None:
    assert read_entities(f"{HEAD}#1={entity}\n#3=C(#1);{END}").texts[1] == ("A", texts)


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
}


@pytest.mark.parametrize("text", ENDLESS.values(), ids=ENDLESS.keys())
@pytest.mark.parametrize("head", ["", "ISO-10303-21;HEADER;", HEAD])
def test_no_text_is_read_again_and_again(head: str, text: str) -> None:
    """Twice the text takes twice the time; a quadratic search would take hours."""
    for tail in ("x", ""):
        with pytest.raises(ValueError, match="broken STEP text") as error:
            read_entities(head + text + tail)
        assert len(str(error.value)) < 200


def test_no_other_expression_for_step_text_reads_again() -> None:
    header = "FILE_NAME(" * MANY + "FILE_NAME('" + "''" * MANY + "');"
    assert len(STATEMENT.findall(header)) == 1
    assert NAME.findall("A" * MANY) == []
    assert len(LABEL.findall("'" + "''" * MANY)) == 1
    assert NUMBER.findall("1" * MANY) == []


@pytest.mark.parametrize(
    "text", ["(" * MANY, "A(" * MANY, "(" * 40 + ")" * 40, "1" * 5000, "1E400", "#" + "1" * 5000]
)
def test_lists_too_deep_and_numbers_too_large_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="broken STEP text"):
        parameters(text)


def written(value: Value) -> str:
    match value:
        case None:
            text = "$"
        case Reference(number):
            text = f"#{number}"
        case Enumeration(word):
            text = f".{word}."
        case Typed(name, values):
            text = f"{name}({','.join(map(written, values))})"
        case list():
            text = f"({','.join(map(written, value))})"
        case str():
            text = "'" + value.replace("'", "''") + "'"
        case _:
            text = f"{value:.17E}"
    return text


LEAVES = st.one_of(
    st.none(),
    st.builds(Reference, st.integers(1, 10**6)),
    st.builds(Enumeration, st.sampled_from(["T", "F", "UNSPECIFIED"])),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text("abc();,#'$* ", max_size=8),
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.builds(Typed, st.just("LENGTH_MEASURE"), st.lists(inner, max_size=2)),
    ),
)


@given(values=st.lists(VALUES, max_size=5), blank=st.sampled_from(["", " ", "\n  ", "/* a; ' */"]))
def test_what_is_written_is_read(values: list[Value], blank: str) -> None:
    text = f"{HEAD}#7{blank}={blank}THING{blank}({','.join(map(written, values))}){blank};{END}"
    entities = read_entities(text)
    assert list(entities.of("THING")) == [(7, values)]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no header"),
        ("#1=A();", "no header"),
        (HEAD + "#1=A()", "broken STEP text at '#1=A"),
        (HEAD + "#1=A();#1=B();" + END, "one number"),
        (HEAD + "#1=A();\nx" + END, "broken STEP text at 'x"),
        (HEAD + "#1=A();" + END + "more", "broken STEP text at 'ENDSEC;"),
        (HEAD + "#1=A('an open text);" + END, "#1=A"),
        (HEAD + "#1=(((((\n#2=B();" + END, "#1=("),
        (HEAD + "#1=(A()1.);" + END, "a name must be"),
    ],
)
def test_what_is_no_file_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match="broken STEP text") as error:
        read_entities(text)
    assert reason in str(error.value)


@pytest.mark.parametrize("text", ["1.,", ",", "(1.", "1.)", "A", "1. 2.", "#", ".t.", "'a' 'b'"])
def test_what_is_no_list_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="broken STEP text"):
        parameters(text)


def test_an_entity_that_is_not_there() -> None:
    entities = read_entities(HEAD + "#1=A(#2);" + END)
    with pytest.raises(ValueError, match="where an entity must be"):
        entities.parameters(Reference(2))
