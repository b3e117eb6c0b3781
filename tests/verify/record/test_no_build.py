"""A folder that is no build is refused at once, with what it is."""

import os
from pathlib import Path

import pytest
from tbcad_verify.errors import BadExport
from tbcad_verify.record.export import OTHER_RECORDS, read_export
from tbcad_verify.run.verify import verify


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
