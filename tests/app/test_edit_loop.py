"""A build after changed keys has the bytes of one from nothing, and does again what they change."""

import os
import pickle
import random
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from tbcad_verify.run.kept import STORE
from tbcad_verify.run.processes import Processes

from tbcad.app.api import build
from tbcad.common import reuse
from tbcad.common.reuse import VARIABLE, code_digest, store, told
from tbcad.core.spec.design import Spec, without_sections
from tbcad.errors import InputError

EDITS = 20
SMALL = (
    *("optics.n=3", "optics.capture_diameter_mm=35", "prototype.k=4"),
    *("camera.width_px=416", "camera.height_px=310"),
)
# Keys of a sequence, each with values that fit all others.
VALUES = {
    "prototype.stage.led_ma": (8, 10, 12),
    "prototype.light.segments": (1, 2),
    "prototype.frame.camera_travel_mm": (20, 25),
    "prototype.base.digit_mm": (6, 7),
    "mesh.structure_error_mm": (0.02, 0.03),
    "name": ('"one"', '"two"'),
}


@pytest.fixture
def kept_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A store of the test's own."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "store"))
    return tmp_path / "store"


def contents(folder: Path) -> dict[str, bytes]:
    return {one.name: one.read_bytes() for one in sorted(folder.iterdir())}


@pytest.mark.usefixtures("standing")
def test_what_is_built_again_is_the_same(kept_in: Path, tmp_path: Path) -> None:
    def built(fresh: bool = False) -> tuple[dict[str, bytes], list[str]]:
        said: list[str] = []
        build(
            None,
            tmp_path / "out",
            settings=SMALL,
            parts="shell",
            verify=False,
            fresh=fresh,
            answer=said.append,
        )
        return contents(tmp_path / "out"), said

    first, said = built()
    assert not said
    again, (line,) = built()
    assert again == first
    assert line.startswith("reused: ")
    assert "shells" in line
    assert line.endswith("; --fresh builds all")
    for file in kept_in.iterdir():  # cut off, or one byte changed
        data = file.read_bytes()
        file.write_bytes(data[:-1] if len(data) % 2 else data[:-1] + bytes([data[-1] ^ 1]))
    assert built() == (first, [])
    assert built(fresh=True) == (first, [])


OF_PROTOTYPE = (
    ("prototype.stage.led_ma=8", "prototype.light.segments=2"),
    ("prototype.stage.led_ma=12", "prototype.frame.camera_travel_mm=25"),
)


def shells(out: Path, settings: tuple[str, ...]) -> list[str]:
    """Build shells of a small design, and give what the build says."""
    said: list[str] = []
    build(
        None,
        out,
        settings=[*SMALL, *settings],
        parts="shell",
        verify=False,
        answer=said.append,
    )
    return said


