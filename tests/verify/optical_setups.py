"""The optical setup of an export, without the checks."""

from __future__ import annotations

from pathlib import Path

from tbcad_verify.mesh.mesh import Mesh, mesh_from_facets
from tbcad_verify.mesh.stl import read_facets
from tbcad_verify.record.export import Export, read_export
from tbcad_verify.run.verify import VerifyOptions
from tbcad_verify.shell.optics import OpticalSetup, pinhole_of, set_up
from tbcad_verify.shell.recover import recover

IN_PROCESS = VerifyOptions(apart=False)  # quicker, and open to monkeypatches


def optical_setup_of(folder: Path) -> OpticalSetup:
    record = read_export(folder)
    return setup_of_meshes(record, meshes_of(record))


def meshes_of(record: Export) -> list[Mesh]:
    return [mesh_from_facets(read_facets(record.folder, part.stl)[0]) for part in record.parts]


def setup_of_meshes(record: Export, meshes: list[Mesh]) -> OpticalSetup:
    """The setup of an export with these meshes in place of its shells'."""
    radius, pairs = record.target_mm / 2, zip(meshes, record.parts, strict=True)
    found = [recover(mesh, pinhole_of(record, part), radius) for mesh, part in pairs]
    return set_up(record, meshes, found)
