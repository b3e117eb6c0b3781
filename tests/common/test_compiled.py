"""Kept machine code is that of the present code, of all modules that a loop follows from."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tbcad.common import compiled

CALLED = """
from tbcad.common.compiled import compiled_part

FACTOR = {factor}

@compiled_part
def raised(x):
    return x + {more}
"""
CALLING = """
from called import FACTOR, raised
from tbcad.common.compiled import compiled_loop

@compiled_loop
def loop(x):
    return FACTOR * raised(x)
"""


@pytest.fixture
def changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[float]]:
    """Change the called module, and give what a new process would: the result, and whether by
    kept code."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path / "machine code"))
    (tmp_path / "calling.py").write_text(CALLING)

    def result(factor: int = 2, more: int = 1) -> list[float]:
        (tmp_path / "called.py").write_text(CALLED.format(factor=factor, more=more))
        for name in ("calling", "called"):
            monkeypatch.delitem(sys.modules, name, raising=False)
        compiled._content.cache_clear()
        sys.dont_write_bytecode, before = True, sys.dont_write_bytecode
        import importlib

        importlib.invalidate_caches()
        loop = importlib.import_module("calling").loop
        sys.dont_write_bytecode = before
        return [loop(1.0), sum(loop.stats.cache_hits.values())]

    return result


def files(folder: Path, suffix: str) -> list[Path]:
    return sorted(folder.rglob(f"*.{suffix}"))


def test_a_loop_follows_what_it_calls_and_numbers_that_it_brings_in(
    changed: Callable[..., list[float]],
) -> None:
    assert changed() == [4, 0]
    assert changed() == [4, 1]
    assert changed(more=5) == [12, 0]
    assert changed(factor=3, more=5) == [18, 0]


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_damaged_machine_code_is_compiled_again(
    changed: Callable[..., list[float]], tmp_path: Path, suffix: str
) -> None:
    assert changed() == [4, 0]
    (file,) = files(tmp_path, suffix)
    for damaged in (b"", file.read_bytes()[:20], bytes(50)):
        file.write_bytes(damaged)
        assert changed() == [4, 0]
        assert changed() == [4, 1]


def test_a_full_disk_costs_only_time(
    changed: Callable[..., list[float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile._save_data", full)
    assert changed() == [4, 0]