@pytest.mark.slow
def test_two_builds_at_once_and_one_after_them_give_the_bytes_of_a_fresh_one(
    kept_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of edits of the prototype, from which shells do not follow, in one store."""
    places = [tmp_path / "one", tmp_path / "other"]
    with Processes(2) as workers:
        pairs = zip(places, OF_PROTOTYPE, strict=True)
        for building in [workers.submit(shells, *each) for each in pairs]:
            building.result()
    (line,) = shells(tmp_path / "edited", OF_PROTOTYPE[0])
    assert {"mirrors", "shells"} <= {*line.removeprefix("reused: ").split("; ")[0].split(", ")}
    monkeypatch.setenv(VARIABLE, "")
    assert shells(tmp_path / "fresh", OF_PROTOTYPE[0]) == []
    one, other, edited = map(contents, (*places, tmp_path / "edited"))
    assert one == edited == contents(tmp_path / "fresh")
    changed = {name for name in one if one[name] != other[name]}
    assert changed
    assert not [name for name in changed if name.startswith(("shell_", "mirrors"))]


@pytest.mark.slow
@pytest.mark.usefixtures("standing")
def test_twenty_edits_give_the_bytes_of_fresh_builds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every fifth is compared with a build from nothing, the last with its verdict."""
    draw, keys = random.Random(1), dict[str, object]()
    for number in range(1, EDITS + 1):
        key = draw.choice(list(VALUES))
        keys[key] = draw.choice(VALUES[key])
        settings = [*SMALL, *(f"{name}={value}" for name, value in keys.items())]
        found = []
        for place, kept in (("edited", str(tmp_path / "store")), ("fresh", "")):
            if kept or number % 5 == 0:
                monkeypatch.setenv(VARIABLE, kept)
                build(None, tmp_path / place, settings=settings, verify=number == EDITS)
                found.append(contents(tmp_path / place))
        one, other = found[0], found[-1]
        assert {"shell_a.step", "prototype.step"} <= {*one}
        assert not [name for name in one | other if one.get(name) != other.get(name)], settings


def test_work_that_reads_what_it_must_not_fails() -> None:
    own = without_sections(Spec(), "prototype")
    assert own.optics == Spec().optics
    with pytest.raises(AttributeError):
        own.prototype.k  # noqa: B018


def test_nothing_is_kept_where_others_may_write(kept_in: Path) -> None:
    assert store(False).folder == kept_in
    assert kept_in.stat().st_mode & 0o777 == 0o700
    assert told(store(False)) == ""
    kept_in.chmod(0o777)
    assert store(False).folder is None


def test_the_store_is_in_the_users_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert store(False).folder == tmp_path / "tbcad"
    for unusable in ("/dev/null/store", ""):
        monkeypatch.setenv(VARIABLE, unusable)
        assert store(False).folder is None


def test_other_code_libraries_or_processor_have_another_digest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    code_digest.cache_clear()
    digest = code_digest()
    for part in ("_sources", "_libraries", "_processor"):
        code_digest.cache_clear()
        with monkeypatch.context() as patch:
            patch.setattr(reuse, part, lambda: [b"other"])
            assert code_digest() != digest
    code_digest.cache_clear()
    assert code_digest() == digest


def entry(kept_in: Path) -> Path:
    """The only one of a store with the result of some work, which is there."""
    own = store(False)
    own.put("key", pickle.dumps("result"))
    assert own.get("key") == "result"
    (file,) = kept_in.iterdir()
    return file


def as_link(file: Path) -> None:
    file.rename(file.with_name("elsewhere"))
    file.symlink_to("elsewhere")


def as_folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


def as_pipe(file: Path) -> None:  # reading one would wait without end
    file.unlink()
    os.mkfifo(file)


def as_nothing_there(file: Path) -> None:
    file.unlink()
    file.symlink_to("nowhere")


def as_zeros(file: Path) -> None:
    file.write_bytes(bytes(file.stat().st_size))


def as_of_another_key(file: Path) -> None:
    file.rename(file.with_name("kept-other"))
    store(False).put("key", pickle.dumps("other"))
    file.rename(file.with_name("kept-third"))
    file.with_name("kept-other").rename(file)
    file.write_bytes(file.with_name("kept-third").read_bytes()[:-1])


@pytest.mark.parametrize(
    "damaged",
    [as_link, as_folder, as_pipe, as_nothing_there, as_zeros, as_of_another_key],
)
def test_what_is_no_whole_entry_of_ones_own_is_not_read(
    kept_in: Path, damaged: Callable[[Path], None]
) -> None:
    file = entry(kept_in)
    damaged(file)
    assert store(False).get("key") is None
    store(False).put("key", pickle.dumps("again"))
    assert store(False).get("key") == (None if file.is_dir() else "again")
    file.with_name("kept-last").write_bytes(bytes(100))
    store(False).prune(0)  # whatever lies there
    assert not [one for one in kept_in.iterdir() if one.is_file() and one.name != "elsewhere"]


def test_what_another_user_wrote_is_not_read(kept_in: Path) -> None:
    """Before the folder was closed to others."""
    file = entry(kept_in)
    with suppress(PermissionError):  # for root alone
        os.chown(file, 12345, -1)
        assert store(False).get("key") is None


def test_code_that_changes_keeps_nothing(kept_in: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Old and new modules would be mixed in one process, under the digest of either."""
    said: list[str] = []
    store(False).put("before", pickle.dumps(1))
    os.utime(*kept_in.iterdir(), times=(0, 0))
    with reuse.reusing(False, said.append):
        own = STORE.get()
        assert own
        own.put("within", pickle.dumps(2))
        monkeypatch.setattr(reuse, "_processor", lambda: [b"changed"])
    assert [file.name for file in kept_in.iterdir()] == ["kept-before"]
    assert store(False).folder is None
    monkeypatch.undo()


def test_code_that_is_newer_than_the_process_keeps_nothing(
    kept_in: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert store(False).folder == kept_in
    monkeypatch.setattr(reuse, "LOADED", 0.0)
    assert store(False).folder is None


def test_the_store_is_not_in_the_folder_that_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for place in ("out", "out/kept"):
        monkeypatch.setenv(VARIABLE, place)
        with pytest.raises(InputError, match=rf"^{VARIABLE} is {place}, within the build's folder"):
            build(None, "out", settings=SMALL, verify=False)
        assert not [*tmp_path.iterdir()]
    monkeypatch.setenv(VARIABLE, "kept")
    assert store(False).folder == tmp_path / "kept"  # wherever a process goes


def test_threads_of_sums_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """One thread or two of OpenBLAS give other last digits, in a build from nothing too."""
    before = reuse._digest()
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    other = reuse._digest()
    assert other != before
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(1000), raising=False)
    assert reuse._digest() not in (before, other)
    monkeypatch.undo()
    monkeypatch.setenv("NUMBA_CACHE_DIR", "elsewhere")
    assert reuse._digest() == before


def test_libraries_of_libraries_count() -> None:
    names = {line.split()[0] for line in reuse._libraries()}
    assert {b"cadquery-ocp", b"llvmlite", b"numpy"} <= names
