"""What drawings take from an export: files as they were written, or refused."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tbcad.cad.formats.checked_files import Row
from tbcad.errors import InputError
from tbcad.output.manifest import MANIFEST, is_listed, read_manifest
from tbcad.prototype.assembly_steps.machine import AssembledMachine, read_machine
from tbcad.records.design import NAME as DESIGN
from tbcad.records.design import DesignRecord
from tbcad.records.document import Manifest
from tbcad.records.prototype import NAME as PROTOTYPE
from tbcad.records.prototype import PrintedPartRecord

SHELLS = ("shell_a", "shell_b")
MANDRELS = ("mandrel_a", "mandrel_b")
PROTOTYPE_FILES = (PROTOTYPE, "bom.csv", "balls.csv", "wiring.csv")


@dataclass(frozen=True)
class DrawnExport:
    """An export that is drawn."""

    folder: Path  # of it
    manifest: Manifest  # its files
    design: DesignRecord  # design.json
    machine: AssembledMachine | None  # its prototype, None where it has none
    shells: tuple[str, ...]  # names of the shells that it has

    @property
    def mandrels(self) -> tuple[str, ...]:
        """Names of the shells' negatives that it has."""
        return tuple(name for name in MANDRELS if f"{name}.step" in self.manifest.files)

    @property
    def title(self) -> str:
        """Name of the design and its subdivision."""
        return f"{self.design.spec.name}, n = {self.design.spec.optics.n}"

    @property
    def parts(self) -> Mapping[str, PrintedPartRecord]:
        """Records of printed parts by name."""
        return {one.name: one for one in self.machine.record.parts} if self.machine else {}

    def row(self, part: PrintedPartRecord) -> Row:
        """A printed part's row in the parts list. InputError: it has none."""
        name = part.listed_name
        rows = self.machine.rows if self.machine else ()
        row = next((one for one in rows if one["part"] == name), None)
        if row is None:
            raise InputError(f"{self.folder / 'bom.csv'} has no {name}: build the export again")
        return row

    def file(self, name: str) -> Path:
        """A file of the export as it was written. InputError: it is missing, or another."""
        return _written(self.folder, self.manifest, name)

    def digest(self, name: str) -> str:
        """The beginning of a file's SHA-256."""
        return self.manifest.files[name].sha256[:12]


def read_export(folder: Path) -> DrawnExport:
    """The export in a folder.

    InputError: there is none, or a file is missing or not as it was written.
    """
    manifest = read_manifest(folder)
    if manifest is None:
        raise InputError(
            f"{folder / MANIFEST} is missing or no manifest: name a folder that tbcad build wrote"
        )
    shells = tuple(name for name in SHELLS if f"{name}.step" in manifest.files)
    design = DesignRecord.read(_written(folder, manifest, DESIGN))
    if PROTOTYPE not in manifest.files:
        return DrawnExport(folder, manifest, design, None, shells)
    for name in PROTOTYPE_FILES:
        _written(folder, manifest, name)
    return DrawnExport(folder, manifest, design, read_machine(folder), shells)


def _written(folder: Path, manifest: Manifest, name: str) -> Path:
    """A file as its manifest has it."""
    path = folder / name
    if not path.is_file():
        raise InputError(f"{path} is missing: build the export again")
    if not is_listed(path, manifest.files.get(name)):
        raise InputError(
            f"{path} is not as tbcad wrote it (cut off, or changed since): build the export again"
        )
    return path
