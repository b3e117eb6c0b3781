"""The same results on any number of threads and workers, and when a worker dies among them.

The cluster is a real one: a scheduler and workers as processes of their own, on loopback.
"""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.run.processes import at_once

from tbcad.common import schedule
from tbcad.common.schedule import background_processes, cores, one_client, run_units, versions
from tbcad.core.spec.errors import SpecError
from tbcad.errors import InputError

HOST = "127.0.0.1"


def drawn(unit: int) -> float:
    """A figure that hangs on the unit alone, and on all its bits."""
    return float(np.random.Generator(np.random.Philox(key=unit)).standard_normal(1000).sum())


def interrupted(unit: int) -> None:
    raise KeyboardInterrupt


def refusal(*arguments: object, **options: object) -> str:
    with pytest.raises(InputError) as error:
        run_units(*arguments, **options)  # type: ignore[arg-type]
    text = str(error.value)
    assert text.isprintable()
    assert text.startswith("--scheduler ")
    return text


class TestThreads:
    @pytest.mark.parametrize("workers", [1, 2, 7, None])
    def test_results_are_the_units_in_their_order(self, workers: int | None) -> None:
        def work(unit: int) -> float:
            time.sleep(0.01 * (unit % 3))  # later units overtake
            return drawn(unit)

        told = []
        got = run_units(work, range(20), None, told.append, workers=workers)
        assert got == [drawn(unit) for unit in range(20)]
        assert sorted(told) == [*range(20)]

    def test_as_many_as_cores_work_at_once(self) -> None:
        together = threading.Barrier(cores(), timeout=10)
        run_units(lambda _: together.wait(), range(cores()))

    @pytest.mark.parametrize(("raised", "workers"), [(KeyError, 1), (KeyboardInterrupt, 2)])
    def test_what_work_raises_or_an_interruption_ends_it(
        self, raised: type[BaseException], workers: int
    ) -> None:
        begun = []

        def work(unit: int) -> None:
            begun.append(unit)
            time.sleep(0.01)  # or all are done before the first is heard of
            if raised is KeyError:
                raise KeyError(unit)

        with pytest.raises(raised):
            run_units(work, range(1000), progress=interrupted, workers=workers)
        assert len(begun) < 500


class Cluster:
    """A scheduler and its workers, each a process."""

    def __init__(self, folder: Path, *options: str) -> None:
        pytest.importorskip("distributed")
        self.folder, self.options, file = folder, options, folder / "scheduler.json"
        self.scheduler = self._started("scheduler", "--port", "0", "--scheduler-file", str(file))
        self.workers: list[subprocess.Popen[bytes]] = []
        until(lambda: file.exists() and bool(file.read_text()))
        self.address: str = json.loads(file.read_text())["address"]

    def start(self, workers: int) -> None:
        from distributed import Client

        versions.cache_clear()  # tbcad may have been edited since the tests began
        options = (self.address, "--no-nanny", "--nthreads", "1")
        self.workers += [self._started("worker", *options) for _ in range(workers)]
        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(len(self.workers), timeout=30)

    def stop(self) -> None:
        for process in [*self.workers, self.scheduler]:
            process.kill()
            process.wait()

    def _started(self, kind: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--host", HOST, "--no-dashboard"]
        return subprocess.Popen(
            [*command, *options, *self.options],
            cwd=self.folder,  # which Python's -m would look into first: not that of the tests
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )


def until(happens: Callable[[], bool], seconds: float = 30) -> None:
    end = time.monotonic() + seconds
    while not happens():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.01)


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    made = Cluster(tmp_path)
    yield made
    made.stop()


@pytest.fixture(scope="module")
def standing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A cluster with two workers that no test may stop."""
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    made.start(2)
    yield made
    made.stop()


def sent_by_value() -> Callable[[int], float]:
    """What `drawn` gives, by a function of no module: a worker knows no tests."""

    def work(unit: int) -> float:
        import numpy as np

        generator = np.random.Generator(np.random.Philox(key=unit))
        return float(generator.standard_normal(1000).sum())

    return work


def fatal_once(file: str, fatal: int) -> Callable[[int], float]:
    """The same, but of one unit only the second time: the first kills its process."""
    work = sent_by_value()

    def dying(unit: int) -> float:
        import os
        import signal

        if unit == fatal:
            try:
                mark = os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
            except FileExistsError:
                return work(unit)
            os.write(mark, str(os.getpid()).encode())
            os.kill(os.getpid(), signal.SIGKILL)
        return work(unit)

    return dying


class Marks:
    """Files that tell which process has begun and ended which unit."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()

    def work(self, seconds: float) -> Callable[[int], float]:
        folder, work = str(self.folder), sent_by_value()

        def marked(unit: int) -> float:
            import os
            import time
            from pathlib import Path

            (Path(folder) / f"begun-{os.getpid()}-{unit}").touch()
            time.sleep(seconds)
            result = work(unit)
            (Path(folder) / f"ended-{os.getpid()}-{unit}").touch()
            return result

        return marked

    def are_quiet(self) -> bool:
        """Whether no unit begins for some time."""
        begun = self.of("begun")
        time.sleep(0.5)
        return begun == self.of("begun") == self.of("ended")

    def of(self, what: str, process: int | str = "*") -> list[int]:
        found = self.folder.glob(f"{what}-{process}-*")
        return sorted(int(path.name.rpartition("-")[2]) for path in found)


