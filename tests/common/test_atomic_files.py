"""Files that are replaced together."""

from pathlib import Path

import pytest

from tbcad.common.atomic_files import replace_files
from tbcad.errors import InputError
from tests.exported_files import contents


def test_files_are_replaced_and_others_left_alone(tmp_path: Path) -> None:
    for name in ("a", "other"):
        (tmp_path / name).write_bytes(name.encode())
    paths = replace_files(tmp_path, {"a": b"new", "b": b"more"})
    assert paths == [tmp_path / "a", tmp_path / "b"]
    assert contents(tmp_path) == {"a": b"new", "b": b"more", "other": b"other"}


def test_no_file_is_replaced_before_all_are_written(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"old")
    with pytest.raises(InputError, match=r"cannot be written: .*: choose another folder"):
        replace_files(tmp_path, {"a": b"new", "no/such/folder": b""})
    assert contents(tmp_path) == {"a": b"old"}
    with pytest.raises(InputError, match="cannot be written: No such file or directory"):
        replace_files(tmp_path / "absent", {"a": b""})
