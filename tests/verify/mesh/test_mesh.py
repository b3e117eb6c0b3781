"""Closed forms and known faults: boxes, not mirrors."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from tbcad_verify.mesh.mesh import Topology, examine_topology, join_meshes, mesh_from_facets
from tbcad_verify.mesh.stl import Facets, parse
from tbcad_verify.record.files import FileBytes

from tests.verify.synthetic_export import stl

BOX = trimesh.creation.box((2, 3, 5))


def facets(triangles: np.ndarray) -> Facets:
    data = np.frombuffer(stl(np.asarray(triangles, np.float32)), np.uint8)
    return parse(FileBytes("x.stl", data, ""))


def found(triangles: np.ndarray) -> Topology:
    one = facets(triangles)
    return examine_topology(mesh_from_facets(one), one)


def test_a_box_is_a_solid() -> None:
    box = found(BOX.triangles)
    assert box == Topology(0, 0, 0, 0, 0, 0, 1, box.volume, "NoError")
    assert box.volume == pytest.approx(30)


TURNED = BOX.triangles.copy()
TURNED[0] = TURNED[0][::-1]
LINES = np.array([[[0, 0, 0], [1, 1, 1], [2, 2, 2]], [[0, 0, 0], [0, 0, 0], [1, 0, 0]]])


@pytest.mark.parametrize(
    ("triangles", "name", "count"),
    [
        (BOX.triangles[1:], "open_edges", 3),
        (TURNED, "turned_edges", 3),
        (np.vstack([BOX.triangles, BOX.triangles + 10]), "components", 2),
        (np.vstack([BOX.triangles, BOX.triangles + np.array([2, 3, 0])]), "crowded_edges", 1),
        (np.vstack([BOX.triangles[:1], BOX.triangles[:1, ::-1]]), "duplicate", 3),
        (LINES, "degenerate", 2),
    ],
    ids=["a hole", "a facet turned", "two pieces", "they touch", "a facet and its back", "no area"],
)
def test_faults_are_counted(triangles: np.ndarray, name: str, count: int) -> None:
    topology = found(triangles)
    assert getattr(topology, name) == count
    assert (topology.status != "NoError") or name != "open_edges"


def test_inside_out() -> None:
    assert found(BOX.triangles[:, ::-1]).volume == pytest.approx(-30)


def test_stored_normals_that_lie_are_counted() -> None:
    one = facets(BOX.triangles)
    lying = Facets(one.name, -one.normals, one.corners)
    assert examine_topology(mesh_from_facets(lying), lying).stored_normals == 12
    silent = Facets(one.name, 0 * one.normals, one.corners)
    assert examine_topology(mesh_from_facets(silent), silent).stored_normals == 0


def test_minus_zero_is_zero() -> None:
    box = (BOX.triangles + np.array([1, 0, 0])).astype(np.float32)
    box[box == 0] = np.where(np.arange((box == 0).sum()) % 2, -0.0, 0.0)
    assert len(mesh_from_facets(facets(box)).points) == 8


def test_merging_equals_numpys_unique_rows() -> None:
    rng = np.random.default_rng(1)
    triangles = rng.integers(0, 4, (500, 3, 3)).astype(np.float32)
    mesh = mesh_from_facets(facets(triangles))
    assert len(mesh.points) == len(np.unique(triangles.reshape(-1, 3), axis=0))
    np.testing.assert_array_equal(mesh.points[mesh.faces], triangles)


def test_twins_lead_back() -> None:
    mesh = mesh_from_facets(facets(BOX.triangles))
    np.testing.assert_array_equal(mesh.twin[mesh.twin], np.arange(36))
    start, end = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    np.testing.assert_array_equal(start[mesh.twin], end)


def test_joined_meshes_keep_to_themselves() -> None:
    one = mesh_from_facets(facets(BOX.triangles))
    two = join_meshes([one, mesh_from_facets(facets(BOX.triangles + 10))])
    np.testing.assert_array_equal(two.twin[36:] - 36, one.twin)
    np.testing.assert_array_equal(two.points[two.faces[12:]], BOX.triangles + 10)