class TestCluster:
    def test_gives_what_threads_give(self, standing: Cluster, tmp_path: Path) -> None:
        marks, told = Marks(tmp_path / "marks"), []
        got = run_units(marks.work(0.05), range(20), standing.address, told.append)
        assert got == [drawn(unit) for unit in range(20)]
        assert sorted(told) == list(range(20))
        assert all(marks.of("ended", worker.pid) for worker in standing.workers)

    def test_a_worker_killed_in_mid_run_changes_nothing(
        self, cluster: Cluster, tmp_path: Path
    ) -> None:
        """It kills itself within a unit, the first time that this unit is begun."""
        cluster.start(2)
        died = tmp_path / "died"
        got = run_units(fatal_once(str(died), 7), range(24), cluster.address)
        assert got == [drawn(unit) for unit in range(24)]
        gone = int(died.read_text())
        (victim,) = (one for one in cluster.workers if one.pid == gone)
        assert victim.wait(30) == -signal.SIGKILL

    def test_one_connection_for_all_work_of_a_command(
        self, standing: Cluster, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        import distributed

        opened: list[str] = []

        class Counted(distributed.Client):
            def __init__(self, address: str, **options: object) -> None:
                opened.append(address)
                super().__init__(address, **options)

        monkeypatch.setattr(distributed, "Client", Counted)
        work = sent_by_value()
        with one_client(standing.address) as client, one_client(standing.address) as same:
            assert client is same
            for part in (range(5), range(5, 9)):
                assert run_units(work, part, standing.address) == [drawn(unit) for unit in part]
        assert opened == [standing.address]
        assert client.status == "closed"
        assert run_units(work, [3], standing.address) == [drawn(3)]  # one of its own
        assert len(opened) == 2

    def test_a_unit_for_each_worker_goes_to_each(self, standing: Cluster) -> None:
        def work(_: int) -> int:
            import os
            import time

            time.sleep(0.2)
            return os.getpid()

        assert len(set(run_units(work, range(2), standing.address))) == 2

    @pytest.mark.slow
    def test_by_tls(self, tmp_path: Path) -> None:
        dask = pytest.importorskip("distributed").client.dask
        cert, key = (str(tmp_path / name) for name in ("cert.pem", "key.pem"))
        subject = ("-subj", "/CN=tbcad", "-addext", f"subjectAltName=IP:{HOST}")
        new = ("-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-out", cert, *subject)
        subprocess.run(["openssl", "req", *new], check=True, capture_output=True)
        files = ("--tls-ca-file", cert, "--tls-cert", cert, "--tls-key", key)
        wanted = {"ca-file": cert, "client.cert": cert, "client.key": key}
        with dask.config.set(
            {f"distributed.comm.tls.{name}": file for name, file in wanted.items()}
        ):
            cluster = Cluster(tmp_path, "--protocol", "tls", *files)
            try:
                cluster.start(1)
                assert cluster.address.startswith("tls://")
                assert run_units(sent_by_value(), range(3), cluster.address) == [
                    *map(drawn, range(3))
                ]
            finally:
                cluster.stop()

    def test_what_fails_in_a_command_closes_its_connection(self, standing: Cluster) -> None:
        with pytest.raises(KeyError), one_client(standing.address) as client:
            raise KeyError
        assert client.status == "closed"
        with one_client(None) as nothing:
            assert nothing is None
            assert run_units(drawn, [1]) == [drawn(1)]

    def test_an_interruption_ends_it_on_the_workers_too(
        self, standing: Cluster, tmp_path: Path
    ) -> None:
        marks = Marks(tmp_path / "marks")
        with pytest.raises(KeyboardInterrupt):
            run_units(marks.work(0.1), range(1000), standing.address, interrupted)
        until(marks.are_quiet)
        assert len(marks.of("begun")) < 500  # of 1000, however busy the machine

    def test_what_work_raises_is_raised_here(self, standing: Cluster) -> None:
        def work(unit: int) -> None:
            raise FileNotFoundError(unit)  # no lost connection, though both are OSError

        with pytest.raises(FileNotFoundError, match="3"):
            run_units(work, [3], standing.address)


def write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def refuse(text: str) -> None:
    raise SpecError(text)


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


class TestBackground:
    def test_all_is_done_at_the_end_of_the_block(self, tmp_path: Path) -> None:
        with background_processes() as submit:
            submit(write, tmp_path / "there", "x")
            write(tmp_path / "here", "y")
        assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"there": "x", "here": "y"}

    def test_what_it_raises_is_raised(self) -> None:
        with pytest.raises(SpecError, match="too thin"), background_processes() as submit:
            submit(refuse, "too thin")
        with pytest.raises(SpecError, match="too thin"):
            at_once(refuse, "too thin")

    def test_a_process_that_dies_is_told(self) -> None:
        died = r"ended before its work was done: crashed \(SIGKILL\)"
        with pytest.raises(RuntimeError, match=died), background_processes() as submit:
            submit(die)


