"""The doctor: what it finds wrong, and the commands it gives."""

import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tbcad.app import doctor
from tbcad.app.doctor import Finding, attempt, diagnose, disk, memory, one_of, versions

KERNELS = ("cadquery-ocp", "cadquery-ocp-novtk")
NEEDS = [Requirement("cadquery-ocp==7.8.1.*"), Requirement("numpy>=2.1,<3")]


@pytest.fixture(autouse=True)
def _pip(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_uses_uv", lambda: False)


@pytest.fixture(scope="module")
def findings() -> dict[str, Finding]:
    return {finding.name: finding for finding in diagnose()}


class TestThisEnvironment:
    """The pins hold here: the test that one working kernel is installed."""

    @pytest.mark.parametrize(
        "name",
        [
            "CAD kernel",
            "VTK",
            "OCP",
            "build123d",
            "embreex",
            "manifold3d",
            "lib3mf",
            "numba",
            "h5py",
            "memory",
            "disk",
        ],
    )
    def test_can_build(self, findings: dict[str, Finding], name: str) -> None:
        assert findings[name].ok, findings[name]

    def test_has_versions_as_pinned(self, findings: dict[str, Finding]) -> None:
        if findings["versions"].detail == "tbcad is not installed":
            pytest.skip("run from the source folder")
        assert findings["versions"].ok, findings["versions"]
        assert findings["Python"].ok, findings["Python"]

    def test_has_a_remedy_for_every_fault_and_only_for_faults(
        self, findings: dict[str, Finding]
    ) -> None:
        assert all(bool(f.remedy) != f.ok for f in findings.values()), findings
        assert all(f.detail.isprintable() for f in findings.values())


class TestOneKernel:
    def test_one_is_right(self) -> None:
        finding = one_of("CAD kernel", KERNELS, [("cadquery-ocp", "7.8.1.1"), ("numpy", "2")])
        assert finding == Finding("CAD kernel", True, "cadquery-ocp 7.8.1.1")

    def test_two_are_wrong_and_both_are_removed(self) -> None:
        both = [("cadquery-ocp", "7.8.1.1"), ("cadquery-ocp-novtk", "8.0.1")]
        finding = one_of("CAD kernel", KERNELS, both, NEEDS)
        assert not finding.ok
        assert finding.detail == (
            "cadquery-ocp 7.8.1.1 and cadquery-ocp-novtk 8.0.1 overwrite each other"
        )
        pip = f"{sys.executable} -m pip"
        assert finding.remedy == (
            f"{pip} uninstall -y cadquery-ocp cadquery-ocp-novtk && "
            f'{pip} install "cadquery-ocp==7.8.1.*"'
        )

    def test_commands_are_uvs_where_there_is_no_pip(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(doctor, "_uses_uv", lambda: True)
        monkeypatch.setattr(sys, "executable", "/my venv/python")
        assert one_of("CAD kernel", KERNELS, [], NEEDS).remedy == (
            "uv pip uninstall --python '/my venv/python' cadquery-ocp cadquery-ocp-novtk && "
            "uv pip install --python '/my venv/python' \"cadquery-ocp==7.8.1.*\""
        )

    def test_none_is_wrong(self) -> None:
        finding = one_of("CAD kernel", KERNELS, [("numpy", "2")])
        assert not finding.ok
        assert finding.detail == "none installed"


class TestVersions:
    def test_as_required(self) -> None:
        assert versions(NEEDS, [("cadquery-ocp", "7.8.1.1.post1"), ("numpy", "2.4.6")]).ok

    def test_wrong_and_missing_ones_are_named(self) -> None:
        finding = versions(NEEDS, [("cadquery-ocp", "7.9.3.1")])
        assert not finding.ok
        assert finding.detail == "cadquery-ocp 7.9.3.1, numpy missing"
        assert finding.remedy.endswith('pip install "cadquery-ocp==7.8.1.*" "numpy<3,>=2.1"')

    def test_names_are_compared_in_one_spelling(self) -> None:
        assert versions([Requirement("ocp_gordon<0.2")], [("ocp-gordon", "0.1.18")]).ok


class TestPython:
    @pytest.mark.parametrize(("version", "ok"), [("3.10.9", False), ("3.11.0", True)])
    def test_is_compared(self, monkeypatch: pytest.MonkeyPatch, version: str, ok: bool) -> None:
        monkeypatch.setattr(doctor, "metadata", lambda _: {"Requires-Python": ">=3.11,<3.14"})
        assert doctor.python_version(version).ok is ok


class TestAttempt:
    def test_that_works_tells_its_last_line(self) -> None:
        assert attempt("x", "print('a'); print('b'); print()", "y") == Finding("x", True, "b")

    def test_that_raises(self) -> None:
        finding = attempt("x", "import no_such_library", "install it")
        assert finding == Finding(
            "x", False, "ModuleNotFoundError: No module named 'no_such_library'", "install it"
        )

    def test_that_crashes(self) -> None:
        finding = attempt("x", "import os; os.abort()", "y")
        assert (finding.ok, finding.detail) == (False, "crashed (SIGABRT)")

    def test_that_hangs(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(doctor, "_TIMEOUT_S", 0.2)
        assert "no answer" in attempt("x", "import signal; signal.pause()", "y").detail

    def test_does_not_import_what_lies_about(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        (tmp_path / "manifold3d.py").write_text("raise SystemExit('the wrong one')")
        monkeypatch.chdir(tmp_path)
        assert attempt("x", "import manifold3d; print('right')", "y").ok


class TestPictures:
    """With fakes: a real display is not to be had everywhere."""

    def drawn(self, monkeypatch: pytest.MonkeyPatch, *, alone: bool, xvfb: bool | None) -> Finding:
        def fake(name: str, _: str, remedy: str, before: list[str] | None = None) -> Finding:
            ok = bool(xvfb) if before else alone
            return Finding(name, ok, "drawn" if ok else "crashed", "" if ok else remedy)

        monkeypatch.setattr(doctor, "attempt", fake)
        monkeypatch.setattr(doctor.shutil, "which", lambda _: None if xvfb is None else "/x")
        return doctor.pictures()

    def test_with_a_display(self, monkeypatch: pytest.MonkeyPatch) -> None:
        assert self.drawn(monkeypatch, alone=True, xvfb=None).detail == "drawn"

    def test_under_xvfb(self, monkeypatch: pytest.MonkeyPatch) -> None:
        finding = self.drawn(monkeypatch, alone=False, xvfb=True)
        assert (finding.ok, finding.detail) == (True, "drawn, under xvfb-run")

    @pytest.mark.parametrize("xvfb", [None, False])
    def test_without(self, monkeypatch: pytest.MonkeyPatch, xvfb: bool | None) -> None:
        finding = self.drawn(monkeypatch, alone=False, xvfb=xvfb)
        assert not finding.ok
        assert "apt-get install xvfb" in finding.remedy


@pytest.mark.parametrize(("free", "ok"), [(1.9, False), (2.1, True), (None, True)])
def test_memory(free: float | None, ok: bool) -> None:
    assert memory(free).ok is ok
    assert bool(memory(free).remedy) is not ok


@pytest.mark.parametrize(("free", "ok"), [(0.9e9, False), (1.1e9, True)])
def test_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, free: float, ok: bool) -> None:
    asked = []

    def usage(path: Path) -> object:
        asked.append(path)
        return type("Usage", (), {"free": free})

    monkeypatch.setattr(doctor.shutil, "disk_usage", usage)
    assert disk(tmp_path / "not" / "yet").ok is ok
    assert asked == [tmp_path]


def test_libraries_of_the_machine_are_optional() -> None:
    found = doctor.machine_libraries([("pyserial", "3.5"), ("numpy", "2.1")])
    assert found.ok
    assert found.detail == "pyserial 3.5, " + ", ".join(f"no {one}" for one in doctor._MACHINE[1:])
    assert "'tbcad[machine]'" in found.remedy
    every = [(name, "1") for name in doctor._MACHINE]
    assert not doctor.machine_libraries(every).remedy
