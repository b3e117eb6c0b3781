"""Lists of figures in a 3MF: nothing else is in them."""

from __future__ import annotations

import numpy as np
import pytest
from tbcad_verify.mesh.threemf import _figures

TRIANGLES = b"".join(b'\n\t<triangle v1="%d" v2="7" v3="10" />' % k for k in range(9)) + b"\n"


def test_figures_of_all_items() -> None:
    expected = [[k, 7, 10] for k in range(9)]
    for text in (TRIANGLES, TRIANGLES.replace(b" />", b"/>", 3)):
        assert np.array_equal(_figures(text, "triangles", np.int64), expected)


@pytest.mark.parametrize("count", [1, 9])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        *((b' v3="10"', new) for new in (b"", b' v3="10" pid="4"', b' v3="10 3"', b' v3=""')),
        *((b' v3="10"', new) for new in (b' v3="1e1"', b' v3="-1"', b' v3="1.5"', b" v3='10'")),
        (b"v1=", b"v2="),
        *((b"<triangle", new) for new in (b"<!-- --><triangle", b"<quad", b"=<triangle")),
        *((b"/>", new) for new in (b"></triangle>", b"><item /></triangle>", b"/>5")),
    ],
)
def test_anything_else_is_refused(old: bytes, new: bytes, count: int) -> None:
    with pytest.raises(ValueError, match="list of triangles"):
        _figures(TRIANGLES.replace(old, new, count), "triangles", np.int64)
