"""Checks of the environment, with the command that repairs each fault.

Native libraries are tried in child processes: two kernels that clash, or VTK without a display,
can end a process without a message.
"""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import PackageNotFoundError, distributions, requires
from importlib.util import find_spec

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

_TIMEOUT_S = 180  # the first import on a cold disk reads 1 GB
_NO_CORE_DUMP = """
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except ImportError:  # no POSIX
    pass
"""
_PICTURE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.AddRenderer(vtkRenderer())
window.Render()
print("drawn")
"""

_KERNELS = ("cadquery-ocp", "cadquery-ocp-novtk")
_VTKS = ("vtk", "cadquery-vtk")
_INSTALL_X11 = "apt-get install libgl1 libx11-6 libxrender1 libegl1"
# By name, what loads its shared libraries, and the distributions that own it; the first of these is
# installed again if it cannot be loaded.
_LIBRARIES: dict[str, tuple[str, tuple[str, ...]]] = {
    "OCP": ("import OCP.gp", _KERNELS),
    "build123d": ("import build123d", _KERNELS),
    "embreex": ("import embreex.rtcore_scene", ("embreex",)),
    "manifold3d": ("import manifold3d", ("manifold3d",)),
    "lib3mf": ("import lib3mf; lib3mf.get_wrapper()", ("lib3mf",)),
    "numba": ("import numba", ("numba", "llvmlite")),
    "h5py": ("import h5py", ("h5py",)),
}
_LOADED = "\nprint('can be loaded')"


@dataclass(frozen=True)
class Finding:
    """Result of one check: whether it passed, what was found, and the command that repairs it."""

    name: str
    ok: bool
    detail: str
    remedy: str = ""


def diagnose() -> list[Finding]:
    """Check everything that a build needs."""
    needs = _requirements()
    found = {(canonicalize_name(one.name), one.version) for one in distributions() if one.name}
    installed = sorted(found)
    attempts: list[Callable[[], Finding]] = []
    for name, (program, owners) in _LIBRARIES.items():
        first = f"{_INSTALL_X11}; if that is not it: " if owners is _KERNELS else ""
        remedy = first + _reinstall(owners, owners[0], needs)
        attempts.append(partial(attempt, name, program + _LOADED, remedy))
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        findings = list(pool.map(lambda check: check(), [*attempts, pictures]))
    return [
        one_of("CAD kernel", _KERNELS, installed, needs),
        one_of("VTK", _VTKS, installed, needs),
        versions(needs, installed),
        *findings,
    ]


def one_of(
    name: str,
    rivals: Sequence[str],
    installed: Iterable[tuple[str, str]],
    needs: Sequence[Requirement] = (),
) -> Finding:
    """Check that exactly one of some distributions that own the same files is installed.

    Installed are (name, version); tbcad's requirements give the version in the remedy.
    """
    present = [f"{which} {version}" for which, version in installed if which in rivals]
    detail = " and ".join(present) or "none installed"
    if len(present) > 1:
        detail += " overwrite each other"
    ok = len(present) == 1
    # The kernel brings the VTK it was built with.
    return Finding(name, ok, detail, "" if ok else _reinstall(rivals, _KERNELS[0], needs))


def versions(needs: Sequence[Requirement], installed: Iterable[tuple[str, str]]) -> Finding:
    """Check that all that tbcad requires is installed in a version it allows."""
    present = dict(installed)
    seen = {need: present.get(canonicalize_name(need.name), "") for need in needs}
    allows = {n: n.specifier.contains(v, prereleases=True) for n, v in seen.items() if v}
    wrong = [need for need in needs if not allows.get(need)]
    if not needs:
        return Finding("versions", False, "tbcad is not installed", f"{_pip('install')} .")
    if not wrong:
        return Finding("versions", True, f"{len(needs)} libraries as required")
    told = ", ".join(f"{need.name} {seen[need] or 'missing'}" for need in wrong)
    return Finding("versions", False, told, f"{_pip('install')} {_quoted(wrong)}")


def attempt(name: str, program: str, remedy: str, before: Sequence[str] = ()) -> Finding:
    """Run a small Python program in a child process; what it prints last is the detail.

    It fails when what is tried does not work. `before` is a command in front of the interpreter.
    """
    try:
        run = subprocess.run(
            [*before, sys.executable, "-P", "-c", _NO_CORE_DUMP + program],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Finding(name, False, f"no answer after {_TIMEOUT_S} s", remedy)
    if run.returncode == 0:
        return Finding(name, True, _last_line(run.stdout))
    crash = f"crashed ({signal.Signals(-run.returncode).name})" if run.returncode < 0 else ""
    told = ": ".join(filter(None, [crash, _last_line(run.stderr)]))
    return Finding(name, False, told or f"ended with {run.returncode}", remedy)


def _last_line(text: str) -> str:
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)  # VTK's colours
    plain = re.sub(r"^.*ERR\| ", "", plain, flags=re.MULTILINE)  # its times and addresses
    return ([line.strip() for line in plain.splitlines() if line.strip()] or [""])[-1]


def pictures() -> Finding:
    """Check that VTK can draw without a window, by itself or under xvfb-run."""
    remedy = (
        "apt-get install xvfb libgl1-mesa-dri, then run under xvfb-run -a; only pictures need it"
    )
    direct = attempt("pictures", _PICTURE, remedy)
    if direct.ok or not shutil.which("xvfb-run"):
        return direct
    under_x = attempt("pictures", _PICTURE, remedy, ["xvfb-run", "-a"])
    return replace(under_x, detail=f"{under_x.detail}, under xvfb-run")


def _requirements() -> list[Requirement]:
    """Return what the installed tbcad requires here, without extras."""
    try:
        needs = [Requirement(text) for text in requires("tbcad") or ()]
    except PackageNotFoundError:
        return []
    return [need for need in needs if need.marker is None or need.marker.evaluate({"extra": ""})]


def _reinstall(remove: Sequence[str], add: str, needs: Sequence[Requirement]) -> str:
    """Return the commands that remove distributions and install one as tbcad pins it."""
    pinned = [need for need in needs if canonicalize_name(need.name) == add] or [Requirement(add)]
    removing = _pip("uninstall") if _uses_uv() else f"{_pip('uninstall')} -y"
    return f"{removing} {' '.join(remove)} && {_pip('install')} {_quoted(pinned)}"


def _quoted(needs: Iterable[Requirement]) -> str:
    return " ".join(f'"{need.name}{need.specifier}"' for need in needs)


def _pip(verb: str) -> str:
    python = shlex.quote(sys.executable)
    return f"uv pip {verb} --python {python}" if _uses_uv() else f"{python} -m pip {verb}"


def _uses_uv() -> bool:
    return find_spec("pip") is None
