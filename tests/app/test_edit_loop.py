"""A build after changed keys has the bytes of one from nothing, and does again what they change."""

import random
from pathlib import Path

import pytest
from tbcad_verify.run.processes import Processes

from tbcad.app.api import build
from tbcad.common import reuse
from tbcad.common.reuse import VARIABLE, code_digest, store, told
from tbcad.core.spec.design import Spec, without_sections

EDITS = 20
SMALL = (
    *("optics.n=3", "optics.capture_diameter_mm=35", "prototype.k=3"),
    *("camera.width_px=416", "camera.height_px=310"),
)
# Keys of a sequence, each with values that fit all others.
VALUES = {
    "prototype.stage.led_ma": (8, 10, 12),
    "prototype.light.segments": (1, 2),
    "prototype.frame.camera_travel_mm": (20, 25),
    "prototype.base.digit_mm": (5, 6),
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
