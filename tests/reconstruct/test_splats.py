"""Splats of a field, with the colours and opacities that the paper's program would compute."""

import numpy as np
import pytest

from tbcad.reconstruct.field import Field
from tbcad.reconstruct.marching import GLOSSY
from tbcad.reconstruct.splats import SIZE, THICKNESS, splats_file
from tests.reconstruct.balls import BELOW, RADIUS, made_of, nothing


def read(content: bytes) -> dict[str, np.ndarray]:
    head, rest = content.split(b"end_header\n", 1)
    names = [line.split()[-1] for line in head.decode().splitlines() if "property" in line]
    rows = np.frombuffer(rest, dtype="<f4").reshape(-1, len(names))
    assert f"element vertex {len(rows)}".encode() in head
    return dict(zip(names, rows.T, strict=True))


def glossy() -> Field:
    made = made_of(lambda at: BELOW + 8 * (RADIUS - np.linalg.norm(at, axis=1)), GLOSSY)
    made.values[:, 4:] = np.linspace(-0.2, 0.2, 9)
    return made


def test_the_splats_are_the_dense_nodes() -> None:
    made = glossy()
    found, pitch = read(splats_file(made)), made.grid.pitch_mm
    opacity = 1 - np.exp(-THICKNESS * pitch * made.density())
    kept = opacity > 0.01
    places = np.stack([found[axis] for axis in "xyz"], axis=1)
    assert places == pytest.approx(made.grid.points[kept], abs=1e-5)
    assert 1 / (1 + np.exp(-found["opacity"])) == pytest.approx(
        np.minimum(opacity[kept], 0.99), abs=1e-4
    )
    assert np.exp(found["scale_1"]) == pytest.approx(SIZE * pitch)
    assert (found["rot_0"] == 1).all()


def test_their_colours_in_a_direction_are_the_fields() -> None:
    """Kerbl and others, forward.cu, computeColorFromSH, of degree 1."""
    made = glossy()
    found = read(splats_file(made))
    x, y, z = np.array([0.48, -0.6, 0.64])
    for k in range(3):
        first, second, third = (found[f"f_rest_{3 * k + j}"] for j in range(3))
        linear = -y * first + z * second - x * third
        shown = 0.28209479 * found[f"f_dc_{k}"] + 0.48860251 * linear + 0.5
        slopes = made.values[0, 4 + 3 * k : 7 + 3 * k]
        assert shown == pytest.approx(made.values[0, 1 + k] + slopes @ (x, y, z), abs=1e-5)


def test_without_view_dependence_there_is_no_degree_1_and_of_nothing_no_splat() -> None:
    found = read(splats_file(nothing()))
    assert "f_rest_0" not in found
    assert len(found["x"]) == 0
