"""Dimensions of a DXF: each says what is measured between its points, or is a fault."""

from __future__ import annotations

import io
from typing import Any

import pytest
from ezdxf.document import Drawing
from tbcad_verify.prototype.flat_drawing import read_dxf
from tbcad_verify.report.checks import Unknown

STYLE = "Standard"


def drawing(*add: Any) -> str:
    """A DXF with dimensions that ezdxf itself draws, their pictures as plain texts."""
    document = Drawing.new("R2010")
    for one in add:
        one(document)
    text = io.StringIO()
    document.write(text)
    return text.getvalue()


def picture(document: Drawing, dimension: Any, *words: str) -> None:
    block = document.blocks.new_anonymous_block(type_char="D")
    for word in words:
        block.add_text(word)
    dimension.dxf.geometry = block.name


def linear(form: str, *words: str, angle: float = 0.0, dimtype: int | None = None) -> Any:
    """Between (1, 2) and (21, 12.5): 20 mm across, 10.5 upward."""

    def add(document: Drawing) -> None:
        one = document.modelspace().add_linear_dim(
            (0, -9), (1, 2), (21, 12.5), angle=angle, text=form, dimstyle=STYLE
        )
        if dimtype is not None:
            one.dimension.dxf.dimtype = dimtype
        picture(document, one.dimension, *words)

    return add


def diameter(form: str, *words: str) -> Any:
    """Of 8 mm."""

    def add(document: Drawing) -> None:
        one = document.modelspace().add_diameter_dim_2p((4, 0), (-4, 0), dimstyle=STYLE)
        one.dimension.dxf.text = form
        picture(document, one.dimension, *words)

    return add


def ordinate(form: str, *words: str, x: bool = True) -> Any:
    """Of (-7, 3) from (1, 1): 8 mm across, 2 upward."""

    def add(document: Drawing) -> None:
        one = document.modelspace().add_ordinate_dim(
            (-7, 3), (0, -5), int(x), origin=(1, 1), text=form, dimstyle=STYLE
        )
        picture(document, one.dimension, *words)

    return add


@pytest.mark.parametrize(
    "add",
    [
        linear("<>", "20"),
        linear("(<>)", "(20.0)"),
        linear("<>", "10.5", angle=90.0),
        linear("", "20"),
        linear("20", "20"),
        linear("<>", "19.9999996"),
        diameter("4 x <> on Ø40", "4 x Ø8 on Ø40"),
        ordinate("-<>", "-8"),
        ordinate("<>", "2.00", x=False),
    ],
)
def test_what_is_measured_may_be_said(add: Any) -> None:
    flat = read_dxf(drawing(add))
    assert [*flat.dimension_faults()] == []
    assert sum(flat.texts.values()) == 1


@pytest.mark.parametrize(
    ("add", "words"),
    [
        (linear("<>", "20.1"), "says 20.1 where 20.000 mm are drawn"),
        (linear("<>", "20.5"), "says 20.5"),
        (linear("<>", "20", angle=90.0), "where 10.500 mm"),
        (linear("21", "21"), "says 21"),
        (linear("20", "21"), "says 21"),
        (linear("<>", "(20)"), "says (20)"),
        (linear("<>", "wide"), "says wide"),
        (linear("<>"), "not one text"),
        (linear("<>", "20", "20"), "not one text"),
        (linear("<>", "20", dimtype=2), "no known kind"),
        (diameter("4 x <>", "8 x Ø4"), "says 8 x Ø4 where 8.000"),
        (diameter("<>", "8"), "says 8 where"),
        (ordinate("<>", "8", x=False), "where 2.000 mm"),
    ],
)
def test_anything_else_is_a_fault(add: Any, words: str) -> None:
    (fault,) = read_dxf(drawing(add)).dimension_faults()
    assert words in fault


def test_a_drawing_without_dimensions_is_at_fault() -> None:
    assert [*read_dxf(drawing()).dimension_faults()] == ["it has no dimension"]


def test_too_many_dimensions_are_not_read() -> None:
    with pytest.raises(Unknown, match="1001 dimensions"):
        read_dxf(drawing(*1001 * [linear("<>", "20")]))
