"""The optical setup of an export, without the checks."""

from __future__ import annotations

from pathlib import Path

from tbcad_verify.mesh.mesh import mesh_from_facets
from tbcad_verify.mesh.stl import read_facets
from tbcad_verify.record.export import read_export
from tbcad_verify.run.verify import VerifyOptions
from tbcad_verify.shell.optics import OpticalSetup, pinhole_of, set_up
from tbcad_verify.shell.recover import recover

IN_PROCESS = VerifyOptions(apart=False)  # quicker, and open to monkeypatches


def optical_setup_of(folder: Path) -> OpticalSetup:
    record = read_export(folder)
    meshes = [mesh_from_facets(read_facets(record.folder, part.stl)[0]) for part in record.parts]
    recoveries = [
        recover(mesh, pinhole_of(record, part), record.target_mm / 2)
        for mesh, part in zip(meshes, record.parts, strict=True)
    ]
    return set_up(record, meshes, recoveries)