TLS = "DASK_DISTRIBUTED__COMM__TLS__"


class TestRefused:
    @pytest.mark.parametrize("address", ["tls://127.0.0.1:8786", "wss://127.0.0.1:8786"])
    def test_without_certificates(self, address: str) -> None:
        dask = pytest.importorskip("distributed").client.dask
        with dask.config.set({"distributed.comm.tls.ca-file": None}):
            assert f"certificates of dask's configuration are not there: set {TLS}CA_FILE" in (
                refusal(drawn, [1], address)
            )
        names = ("ca-file", "client.cert", "client.key")
        with dask.config.set({f"distributed.comm.tls.{name}": "nowhere.pem" for name in names}):
            assert "cannot be read (No such file or directory)" in refusal(drawn, [1], address)

    def test_without_dask(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "distributed", None)
        assert "pip install 'tbcad[cluster]'" in refusal(drawn, [1], "tcp://host:8786")

    def test_where_nobody_listens(self) -> None:
        pytest.importorskip("distributed")
        with socket.socket() as taken:  # bound, but not listening
            taken.bind((HOST, 0))
            addresses = "nonsense", "tcp://h:99999", f"tcp://{HOST}:{taken.getsockname()[1]}"
            (said,) = {refusal(drawn, [1], one).partition(one)[2] for one in addresses}
        assert "no Dask scheduler answers there: start `dask scheduler`" in said

    @pytest.mark.parametrize("greeting", [b"", b"SSH-2.0-OpenSSH\r\n"])
    def test_where_something_else_listens(
        self, greeting: bytes, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """dask's own client would wait for a silent one without end."""
        pytest.importorskip("distributed")
        monkeypatch.setattr(schedule, "_CONNECT_TIMEOUT", 0.5)

        def greet(server: socket.socket) -> None:
            line, _ = server.accept()
            line.sendall(greeting)
            with suppress(ConnectionError):
                line.recv(1)  # until the other end hangs up

        with socket.create_server((HOST, 0)) as server:
            threading.Thread(target=greet, args=(server,), daemon=True).start()
            said = refusal(drawn, [1], f"tcp://{HOST}:{server.getsockname()[1]}")
        assert "no Dask scheduler answers there" in said

    def test_without_workers_and_with_wrong_ones(self, cluster: Cluster) -> None:
        said = refusal(drawn, [1], cluster.address, patience=0.3)
        assert f"no worker for 0.3 s: start `dask worker {cluster.address}`" in said
        wanted = versions() | {"tbcad's code": "0"}
        with pytest.raises(InputError, match=r"has tbcad's code \w+, allowed is 0 as here"):
            schedule._on_worker(drawn, 1, wanted, cluster.address)
        with (
            pytest.raises(InputError, match=r"cannot use tbcad \(.*tbcad.common\): install tbcad "),
            schedule._scheduler_errors(cluster.address),
        ):
            raise ModuleNotFoundError("tbcad.common", name="tbcad.common")

    def test_a_scheduler_of_another_version(
        self, standing: Cluster, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """As of 2024.2, whose `identity` takes no `n_workers`."""

        def refuse(*_: object, **__: object) -> None:
            raise TypeError("Scheduler.identity() got an unexpected keyword argument 'n_workers'")

        monkeypatch.setattr("distributed.Client", refuse)
        said = refusal(drawn, [1], standing.address)
        assert f"not understood by distributed {version('distributed')} of here (TypeErr" in said

    @pytest.mark.slow
    def test_a_scheduler_that_stops_answering_in_mid_run(
        self, cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(schedule, "_CHECK_INTERVAL", 0.3)
        cluster.start(1)

        def freeze(unit: int) -> None:
            cluster.scheduler.send_signal(signal.SIGSTOP)

        work = Marks(tmp_path / "marks").work(0.1)
        said = refusal(work, range(50), cluster.address, freeze, patience=3)
        assert "the scheduler went away" in said

    @pytest.mark.slow
    def test_a_unit_that_kills_its_workers(
        self, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
    ) -> None:
        monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "1")
        cluster = request.getfixturevalue("cluster")

        def work(unit: int) -> None:
            import os

            os._exit(1)

        cluster.start(3)
        said = refusal(work, [1], cluster.address)
        assert "2 workers died over one unit of work: give the workers more memory" in said

    @pytest.mark.slow
    def test_when_all_workers_die_and_when_the_scheduler_does(
        self, cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(schedule, "_CHECK_INTERVAL", 0.3)
        cluster.start(1)
        work = Marks(tmp_path / "marks").work(0.1)

        def kill(unit: int) -> None:
            cluster.workers[0].kill()

        said = refusal(work, range(50), cluster.address, kill, patience=0.5)
        assert "no worker for 0.5 s" in said

        cluster.workers.clear()
        cluster.start(1)

        def end(unit: int) -> None:
            with suppress(ProcessLookupError):
                cluster.scheduler.kill()

        assert "the scheduler went away" in refusal(work, range(50), cluster.address, end)
