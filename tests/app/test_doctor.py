"""The doctor: what it finds wrong, and the commands it gives."""

import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tbcad.app import doctor
from tbcad.app.doctor import Finding, attempt, diagnose, one_of, versions

KERNELS = ("cadquery-ocp", "cadquery-ocp-novtk")
NEEDS = [Requirement("cadquery-ocp==7.8.1.*"), Requirement("numpy>=2.1,<3")]


@pytest.fixture(autouse=True)
def _pip(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_uses_uv", lambda: False)


def test_this_environment_can_build() -> None:
    """The pins hold here: the test that one working kernel is installed."""
    findings = {finding.name: finding for finding in diagnose()}
    unsure = {"pictures"}  # not to be had everywhere
    if findings["versions"].detail == "tbcad is not installed":  # run from the source folder
        unsure.add("versions")
    assert [one for name, one in findings.items() if not one.ok and name not in unsure] == []
    assert len(findings) == 11
    assert all(bool(one.remedy) != one.ok and one.detail.isprintable() for one in findings.values())


def test_one_kernel_is_right_and_two_are_removed() -> None:
    right = [("cadquery-ocp", "7.8.1.1"), ("numpy", "2")]
    expected = Finding("CAD kernel", True, "cadquery-ocp 7.8.1.1")
    assert one_of("CAD kernel", KERNELS, right) == expected
    finding = one_of("CAD kernel", KERNELS, [*right, ("cadquery-ocp-novtk", "8.0.1")], NEEDS)
    assert not finding.ok
    assert finding.detail == (
        "cadquery-ocp 7.8.1.1 and cadquery-ocp-novtk 8.0.1 overwrite each other"
    )
    pip = f"{sys.executable} -m pip"
    assert finding.remedy == (
        f"{pip} uninstall -y cadquery-ocp cadquery-ocp-novtk && "
        f'{pip} install "cadquery-ocp==7.8.1.*"'
    )


def test_commands_are_uvs_where_there_is_no_pip(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_uses_uv", lambda: True)
    monkeypatch.setattr(sys, "executable", "/my venv/python")
    finding = one_of("CAD kernel", KERNELS, [], NEEDS)
    assert (finding.ok, finding.detail) == (False, "none installed")
    assert finding.remedy == (
        "uv pip uninstall --python '/my venv/python' cadquery-ocp cadquery-ocp-novtk && "
        "uv pip install --python '/my venv/python' \"cadquery-ocp==7.8.1.*\""
    )


def test_wrong_and_missing_versions_are_named() -> None:
    assert versions(NEEDS, [("cadquery-ocp", "7.8.1.1.post1"), ("numpy", "2.4.6")]).ok
    assert versions([Requirement("ocp_gordon<0.2")], [("ocp-gordon", "0.1.18")]).ok
    finding = versions(NEEDS, [("cadquery-ocp", "7.9.3.1")])
    assert (finding.ok, finding.detail) == (False, "cadquery-ocp 7.9.3.1, numpy missing")
    assert finding.remedy.endswith('pip install "cadquery-ocp==7.8.1.*" "numpy<3,>=2.1"')


def test_an_attempt_tells_its_last_line_or_why_it_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What lies about is not imported."""
    (tmp_path / "manifold3d.py").write_text("raise SystemExit('the wrong one')")
    monkeypatch.chdir(tmp_path)
    tried = "import manifold3d; print('a'); print('b'); print()"
    assert attempt("x", tried, "y") == Finding("x", True, "b")
    missing = "ModuleNotFoundError: No module named 'no_such_library'"
    finding = attempt("x", "import no_such_library", "install it")
    assert finding == Finding("x", False, missing, "install it")
    finding = attempt("x", "import os; os.abort()", "y")
    assert (finding.ok, finding.detail) == (False, "crashed (SIGABRT)")
    monkeypatch.setattr(doctor, "_TIMEOUT_S", 0.2)
    assert "no answer" in attempt("x", "import signal; signal.pause()", "y").detail


def pictured(remedy: str, ok: bool) -> Finding:
    return Finding("pictures", ok, "drawn" if ok else "crashed", "" if ok else remedy)


def test_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """With fakes: a real display is not to be had everywhere."""
    for alone, xvfb, detail in (
        (True, False, "drawn"),
        (False, True, "drawn, under xvfb-run"),
        (False, False, "crashed"),
    ):
        drawn = [alone, xvfb]  # in the order in which it is tried
        monkeypatch.setattr(doctor, "attempt", lambda *a, ok=drawn: pictured(a[2], ok.pop(0)))
        monkeypatch.setattr(doctor.shutil, "which", lambda _, there=xvfb: "/x" if there else None)
        finding = doctor.pictures()
        assert finding.detail == detail
        assert finding.ok != ("apt-get install xvfb" in finding.remedy)
