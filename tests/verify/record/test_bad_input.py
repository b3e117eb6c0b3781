"""What is no export is refused: exit 2, one line that says why, and nothing written."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify import BadExport, main, verify

from tests.verify.optical_setups import IN_PROCESS
from tests.verify.synthetic_export import sign

NAMES = ["design.json", "mirrors.csv", "shell_a.stl", "shell_b.stl"]


def edit(name: str, change: Callable[[dict], None]) -> Callable[[Path], None]:
    def job(folder: Path) -> None:
        value = json.loads((folder / name).read_text())
        change(value)
        (folder / name).write_text(json.dumps(value))

    return job


def text(name: str, old: str, new: str) -> Callable[[Path], None]:
    def job(folder: Path) -> None:
        before = (folder / name).read_text()
        assert old in before
        (folder / name).write_text(before.replace(old, new, 1))

    return job


def put(name: str, change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_bytes(change((folder / name).read_bytes())) and None


def sparse(folder: Path) -> None:
    with (folder / "shell_a.stl").open("wb") as stream:
        stream.truncate(2 * 10**9)


def huge(folder: Path) -> None:
    with (folder / "shell_a.stl").open("wb") as stream:
        stream.truncate(5 * 10**9)


def fifo(folder: Path) -> None:
    (folder / "shell_a.stl").unlink()
    os.mkfifo(folder / "shell_a.stl")


def link_out(folder: Path) -> None:
    outside = folder.parent / "outside.stl"
    (folder / "shell_a.stl").rename(outside)
    (folder / "shell_a.stl").symlink_to(outside)


def as_folder(folder: Path) -> None:
    (folder / "shell_a.stl").unlink()
    (folder / "shell_a.stl").mkdir()


def nan_vertex(data: bytes) -> bytes:
    return data[: 84 + 12] + np.float32(np.nan).tobytes() + data[84 + 16 :]


def first(key: str, value: object) -> Callable[[dict], None]:
    return lambda design: design["cameras"][0].update({key: value})


def part_file(name: str) -> Callable[[Path], None]:
    return edit("design.json", lambda d: d["parts"][0].update(stl=name))


BROKEN = {
    "no design": (lambda f: (f / "design.json").unlink(), "design.json: missing"),
    "no table": (lambda f: (f / "mirrors.csv").unlink(), "mirrors.csv: missing"),
    "no manifest": (lambda f: (f / "manifest.json").unlink(), "manifest.json: missing"),
    "no shell": (lambda f: (f / "shell_b.stl").unlink(), "shell_b.stl: missing"),
    "foreign": (lambda f: (f / "design.json").write_text('{"schema": "x"}'), "schema is x"),
    "schema before": (
        edit("design.json", lambda d: d.update(schema="tbcad-design/1")),
        "schema is tbcad-design/1, this version verifies tbcad-design/2; write the export again",
    ),
    "schema a list": (edit("design.json", lambda d: d.update(schema=[1])), "schema is [1], this"),
    "mirrors elsewhere": (
        edit("design.json", lambda d: d.update(mirrors="../mirrors.csv")),
        "mirrors is ../mirrors.csv, allowed is mirrors.csv",
    ),
    "no spec": (edit("design.json", lambda d: d.pop("spec")), "spec is missing, allowed is an obj"),
    "no object": (lambda f: (f / "design.json").write_text("[]"), "JSON object"),
    "broken JSON": (put("design.json", lambda b: b[: len(b) // 2]), "broken JSON"),
    "deep JSON": (lambda f: (f / "design.json").write_text("[" * 100000), "broken JSON"),
    "not text": (put("design.json", lambda b: b"\xff\xfe" + b), "not UTF-8"),
    "NaN in JSON": (text("design.json", '"target_mm": 40.0', '"target_mm": NaN'), "NaN"),
    "text target": (
        text("design.json", '"target_mm": 40.0', '"target_mm": "40"'),
        "target_mm is 40, allowed is a number",
    ),
    "true target": (
        text("design.json", '"target_mm": 40.0', '"target_mm": true'),
        "target_mm is True, allowed is",
    ),
    "target of thousands of digits": (
        text("design.json", '"target_mm": 40.0', f'"target_mm": {"9" * 5000}'),
        "broken JSON",
    ),
    "no cameras": (
        edit("design.json", lambda d: d.update(cameras=[])),
        "cameras is [], allowed is a list of 1 to 1000",
    ),
    "no parts": (edit("design.json", lambda d: d.update(parts=[])), "parts"),
    "odd parts": (
        edit("design.json", lambda d: d.update(parts=["shell_a"])),
        "parts[0] is shell_a, allowed is an object",
    ),
    "skew axes": (
        edit("design.json", first("forward", [0, 0, 2])),
        "cameras[0] has forward and right",
    ),
    "short vector": (
        edit("design.json", first("forward", [0, 1])),
        "cameras[0].forward is [0, 1], allowed is three numbers",
    ),
    "absurd sensor": (
        edit("design.json", first("width_px", 10**9)),
        "cameras[0].width_px is 1000000000",
    ),
    "big sensor": (
        edit("design.json", lambda d: d["cameras"][0].update(width_px=65536, height_px=65536)),
        "at most",
    ),
    "half a pixel": (edit("design.json", first("width_px", 260.5)), "allowed is a whole number"),
    "absurdly many cameras": (
        edit("design.json", lambda d: d.update(cameras=[1] * 10**6)),
        "cameras is [1, 1, 1, 1,",
    ),
    "cameras alike": (
        edit("design.json", lambda d: d["cameras"].append(d["cameras"][0])),
        "differ",
    ),
    "absolute part": (part_file("/etc/passwd"), "plain file name"),
    "part above": (part_file("../shell_a.stl"), "plain file name"),
    "part named ..": (part_file(".."), "plain file name"),
    "manifest leads out": (
        edit("manifest.json", lambda m: m["files"].update({"../x": {"size": 1, "sha256": ""}})),
        "not a plain file name",
    ),
    "manifest empty": (edit("manifest.json", lambda m: m.update(files={})), "manifest.json"),
    "manifest odd": (
        edit("manifest.json", lambda m: m["files"].update(x=3)),
        "files.x is 3, allowed is",
    ),
    "absurdly many files": (
        edit("manifest.json", lambda m: m.update(files=dict.fromkeys(map(str, range(10**6)), 1))),
        "files lists 1000000; at most 10000 are read",
    ),
    "manifest size": (
        edit("manifest.json", lambda m: m["files"]["mirrors.csv"].update(size="1")),
        "files.mirrors.csv.size is 1, allowed is a whole number",
    ),
    "table without rows": (put("mirrors.csv", lambda b: b.split(b"\n")[0] + b"\n"), "0 rows"),
    "table cut short": (put("mirrors.csv", lambda b: b[:-300]), "truncated"),
    "table empty": (put("mirrors.csv", lambda b: b""), "first line"),
    "table foreign": (put("mirrors.csv", lambda b: b"a,b\n1,2\n"), "first line"),
    "table quoted": (put("mirrors.csv", lambda b: b + b'"a'), "broken CSV"),
    "table nan": (
        text("mirrors.csv", "a0001,a,0.0", "a0001,a,nan"),
        "line 2: ux is nan, allowed is a number",
    ),
    "table word": (
        text("mirrors.csv", "a0001,a,0.0", "a0001,a,left"),
        "line 2: ux is left, allowed is a number",
    ),
    "STL cut short": (put("shell_a.stl", lambda b: b[:-10]), "truncated"),
    "STL too long": (put("shell_a.stl", lambda b: b + b"x"), "truncated or no binary"),
    "STL of no facets": (put("shell_a.stl", lambda b: b[:80] + bytes(4)), "0 facets"),
    "STL empty": (put("shell_a.stl", lambda b: b""), "0 bytes"),
    "STL count lies": (
        put("shell_a.stl", lambda b: b[:80] + b"\xff\xff\xff\xff" + b[84:]),
        "4294967295",
    ),
    "STL in ASCII": (put("shell_a.stl", lambda b: b"solid x\n facet normal 0 0 1\n"), "ASCII"),
    "STL with NaN": (put("shell_a.stl", nan_vertex), "not finite"),
    "STL sparse": (sparse, "truncated"),
    "STL over the limit": (huge, "at most"),
    "STL a pipe": (fifo, "not a regular file"),
    "STL a folder": (as_folder, "not a regular file"),
    "STL a link out": (link_out, "leads out"),
}


@pytest.mark.parametrize("how", BROKEN)
def test_broken_export_is_refused(
    export_folder: Path, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    change, words = BROKEN[how]
    change(export_folder)
    before = {path: path.stat().st_mtime_ns for path in export_folder.parent.rglob("*")}
    assert main([str(export_folder)]) == 2
    out = capsys.readouterr()
    last = [line for line in out.err.splitlines() if not line.startswith("verify: ")]
    assert len(last) == 1
    assert words in last[0]
    assert out.out == ""
    assert {path: path.stat().st_mtime_ns for path in export_folder.parent.rglob("*")} == before


def test_missing_folder_and_file_for_folder(tmp_path: Path) -> None:
    with pytest.raises(BadExport, match="no such folder"):
        verify(tmp_path / "nowhere", options=IN_PROCESS)
    (tmp_path / "file").write_text("x")
    with pytest.raises(BadExport, match="not a folder"):
        verify(tmp_path / "file", options=IN_PROCESS)
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadExport, match=r"design\.json: missing"):
        verify(tmp_path / "empty", options=IN_PROCESS)


def test_link_inside_is_followed(export_folder: Path) -> None:
    (export_folder / "shell_a.stl").rename(export_folder / "real.stl")
    (export_folder / "shell_a.stl").symlink_to("real.stl")
    assert verify(sign(export_folder, NAMES), options=IN_PROCESS).passed


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
