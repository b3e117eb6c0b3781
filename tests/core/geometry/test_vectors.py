"""Vectors along the last axis, against numpy's own functions."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm


@pytest.mark.parametrize("shape", [(3,), (1, 3), (2000, 3), (7, 300, 3), (2000, 2), (0, 3)])
@pytest.mark.parametrize("by_columns", [False, True])
def test_lengths_are_numpys_to_the_bit(shape: tuple[int, ...], by_columns: bool) -> None:
    random = np.random.default_rng(5)
    vectors = random.normal(size=shape) * 10 ** random.uniform(-9, 9, size=shape)
    vectors = np.asfortranarray(vectors) if by_columns else vectors
    assert np.array_equal(norm(vectors), np.linalg.norm(vectors, axis=-1))
