"""Counts, measures and faces of a STEP file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.STEPControl import STEPControl_Controller, STEPControl_Reader
from OCP.TopAbs import TopAbs_SHELL, TopAbs_SOLID
from OCP.TopoDS import TopoDS_Shape

from tbcad_verify.step.kernel.measures import measure_face
from tbcad_verify.step.kernel.shapes import box, corners_of, count, faces_of, open_edges

Row = dict[str, Any]

# A file of the kernel's settings, which it finds by its name and a variable of the environment.
REPAIRS = Path(__file__).with_name("tbcad_verify_repairs")
MAXIMUM = 1  # of all tolerances: a mode of the kernel


def read_solid(path: Path) -> Row:
    """Counts, measures and faces of a STEP file, as plain numbers and texts; mm.

    ValueError: the kernel cannot read it, or finds no shape in it.
    """
    shape = transferred(path)
    corners = corners_of(shape)
    origin = corners.mean(axis=0)
    gap = ShapeAnalysis_ShapeTolerance().Tolerance(shape, MAXIMUM)
    measured = [measure_face(face, origin, gap) for face in faces_of(shape)]
    volume, *moment = np.sum([enclosed for _, enclosed in measured], axis=0).tolist()
    return {
        "solids": count(shape, TopAbs_SOLID),
        "shells": count(shape, TopAbs_SHELL),
        "open_edges": open_edges(shape),
        "valid": bool(BRepCheck_Analyzer(shape).IsValid()),
        "gap": gap,
        "volume": volume,
        "centroid": (origin + np.divide(moment, volume)).tolist(),
        "box": box(shape, corners),
        "faces": [row for row, _ in measured],
    }


def transferred(path: Path) -> TopoDS_Shape:
    """The shape in a file. ValueError: the kernel cannot read it, or finds no shape in it."""
    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Alarm)
    os.environ[f"CSF_{REPAIRS.name}Defaults"] = str(REPAIRS.parent)
    STEPControl_Controller.Init_s()
    Interface_Static.SetCVal_s("read.step.resource.name", REPAIRS.name)
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        raise ValueError("the kernel cannot read it as STEP")
    if reader.TransferRoots() < 1:
        raise ValueError("the kernel finds no shape in it")
    return reader.OneShape()
