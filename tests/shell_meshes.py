"""Exports of shells: the record with both meshes, or with both solids."""

from pathlib import Path

from tbcad.cad.formats.mesh_files import write_stl
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.mirrors.record import write_record
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.shell.files import write_shell_solids
from tbcad.shell.halves import camera_a_mesh, shell_envelope


def export_with_meshes(folder: Path, made: MirrorDesign) -> ExportedDesign:
    """Write the record of a design, with both shells as STL beside it, and read it."""
    write_record(folder, made, shells=True)
    mesh = camera_a_mesh(made)
    write_stl(folder / "shell_a.stl", mesh)
    write_stl(folder / "shell_b.stl", mesh.mirrored())
    return read_export(folder)


def export_with_solids(folder: Path, made: MirrorDesign) -> Path:
    """Write the record of a design, with both shells as STEP beside it."""
    write_record(folder, made, shells=True)
    write_shell_solids(made, shell_envelope(made), folder, lambda _: None)
    return folder
