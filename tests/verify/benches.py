"""An export on the optical bench, without the checks."""

from __future__ import annotations

from pathlib import Path

from tbcad_verify.mesh.mesh import mesh_from_facets
from tbcad_verify.mesh.stl import parse
from tbcad_verify.record.export import read_export
from tbcad_verify.record.files import read
from tbcad_verify.run.verify import VerifyOptions
from tbcad_verify.shell.optics import OpticalSetup, pinhole_of, set_up
from tbcad_verify.shell.recover import recover

HERE = VerifyOptions(apart=False)  # in this process: quicker, and open to monkeypatches


def bench_of(folder: Path) -> OpticalSetup:
    record = read_export(folder)
    meshes = [mesh_from_facets(parse(read(record.folder, part.stl))) for part in record.parts]
    found = [
        recover(mesh, pinhole_of(record, part), record.target_mm / 2)
        for mesh, part in zip(meshes, record.parts, strict=True)
    ]
    return set_up(record, meshes, found)
