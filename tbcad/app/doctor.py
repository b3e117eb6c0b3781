"""Checks of the environment, with the command that repairs each fault.

Native libraries are tried in child processes: two kernels that clash, or VTK without a display,
can end a process without a message.
"""

import os
import platform
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
from importlib.metadata import PackageNotFoundError, distributions, metadata, requires
from importlib.util import find_spec
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

_TIMEOUT_S = 180  # the first import on a cold disk reads 1 GB
_MIN_MEMORY_GB = 2.0
_MIN_DISK_GB = 1.0
_NO_CORE_DUMP = """
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except ImportError:  # no POSIX
    pass
"""

_KERNELS = ("cadquery-ocp", "cadquery-ocp-novtk")
_MACHINE = (
    *("pyserial", "gphoto2", "opencv-python-headless"),
    *("rawpy", "imagecodecs", "openexr"),
)
_VTKS = ("vtk", "cadquery-vtk")
_INSTALL_X11 = "apt-get install libgl1 libx11-6 libxrender1 libegl1"

_KERNEL = "import OCP; print(OCP.__version__)"
_PART = """
import build123d
volume = build123d.Box(1, 2, 3).volume
assert abs(volume - 6) < 1e-9, volume
print("a box has its volume")
try:
    import cadquery
except ModuleNotFoundError:
    pass
else:
    assert abs(cadquery.Shape.cast(build123d.Box(1, 2, 3).wrapped).Volume() - 6) < 1e-9
    print("cadquery shares its kernel")
"""
_EMBREE = """
import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
scene = rtcore_scene.EmbreeScene()
TriangleMesh(scene, np.array([[[-1, -1, 2], [1, -1, 2], [0, 1, 2]]], np.float32))
ray = np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32)
assert abs(scene.run(*ray, output=1)["tfar"][0] - 2) < 1e-6
print("a ray hits where it should")
"""
_MANIFOLD = """
from manifold3d import Manifold
assert abs(Manifold.cube((1, 2, 3)).volume() - 6) < 1e-6
print("a box has its volume")
"""
_LIB3MF = """
from lib3mf import get_wrapper
print("version", ".".join(map(str, get_wrapper().GetLibraryVersion())))
"""
_NUMBA = """
from numba import njit
assert njit(lambda x: x + 1)(41) == 42
print("a loop is compiled")
"""
_H5PY = """
import h5py, numpy as np
with h5py.File("doctor", "w", driver="core", backing_store=False) as file:
    file.create_dataset("a", data=np.arange(9), compression=1)
    assert file["a"][8] == 8
print("version", h5py.version.hdf5_version)
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


# Name, program and distributions; the first of these is installed again if the program fails.
_LIBRARIES: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("OCP", _KERNEL, _KERNELS),
    ("build123d", _PART, _KERNELS),
    ("embreex", _EMBREE, ("embreex",)),
    ("manifold3d", _MANIFOLD, ("manifold3d",)),
    ("lib3mf", _LIB3MF, ("lib3mf",)),
    ("numba", _NUMBA, ("numba", "llvmlite")),
    ("h5py", _H5PY, ("h5py",)),
)


@dataclass(frozen=True)
class Finding:
    """Result of one check: whether it passed, what was found, and the command that repairs it."""

    name: str
    ok: bool
    detail: str
    remedy: str = ""


def diagnose(folder: Path = Path()) -> list[Finding]:
    """Check everything that a build needs, and the free space of the exports' folder."""
    needs = _requirements()
    attempts: list[Callable[[], Finding]] = [pictures]
    for name, program, owners in reversed(_LIBRARIES):
        first = f"{_INSTALL_X11}; if that is not it: " if program is _KERNEL else ""
        remedy = first + _reinstall(owners, owners[0], needs)
        attempts.insert(0, partial(attempt, name, program, remedy))
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        findings = list(pool.map(lambda check: check(), attempts))
    return [
        python_version(platform.python_version()),
        one_of("CAD kernel", _KERNELS, _installed(), needs),
        one_of("VTK", _VTKS, _installed(), needs),
        versions(needs, _installed()),
        machine_libraries(_installed()),
        *findings,
        memory(available_memory_gb()),
        disk(folder),
    ]


def python_version(version: str) -> Finding:
    """Compare a Python version with the one that the installed tbcad asks for."""
    try:
        wanted = metadata("tbcad")["Requires-Python"]
    except PackageNotFoundError:
        return Finding(
            "Python", False, f"{version}; tbcad is not installed", f"{_pip('install')} ."
        )
    ok = Requirement(f"python{wanted}").specifier.contains(version, prereleases=True)
    return Finding("Python", ok, version, "" if ok else f"make a venv with Python {wanted}")


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


def machine_libraries(installed: Iterable[tuple[str, str]]) -> Finding:
    """Say which libraries for a real machine are there; a build needs none of them."""
    present = dict(installed)
    seen = [f"{name} {present[name]}" for name in _MACHINE if name in present]
    missing = [name for name in _MACHINE if name not in present]
    detail = ", ".join([*seen, *(f"no {name}" for name in missing)])
    users = "tbcad run and calibrate, raw files and OpenEXR"
    remedy = f"only {users} need them: {_pip('install')} 'tbcad[machine]'"
    return Finding("machine (optional)", True, detail, remedy if missing else "")


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


def memory(available_gb: float | None) -> Finding:
    """Compare the free memory with what the largest build takes."""
    if available_gb is None:
        return Finding("memory", True, "unknown on this system")
    ok = available_gb >= _MIN_MEMORY_GB
    remedy = "" if ok else f"close other programs: {_MIN_MEMORY_GB:g} GB are needed"
    return Finding("memory", ok, f"{available_gb:.1f} GB free", remedy)


def disk(folder: Path) -> Finding:
    """Compare the free space where a folder is or would be with what exports take."""
    absolute = folder.absolute()
    existing = next(path for path in (absolute, *absolute.parents) if path.exists())
    free = shutil.disk_usage(existing).free / 1e9
    ok = free >= _MIN_DISK_GB
    remedy = "" if ok else f"free some space: {_MIN_DISK_GB:g} GB are needed"
    return Finding("disk", ok, f"{free:.1f} GB free at {existing}", remedy)


def available_memory_gb() -> float | None:
    """Memory that new work may take; None where the system does not say."""
    try:
        text = Path("/proc/meminfo").read_text(encoding="ascii")
    except OSError:
        return None
    match = re.search(r"^MemAvailable:\s+(\d+) kB", text, re.MULTILINE)
    return int(match[1]) * 1024 / 1e9 if match else None


def _installed() -> list[tuple[str, str]]:
    return sorted({(canonicalize_name(d.name), d.version) for d in distributions() if d.name})


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
