"""Every field of the files of an export, found in the files themselves."""

from __future__ import annotations

import csv
import json
import re
import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ezdxf

from tests.verify.synthetic_export import FACET

NUMBERED = re.compile(r"(?<=[a-z])_[0-9]+")
ENTITY = re.compile(r"#\d+\s*=\s*\(?\s*([A-Z][A-Z_0-9]*)\s*\(")
# Objects whose keys are data.
MAPS = {"files", "versions", "totals.bought_price", "totals.filament_price"}


def json_fields(value: Any, path: str = "") -> Iterator[str]:
    """Paths of all values: keys joined by points, [] for the items of a list."""
    if isinstance(value, dict):
        for key, inner in value.items():
            name = "*" if path in MAPS else key
            yield from json_fields(inner, f"{path}.{name}".strip("."))
    elif isinstance(value, list) and value:
        for inner in value:
            yield from json_fields(inner, f"{path}[]")
    else:
        yield path


def read_json_fields(path: Path) -> Iterator[str]:
    return json_fields(json.loads(path.read_text(encoding="utf-8")))


def columns(path: Path) -> list[str]:
    with path.open(newline="", encoding="utf-8") as file:
        return next(csv.reader(file))


def entities(path: Path) -> set[str]:
    """Kinds of entities of a STEP file, and the statements of its head."""
    text = path.read_text(encoding="ascii")
    head = re.findall(r"^(FILE_[A-Z]+)\(", text, re.M)
    return {*ENTITY.findall(text), *head}


def elements(path: Path) -> set[str]:
    """Elements and attributes of a 3MF's members."""
    found = set()
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            for element in ElementTree.fromstring(archive.read(name)).iter():
                tag = element.tag.rpartition("}")[2]
                found |= {tag, *(f"{tag}@{key.rpartition('}')[2]}" for key in element.attrib)}
    return found


def facets(path: Path) -> list[str]:
    return ["header", "count", *(FACET.names or ())]


def words(path: Path) -> set[str]:
    """Words of a program, and its comments without their numbers and names."""
    found = set()
    for line in path.read_text(encoding="ascii").splitlines():
        command, _, comment = line.partition("(")
        found |= {re.sub(r"(?<=[XAFP])-?[\d.]+", "", word) for word in command.split()}
        if comment:
            found.add(f"({re.sub(r'-?[0-9][0-9.]*', 'N', comment)}")
    return found


def forms(path: Path) -> set[str]:
    """Lines without their numbers."""
    lines = path.read_text(encoding="ascii").splitlines()
    return {re.sub(r"-?[0-9][0-9.]*", "N", line) for line in lines}


def scene(path: Path) -> set[str]:
    """Paths of the JSON in a GLB."""
    data = path.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    return set(json_fields(json.loads(data[20 : 20 + size])))


def drawn(path: Path) -> set[str]:
    """Kinds of entities of a DXF, each with its layers."""
    entities = ezdxf.filemanagement.readfile(path).modelspace()
    return {f"{one.dxftype()} {one.dxf.layer}" for one in entities}


def operators(path: Path) -> set[str]:
    """Kinds of objects and of operators in a PDF's page."""
    data = path.read_bytes()
    texts = {"Tj"} if b") Tj" in data else set()
    return {match.decode() for match in re.findall(rb"/Type(/[A-Za-z]+)", data)} | texts


READERS: dict[str, Callable[[Path], Any]] = {
    ".json": read_json_fields,
    ".csv": columns,
    ".step": entities,
    ".3mf": elements,
    ".stl": facets,
    ".nc": words,
    ".txt": forms,
    ".gcode": forms,
    ".cfg": forms,
    ".glb": scene,
    ".dxf": drawn,
    ".pdf": operators,
}
# Files that are unlike others of their kind.
NAMED = {".json", ".csv", ".nc", ".txt", ".gcode", ".cfg", ".glb"}
# The verification's own figures, and the page that shows them.
WRITTEN_AFTERWARDS = {"verify.json", "report.html"}


def fields(folder: Path) -> dict[str, set[str]]:
    """Fields of all files of an export; files that are alike count as one, such as *.stl."""
    found: dict[str, set[str]] = {}
    for path in sorted(folder.iterdir()):
        if path.name not in WRITTEN_AFTERWARDS:
            kind = path.suffix
            name = path.name if kind in NAMED or path.name == "prototype.step" else f"*{kind}"
            found.setdefault(name, set()).update(READERS[kind](path))
    return found
