"""What is no export is refused: exit 2, one line that says why, and nothing written."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify import BadExport, main, verify

from tests.verify.corpus.broken_files import FILES
from tests.verify.corpus.broken_meshes import MESHES
from tests.verify.corpus.broken_records import RECORDS
from tests.verify.corpus.mutation import Mutation, refused
from tests.verify.corpus.record_changes import JSON, TABLE, Design, as_text, design, manifest
from tests.verify.optical_setups import IN_PROCESS

LONG_NUMBER = b'"target_mm": ' + b"9" * 5000


def camera(key: str, value: object) -> Callable[[Design], None]:
    return lambda record: record["cameras"][0].update({key: value})


BROKEN = (
    *(
        mutation
        for mutation in (*RECORDS, *MESHES, *FILES)
        if mutation.status == 2 and not mutation.during and not re.search("STEP|3MF", mutation.name)
    ),
    refused("schema a list", JSON, design(lambda d: d.update(schema=[1])), "schema is [1], this"),
    refused("no spec", JSON, design(lambda d: d.pop("spec")), "spec is missing, allowed is an obj"),
    refused("no object", JSON, as_text(JSON, lambda _: b"[]"), "JSON object"),
    refused("deep JSON", JSON, as_text(JSON, lambda _: b"[" * 100_000), "broken JSON"),
    refused("NaN in JSON", JSON, design(lambda d: d.update(target_mm=math.nan)), "NaN"),
    refused("true", JSON, design(lambda d: d.update(target_mm=True)), "target_mm is True, allowed"),
    refused(
        "a target of thousands of digits",
        JSON,
        as_text(JSON, lambda data: re.sub(rb'"target_mm": [\d.]+', LONG_NUMBER, data)),
        "broken JSON",
    ),
    refused("no cameras", JSON, design(lambda d: d.update(cameras=[])), "cameras is [], allowed"),
    refused("odd parts", JSON, design(lambda d: d.update(parts=["a"])), "parts[0] is a, allowed"),
    refused(
        "short vector", JSON, design(camera("forward", [0, 1])), "cameras[0].forward is [0, 1]"
    ),
    refused("absurd sensor", JSON, design(camera("width_px", 10**9)), "width_px is 1000000000"),
    refused(
        "big sensor",
        JSON,
        design(lambda d: d["cameras"][0].update(width_px=65536, height_px=65536)),
        "at most",
    ),
    refused("half a pixel", JSON, design(camera("width_px", 260.5)), "allowed is a whole number"),
    refused(
        "absurdly many cameras",
        JSON,
        design(lambda d: d.update(cameras=[1] * 10**6)),
        "cameras is [1, 1, 1, 1,",
    ),
    refused(
        "cameras alike", JSON, design(lambda d: d["cameras"].append(d["cameras"][0])), "differ"
    ),
    refused("part ..", JSON, design(lambda d: d["parts"][0].update(stl="..")), "plain file name"),
    refused(
        "absurdly many files",
        "manifest.json",
        manifest(lambda files: files.update(dict.fromkeys(map(str, range(10**6)), 1))),
        "files lists 1000005; at most 10000 are read",
    ),
    refused(
        "manifest size",
        "manifest.json",
        manifest(lambda files: files["mirrors.csv"].update(size="1")),
        "files.mirrors.csv.size is 1, allowed is a whole number",
    ),
    refused(
        "a table of no rows", TABLE, as_text(TABLE, lambda b: b.split(b"\n")[0] + b"\n"), "0 rows"
    ),
    refused("a foreign table", TABLE, as_text(TABLE, lambda _: b"a,b\n1,2\n"), "first line"),
    refused("a quote in the table", TABLE, as_text(TABLE, lambda b: b + b'"a'), "broken CSV"),
)


def files_of(folder: Path) -> dict[Path, int]:
    return {path: path.lstat().st_mtime_ns for path in folder.parent.rglob("*")}


@pytest.mark.parametrize("mutation", BROKEN, ids=lambda mutation: mutation.name)
def test_broken_export_is_refused(export_folder: Path, mutation: Mutation) -> None:
    words = [*mutation.words, *mutation.job(export_folder)]
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
    manifest(lambda files: files.update({name: {"sha256": "0" * 64, "size": 0}}))(export_folder)
    with pytest.raises(
        BadExport, match=f"^{name}: not a regular file but {told}, yet in the manifest"
    ):
        verify(export_folder, options=IN_PROCESS)


def test_link_inside_is_followed(export_folder: Path) -> None:
    (export_folder / "shell_a.stl").rename(export_folder / "real.stl")
    (export_folder / "shell_a.stl").symlink_to("real.stl")
    assert verify(export_folder, options=IN_PROCESS).passed


def test_bad_arguments_are_bad_input() -> None:
    with pytest.raises(SystemExit) as stop:
        main([])
    assert stop.value.code == 2


def test_a_file_cut_while_it_is_read(export_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tbcad_verify.record import files

    whole = np.fromfile

    def cut(stream, dtype, count):
        return whole(stream, dtype=dtype, count=count - 1)

    monkeypatch.setattr(files.np, "fromfile", cut)
    with pytest.raises(BadExport, match="changed while it was read"):
        verify(export_folder, options=IN_PROCESS)


def test_a_file_that_grows_while_it_is_read(
    export_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tbcad_verify.record import files

    def smaller(handle: int) -> os.stat_result:
        return os.stat_result((0o100644, 0, 0, 1, 0, 0, real(handle).st_size - 50, 0, 0, 0))

    real = os.fstat
    monkeypatch.setattr(files.os, "fstat", smaller)
    with pytest.raises(BadExport, match="changed while it was read"):
        verify(export_folder, options=IN_PROCESS)


def test_a_folder_that_takes_no_verdict(
    export_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (export_folder / "verify.json").mkdir()
    assert main([str(export_folder), "-q"]) == 2
    assert "verify.json cannot be written" in capsys.readouterr().err
    assert [p.name for p in export_folder.iterdir() if p.name.startswith(".")] == []
