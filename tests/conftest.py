"""What several test files build once."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# As tbcad's commands do, before numpy is loaded: each core has a process of tests already, in which
# threads of the linear algebra would only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Tests replace functions, which no digest of the code tells: nothing is kept between builds.
os.environ["TBCAD_CACHE"] = ""

from tbcad_verify.run.processes import ProcessEnded, Processes

from tbcad.app.cli import run
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.core.mirrors.record import write_record
from tbcad.light.simulate.prototype.run import Plan, read_plan
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.shell.envelope import Envelope
from tbcad.shell.halves import shell_envelope
from tests.mirror_arrays import mirror_design
from tests.prototype_exports import write_export, write_wind_up

# No clock, which a busy machine would fail, and the same examples in every run.
settings.register_profile(
    "tbcad", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("tbcad")


@pytest.fixture(scope="session", autouse=True)
def without_fsync() -> Iterator[None]:
    """Nothing waits for the disk, which only a power cut could tell from the real one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


# Files that take longest, the longest first: last, one process would wait for another.
LONGEST = (
    *("test_documentation.py", "test_any_optics.py", "test_corpus.py", "test_every_design.py"),
    *("test_tour.py", "test_prototypes.py", "test_edit_loop.py", "test_programs.py"),
    *("test_arrangement.py", "test_guest.py", "test_loop.py", "test_report_in_chromium.py"),
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that take longest come first."""
    rank = {name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path.name, len(rank)))


@pytest.fixture(scope="session")
def spare() -> Iterator[list[Any]]:
    """Processes that have done what they were asked, for `standing`."""
    processes: list[Any] = []
    yield processes
    for process in processes:
        process.close()


@pytest.fixture
def standing(spare: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes of one build serve the next: they take seconds to load their libraries."""
    begun, ended = Processes._started, Processes.__exit__

    def started(self: Processes) -> Any:
        while True:
            try:
                process = spare.pop()
            except IndexError:  # none, or another thread has taken it
                return begun(self)
            with suppress(ProcessEnded):
                process.ask((os.chdir, (os.getcwd(),), False, None), None, None)
                self._all.append(process)
                if self._killed:  # meanwhile
                    process.kill()
                return process

    def left(self: Processes, kind: type[BaseException] | None, *rest: object) -> None:
        self.shutdown(wait=kind is None)
        if kind is None and not self._killed:
            spare.extend(self._idle)
            self._all = [one for one in self._all if one not in self._idle]
        ended(self, kind, *rest)

    monkeypatch.setattr(Processes, "_started", started)
    monkeypatch.setattr(Processes, "__exit__", left)


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """Run a command of words, which is to end with a code; gives what it printed."""

    def command(*words: object, code: int = 0) -> Any:
        capsys.readouterr()
        assert run([*map(str, words)]) == code
        return capsys.readouterr()

    return command


@pytest.fixture(scope="session")
def paper_design() -> MirrorDesign:
    """The paper's design with exact radii: n = 18, target 60 mm plus the default margin."""
    return mirror_design()


@pytest.fixture(scope="session")
def paper_array(paper_design: MirrorDesign) -> MirrorArray:
    return paper_design.arrays[0]


@pytest.fixture(scope="session")
def small_design() -> MirrorDesign:
    """A quick one with everything in it: few mirrors, both flanges, halved mirrors."""
    return mirror_design("n=6")


@pytest.fixture(scope="session")
def small_half(small_design: MirrorDesign) -> MirrorArray:
    return small_design.arrays[0]


@pytest.fixture(scope="session")
def small_envelope(small_design: MirrorDesign) -> Envelope:
    return shell_envelope(small_design)


@pytest.fixture(scope="session")
def low_resolution_design() -> MirrorDesign:
    """The small one for photographs of few pixels, with five balls."""
    options = ["n=6", "camera.width_px=416", "camera.height_px=310", "prototype.k=5"]
    return mirror_design(*options, "prototype.largest_ball_mm=60", "prototype.grade=G40")


@pytest.fixture(scope="session")
def record(low_resolution_design: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the record only, as `tbcad build` writes it."""
    folder = tmp_path_factory.mktemp("record")
    write_record(folder, low_resolution_design, shells=False)
    return folder


@pytest.fixture(scope="session")
def captured(record: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a capture with nothing but defaults; tests leave it as it is."""
    out = tmp_path_factory.mktemp("captures") / "knot"
    assert run(["capture", str(record), "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="session")
def layout(low_resolution_design: MirrorDesign) -> PrototypeLayout:
    return prototype_layout(low_resolution_design.spec, low_resolution_design)


@pytest.fixture(scope="session")
def export_folder(
    layout: PrototypeLayout,
    low_resolution_design: MirrorDesign,
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    return write_export(tmp_path_factory.mktemp("export"), low_resolution_design, layout)


@pytest.fixture(scope="session")
def export(export_folder: Path) -> ExportedDesign:
    return read_export(export_folder)


@pytest.fixture(scope="session")
def plan(export: ExportedDesign) -> Plan:
    return read_plan(export)


@pytest.fixture(scope="session")
def export_with_wind_up(
    export_folder: Path, layout: PrototypeLayout, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    folder = tmp_path_factory.mktemp("export") / "exports"
    shutil.copytree(export_folder, folder)
    write_wind_up(folder, len(layout.stops.angle))
    return folder
