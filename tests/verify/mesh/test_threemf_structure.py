"""A list of items by the count of all parts."""

from __future__ import annotations

import pytest
from tbcad_verify.mesh.threemf import are_counted

VERTEX = b"vertex", (b"x", b"y", b"z")
TRIANGLE = b"triangle", (b"v1", b"v2", b"v3")
VERTICES = b"".join(b'\n\t<vertex x="%d.5" y="-%d" z="0.25" />' % (k, k) for k in range(9)) + b"\n"
TRIANGLES = b"".join(b'\n\t<triangle v1="%d" v2="7" v3="10" />' % k for k in range(9)) + b"\n"


@pytest.mark.parametrize(("text", "item"), [(VERTICES, VERTEX), (TRIANGLES, TRIANGLE)])
def test_items_differ_in_digits_and_blanks(
    text: bytes, item: tuple[bytes, tuple[bytes, ...]]
) -> None:
    assert are_counted(text, *item)
    assert are_counted(text.replace(b" />", b"/>", 3), *item)


@pytest.mark.parametrize("count", [1, 9])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b' v3="10"', b""),
        (b"v1=", b"v2="),
        (b' v3="10"', b' v3="10" pid="4"'),
        (b"<triangle", b"<!-- --><triangle"),
        (b"<triangle", b"<quad"),
        (b"/>", b"></triangle>"),
        (b"/>", b"><item /></triangle>"),
    ],
)
def test_other_items_are_refused(old: bytes, new: bytes, count: int) -> None:
    assert not are_counted(TRIANGLES.replace(old, new, count), *TRIANGLE)


def test_text_between_items_is_refused() -> None:
    for text in (VERTICES + b"<vertex", VERTICES.replace(b"\n\t<", b"=<", 1)):
        assert not are_counted(text, *VERTEX)
