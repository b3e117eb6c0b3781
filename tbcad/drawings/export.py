"""Files of a build that drawings need: as they were written, or refused."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tbcad.cad.formats.checked_files import Row
from tbcad.errors import InputError
from tbcad.output.manifest import MANIFEST, read_manifest, written_file
from tbcad.prototype.assembly_steps.machine import AssembledMachine, read_machine
from tbcad.records.design import NAME as DESIGN
from tbcad.records.design import DesignRecord
from tbcad.records.document import Manifest
from tbcad.records.prototype import NAME as PROTOTYPE
from tbcad.records.prototype import PrintedPartRecord

SOLIDS = ("shell_a", "shell_b", "mandrel_a", "mandrel_b")
PROTOTYPE_FILES = (PROTOTYPE, "bom.csv", "balls.csv", "wiring.csv")
AGAIN = "run tbcad build again"


@dataclass(frozen=True)
class DrawnExport:
    """A build that is drawn."""

    folder: Path  # of it
    manifest: Manifest  # its files
    design: DesignRecord  # design.json
    machine: AssembledMachine | None  # its prototype, None where it has none

    @property
    def shells(self) -> list[str]:
        """Names of the shells and of their negatives that it has."""
        return [name for name in SOLIDS if f"{name}.step" in self.manifest.files]

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
        for row in self.machine.bill.rows if self.machine else ():
            if row["part"] == part.listed_name:
                return row
        raise InputError(f"{self.folder / 'bom.csv'} has no {part.listed_name}: {AGAIN}")

    def file(self, name: str) -> Path:
        """A file of the build as it was written. InputError: it is missing, or another."""
        return written_file(self.folder, self.manifest, name, AGAIN)

    def source(self, step: str) -> tuple[str, str]:
        """Two lines of notes: the file of a shape, and the beginning of its SHA-256."""
        digest = self.manifest.files[step].sha256[:12]
        return f"Undimensioned geometry per {step},", f"sha256 {digest}..."


def read_export(folder: Path) -> DrawnExport:
    """The build in a folder. InputError: none, or a file is missing or not as it was written."""
    manifest = read_manifest(folder)
    if manifest is None:
        raise InputError(
            f"{folder / MANIFEST} is missing or no manifest: name a folder that tbcad build wrote"
        )
    prototype = PROTOTYPE in manifest.files
    for name in (DESIGN, *(PROTOTYPE_FILES if prototype else ())):
        written_file(folder, manifest, name, AGAIN)
    machine = read_machine(folder) if prototype else None
    return DrawnExport(folder, manifest, DesignRecord.read(folder / DESIGN), machine)
