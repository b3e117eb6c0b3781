"""The file of a field: what is not whole, or of another capture, is refused."""

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tbcad.errors import InputError, PlausibilityWarning
from tbcad.light.reconstruction.field import (
    LONGEST_LEAP,
    SIDES,
    Field,
    Grid,
    field_bytes,
    field_file,
    field_of,
    light_field_fingerprint,
    read_field,
    resampled,
    wanted_field,
    write_field,
)
from tbcad.light.reconstruction.marching import GLOSSY, MATT
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.types import Bools
from tests.light.viewer.fields import ball, write_ball
from tests.ray_fields import whole_cells

WIDTH = 6.0
masks = st.builds(
    lambda n, seed, share: np.random.default_rng(seed).random((n,) * 3) < share,
    st.integers(2, 7),
    st.integers(0, 10**6),
    st.floats(0, 0.3),
)
quickly = settings(max_examples=40)


def made(columns: int = MATT) -> Field:
    rng = np.random.default_rng(3)
    grid = Grid.about(rng.random((5,) * 3) < 0.1, 12.5)
    values = rng.uniform(-1, 1, (len(grid), columns)).astype(np.float32)
    return Field(grid, values, {"object": "knot", "seed": 3})


WHOLE = field_bytes(made())


@pytest.mark.parametrize("columns", [MATT, GLOSSY])
def test_what_is_written_is_read(tmp_path: Path, columns: int) -> None:
    given_field, path = made(columns), tmp_path / "field.npz"
    write_field(path, given_field)
    found = read_field(path)
    assert (found.grid.n, found.grid.width_mm, found.facts) == (5, 12.5, given_field.facts)
    assert np.array_equal(found.grid.place, given_field.grid.place)
    assert np.array_equal(found.values, given_field.values)
    assert found.order == (columns == GLOSSY)
    assert field_bytes(found) == path.read_bytes()
    empty = Field(Grid.about(np.zeros((4,) * 3, bool), 9.0), np.zeros((0, columns), np.float32))
    write_field(path, empty)
    assert len(read_field(path).grid) == 0


def test_density_is_positive_and_tends_to_its_number() -> None:
    grid = Grid(2, 1.0, np.argwhere(np.ones((2, 2, 2), bool)).astype(np.uint16))
    values = np.zeros((8, MATT), np.float32)
    values[:3, 0] = [-3, 0, 50]
    assert Field(grid, values).density()[:3] == pytest.approx(
        [(-3 + np.sqrt(9.01)) / 2, 0.05, 50.00005], rel=1e-5
    )


def archive(**changes: object) -> bytes:
    """The file with other arrays; None leaves one out."""
    with np.load(io.BytesIO(WHOLE)) as store:
        arrays = {**{name: store[name] for name in store.files}, **changes}
    with io.BytesIO() as buffer:
        np.savez(buffer, **{name: array for name, array in arrays.items() if array is not None})
        return buffer.getvalue()


def bomb() -> bytes:
    """A member that says it unpacks to 5 GB."""
    content = bytearray(WHOLE)
    at = content.index(b"PK\x01\x02") + 24
    content[at : at + 4] = (0xFFFFFFF0).to_bytes(4, "little")
    return bytes(content)


