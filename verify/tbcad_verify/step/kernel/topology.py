"""Parts of a shape, as the CAD kernel counts them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_VERTEX
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape, TopTools_IndexedMapOfShape

from tbcad_verify.types import Floats


def each(shape: TopoDS_Shape, kind: Any) -> Iterator[TopoDS_Shape]:
    """All parts of a kind, those of several owners several times."""
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def faces_of(shape: TopoDS_Shape) -> list[TopoDS_Face]:
    """All faces, in the order of the shape."""
    return [TopoDS.Face_s(face) for face in each(shape, TopAbs_FACE)]


def each_once(shape: TopoDS_Shape, kind: Any) -> list[TopoDS_Shape]:
    """All parts of a kind, each once."""
    shapes = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, shapes)
    return [shapes.FindKey(k) for k in range(1, shapes.Extent() + 1)]


def edges_of(shape: TopoDS_Shape) -> list[TopoDS_Edge]:
    """All edges that are curves, each once; a pole is a point."""
    edges = [TopoDS.Edge_s(edge) for edge in each_once(shape, TopAbs_EDGE)]
    return [edge for edge in edges if not BRep_Tool.Degenerated_s(edge)]


def corners_of(shape: TopoDS_Shape) -> Floats:
    """(V, 3) corners of all edges, those of several edges several times, mm."""
    corners = [triple(BRep_Tool.Pnt_s(TopoDS.Vertex_s(one))) for one in each(shape, TopAbs_VERTEX)]
    return np.array(corners, dtype=np.float64).reshape(-1, 3)


def count(shape: TopoDS_Shape, kind: Any) -> int:
    """How many parts of a kind there are."""
    return sum(1 for _ in each(shape, kind))


def open_edges(shape: TopoDS_Shape) -> int:
    """Edges without exactly two sides; a seam has both its own, and a pole is a point."""
    sides = TopTools_IndexedDataMapOfShapeListOfShape()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, sides)
    return sum(
        sides.FindFromIndex(k).Extent() != 2
        and not BRep_Tool.Degenerated_s(TopoDS.Edge_s(sides.FindKey(k)))
        for k in range(1, sides.Extent() + 1)
    )


def triple(vector: Any) -> list[float]:
    """Coordinates of a point or direction of the kernel."""
    return list(vector.Coord())
