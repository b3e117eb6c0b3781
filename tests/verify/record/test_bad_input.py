"""What is no export is refused: exit 2, one line that says why, and nothing written."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tbcad_verify import BadExport, main, verify
from tbcad_verify.record import files
from tbcad_verify.record.export import OTHER_RECORDS, read_export

from tests.verify.corpus.broken_files import FILES
from tests.verify.corpus.broken_meshes import MESHES
from tests.verify.corpus.broken_records import JSON, MANIFEST, RECORDS, TABLE
from tests.verify.corpus.mutation import Mutation, as_bytes, at, refusing
from tests.verify.optical_setups import IN_PROCESS

pytestmark = pytest.mark.usefixtures("standing")

BIG = {"width_px": 65536, "height_px": 65536}
LONG_NUMBER = b'"target_mm": ' + b"9" * 5000


BROKEN = (
    *(
        mutation
        for mutation in (*RECORDS, *MESHES, *FILES)
        if mutation.status == 2
        and not mutation.during
        and not re.search("STEP|3MF|step|3mf", mutation.name)
    ),
    *refusing(
        JSON,
        ("schema a list", at("schema", [1]), "schema is [1], this"),
        ("no spec", at("spec"), "spec is missing"),
        ("no object", as_bytes(JSON, lambda _: b"[]"), "JSON object"),
        ("deep", as_bytes(JSON, lambda _: b"[" * 100_000), "broken JSON"),
        ("NaN", at("target_mm", math.nan), "NaN"),
        ("true", at("target_mm", True), "target_mm is True: it should"),
        (
            "a target of thousands of digits",
            as_bytes(JSON, lambda data: re.sub(rb'"target_mm": [\d.]+', LONG_NUMBER, data)),
            "broken JSON",
        ),
        ("short vector", at("cameras/0/forward", [0, 1]), "cameras[0].forward is [0, 1]"),
        ("absurd sensor", at("cameras/0/width_px", 10**9), "width_px is 1000000000"),
        ("big sensor", at("cameras/0", lambda one: one | BIG), "at most"),
        ("a view that fits", at("spec/camera/hfov_deg", "fit"), "spec.camera.hfov_deg is fit: "),
        ("too fine a polyhedron", at("spec/optics/n", 61), "spec.optics.n is 61: "),
        ("half a pixel", at("cameras/0/width_px", 260.5), "it should be a valid integer"),
        ("absurdly many cameras", at("cameras", [1] * 10**6), "cameras is [1, 1, 1, 1,"),
        ("cameras alike", at("cameras", lambda some: [*some, some[0]]), "differ"),
    ),
    *refusing(
        "manifest.json",
        (
            "absurdly many files",
            at("files", lambda some: some | dict.fromkeys(map(str, range(10**5)), 1), MANIFEST),
            "files lists 100005; at most 10000 are read",
        ),
    ),
    *refusing(
        TABLE,
        ("no rows", as_bytes(TABLE, lambda b: b.split(b"\n")[0] + b"\n"), "0 rows"),
        ("foreign", as_bytes(TABLE, lambda _: b"a,b\n1,2\n"), "first line"),
        ("a quote", as_bytes(TABLE, lambda b: b + b'"a'), "broken CSV"),
    ),
)


def files_of(folder: Path) -> dict[Path, int]:
    return {path: path.lstat().st_mtime_ns for path in folder.parent.rglob("*")}


@pytest.mark.parametrize("mutation", BROKEN, ids=str)
def test_broken_export_is_refused(export_folder: Path, mutation: Mutation) -> None:
    words = [*mutation.words, *(mutation.job(export_folder) or ())]
    before = files_of(export_folder)
    with pytest.raises(BadExport) as caught:
        verify(export_folder, options=IN_PROCESS)
    assert "\n" not in str(caught.value)
    assert [word for word in words if word not in str(caught.value)] == []
    assert files_of(export_folder) == before


def test_the_command_refuses_in_one_line(
    export_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (export_folder / "shell_b.stl").unlink()
    before = files_of(export_folder)
    assert main([str(export_folder)]) == 2
    out = capsys.readouterr()
    (last,) = [line for line in out.err.splitlines() if not line.startswith("[")]
    assert "shell_b.stl: missing" in last
    assert out.out == ""
    assert files_of(export_folder) == before


@pytest.mark.parametrize(("kind", "told"), [("folder", "a folder"), ("pipe", "a pipe or device")])
@pytest.mark.parametrize("name", ["mine", "shell_a.stl"])
def test_what_is_no_file_in_a_manifest_is_refused_as_such(
    export_folder: Path, kind: str, told: str, name: str
) -> None:
    """A pipe would be waited for, and a folder's size is no sign that it changed."""
    path = export_folder / name
    path.unlink(missing_ok=True)
    path.mkdir() if kind == "folder" else os.mkfifo(path)
    at(f"files/{name}", {"sha256": "0" * 64, "size": 0}, MANIFEST)(export_folder)
    with pytest.raises(
        BadExport, match=f"^{name}: not a regular file but {told}, yet in the manifest"
    ):
        verify(export_folder, options=IN_PROCESS)


def test_bad_arguments_are_bad_input() -> None:
    with pytest.raises(SystemExit) as stop:
        main([])
    assert stop.value.code == 2


def cut(stream: Any, dtype: Any, count: int) -> np.ndarray:
    return WHOLE(stream, dtype=dtype, count=count - 1)


def smaller(handle: int) -> os.stat_result:
    return os.stat_result((0o100644, 0, 0, 1, 0, 0, STAT(handle).st_size - 50, 0, 0, 0))


WHOLE, STAT = np.fromfile, os.fstat


@pytest.mark.parametrize(
    ("module", "name", "other"), [(files.np, "fromfile", cut), (files.os, "fstat", smaller)]
)
def test_a_file_that_is_cut_or_grows_while_it_is_read(
    export_folder: Path, monkeypatch: pytest.MonkeyPatch, module: Any, name: str, other: Any
) -> None:
    monkeypatch.setattr(module, name, other)
    with pytest.raises(BadExport, match="changed while it was read"):
        verify(export_folder, options=IN_PROCESS)


def test_a_folder_that_takes_no_verdict(
    export_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (export_folder / "verify.json").mkdir()
    assert main([str(export_folder), "-q"]) == 2
    assert "verify.json cannot be written" in capsys.readouterr().err
    assert [p.name for p in export_folder.iterdir() if p.name.startswith(".")] == []


@pytest.mark.parametrize("read", [verify, read_export])
@pytest.mark.parametrize("name", [*OTHER_RECORDS, "deep"])
def test_is_refused_without_a_walk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, read: object
) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / name).touch()
    if name != "deep":
        (tmp_path / "manifest.json").touch()

    def walk(*_: object) -> None:
        pytest.fail("the folder was walked")

    monkeypatch.setattr(os, "walk", walk)
    words = OTHER_RECORDS.get(name, "a folder without design.json and manifest.json")
    assert callable(read)
    with pytest.raises(BadExport, match=f"{tmp_path} is {words}, no build: give the folder"):
        read(tmp_path)