PLACE = made().grid.place
V = len(PLACE)
DAMAGED = {
    "empty": b"",
    "cut off": WHOLE[: len(WHOLE) // 2],
    "another schema": archive(schema=np.array("tbcad-field/9")),
    "no schema": archive(schema=None),
    "NaN": archive(density=np.full(V, np.nan, np.float32)),
    "beyond all densities": archive(density=np.full(V, -1e30, np.float32)),
    "doubles": archive(colour=np.zeros((V, 3))),
    "one density too few": archive(density=np.zeros(V - 1, np.float32)),
    "nodes out of order": archive(node=PLACE[::-1]),
    "a node outside": archive(node=PLACE + np.uint16(4)),
    "nodes without a number": archive(node=np.array(3, np.uint16)),
    "too many nodes": archive(nodes=np.array(10**6)),
    "a fraction of a node": archive(nodes=np.array(5.9)),
    "negative width": archive(capture_mm=np.array(-1.0)),
    "facts that are no JSON": archive(facts=np.array("{")),
    "facts that are a list": archive(facts=np.array(json.dumps([1]))),
    "slopes of too few": archive(slope=np.zeros((V, 3), np.float32)),
    "pickled objects": archive(colour=np.array([{}] * V)),
    "a bomb": bomb(),
}


@pytest.mark.parametrize("kind", DAMAGED)
def test_damaged_files_are_refused_in_one_line(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "field.npz"
    path.write_bytes(DAMAGED[kind])
    with pytest.raises(InputError, match=r"field\.npz.*tbcad reconstruct") as refused:
        read_field(path)
    assert "\n" not in str(refused.value)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "field.npz"):
        with pytest.raises(InputError, match="no such file"):
            read_field(path)


@settings(
    max_examples=300,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
def test_a_changed_byte_is_refused_or_does_not_matter(tmp_path: Path, at: int, by: int) -> None:
    content = bytearray(WHOLE)
    content[at] ^= by
    path = tmp_path / "field.npz"
    path.write_bytes(content)
    try:
        found = read_field(path)
    except InputError:
        return
    assert field_bytes(found) == WHOLE


def changed(source: LightField, camera: str, plane: str) -> LightField:
    """With one value of one pixel a little larger."""
    frame = source.frames[camera]
    values = frame.planes[plane].copy()
    values[128, 90, 1] += 1
    other = replace(frame, planes={**frame.planes, plane: values})
    return replace(source, frames={**source.frames, camera: other})


@pytest.mark.parametrize(
    "change",
    [
        lambda source: changed(source, "b", "colour"),
        lambda source: changed(source, "a", "direction"),
        lambda source: replace(source, capture_mm=59.0),
        lambda source: replace(source, frames={"a": source.frames["a"]}),
    ],
)
def test_each_light_field_has_its_own_fingerprint(
    light_field: LightField, change: Callable[[LightField], LightField]
) -> None:
    assert light_field_fingerprint(change(light_field)) != light_field_fingerprint(light_field)


def test_a_file_has_the_fingerprint_of_what_is_in_it(captured: Path) -> None:
    with LightField.open(captured) as stored:
        inside = LightField.read(captured)
        assert light_field_fingerprint(stored) == light_field_fingerprint(inside)


def test_a_field_is_read_with_its_light_field_only(light_field: LightField, tmp_path: Path) -> None:
    file = write_ball(light_field, tmp_path)
    assert np.array_equal(field_of(file, light_field).values, ball().values)
    with pytest.raises(InputError, match=r"is of another capture, or of an older one: write it"):
        field_of(file, changed(light_field, "b", "colour"))
    write_field(file, ball())
    with pytest.raises(InputError, match="does not say of which light field"):
        field_of(file, light_field)


@pytest.mark.filterwarnings("error")
def test_what_is_used_by_default(light_field: LightField, tmp_path: Path) -> None:
    assert wanted_field(None, tmp_path, light_field) is None
    write_ball(light_field, tmp_path)
    for place in (tmp_path, tmp_path / "lightfield.h5"):
        assert wanted_field(None, place, light_field) is not None
    assert wanted_field("depth", tmp_path, light_field) is None
    assert wanted_field(None, tmp_path / "other.h5", light_field) is None
    assert wanted_field(None, tmp_path, light_field, frame=1) is None
    write_ball(light_field, tmp_path, frame=1)
    assert wanted_field(None, tmp_path, light_field, frame=1) is not None


def test_what_is_of_no_use_is_told_or_refused(light_field: LightField, tmp_path: Path) -> None:
    file = field_file(tmp_path)
    file.write_bytes(b"PK")
    with pytest.warns(PlausibilityWarning, match="it is not used here"):
        assert wanted_field(None, tmp_path, light_field) is None
    with pytest.raises(InputError, match=str(file)):
        wanted_field("field", tmp_path, light_field)


@quickly
@given(masks)
def test_it_has_the_nodes_of_all_cells_with_a_wanted_one(wanted: Bools) -> None:
    grid = Grid.about(wanted, WIDTH)
    expected = np.zeros_like(wanted)
    for x, y, z in np.ndindex(*(np.array(wanted.shape) - 1)):
        if wanted[x : x + 2, y : y + 2, z : z + 2].any():
            expected[x : x + 2, y : y + 2, z : z + 2] = True
    assert np.array_equal(grid.place, np.argwhere(expected))
    assert np.array_equal(grid.row >= 0, expected)
    assert np.array_equal(grid.row[tuple(grid.place.T)], np.arange(len(grid)))
    assert np.array_equal(grid.dense(np.ones(len(grid), np.float32)) > 0, expected)


@quickly
@given(masks)
def test_leaps_are_distances_to_the_nearest_whole_cell(wanted: Bools) -> None:
    grid = Grid.about(wanted, WIDTH)
    whole = np.argwhere(whole_cells(grid))
    for cell in np.ndindex(*grid.leap.shape):
        away = np.abs(whole - cell).max(axis=1).min() if len(whole) else LONGEST_LEAP
        assert grid.leap[cell] == away


@quickly
@given(masks)
def test_neighbours_are_one_node_away(wanted: Bools) -> None:
    grid = Grid.about(wanted, WIDTH)
    rows = {tuple(place): k for k, place in enumerate(grid.place.tolist())}
    for k, place in enumerate(grid.place.tolist()):
        around = [rows.get(tuple(np.add(place, side).tolist()), -1) for side in SIDES]
        assert grid.neighbours[k].tolist() == around


def test_its_cube_is_about_the_origin() -> None:
    grid = Grid(5, WIDTH, np.array([[0, 0, 0], [2, 2, 2], [4, 4, 4]], np.uint16))
    assert grid.points == pytest.approx(np.array([[-3.0] * 3, [0.0] * 3, [3.0] * 3]))
    assert grid.pitch_mm == WIDTH / 4


@pytest.mark.parametrize(("k", "n"), [(2, 9), (9, 4), (20, 33)])
def test_linear_values_stay_linear_on_other_lattices(k: int, n: int) -> None:
    def plane(n: int) -> np.ndarray:
        x, y, z = np.meshgrid(*[np.linspace(-1, 1, n)] * 3, indexing="ij")
        return (1 + x + 2 * y - 3 * z).astype(np.float32)

    assert np.abs(resampled(plane(k), n) - plane(n)).max() < 1e-5
    every = Grid(n, WIDTH, np.argwhere(np.ones((n,) * 3, bool)).astype(np.uint16))
    assert every.dense(every.sampled(plane(k))) == pytest.approx(plane(n), abs=1e-5)
