"""The public interface: names, import time, reprs, docstrings, and the README's example."""

import doctest
import inspect
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import tbcad
from tbcad.errors import InputError
from tbcad.records.tables import MirrorRow

ROOT = Path(__file__).parents[2]
HEAVY = {"numpy", "scipy", "OCP", "build123d", "cadquery", "h5py", "numba", "pydantic", "rich"}


def test_import_loads_no_heavy_library() -> None:
    code = "import sys, tbcad; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True
    ).stdout.split()
    assert not HEAVY & set(loaded)
    assert "tbcad.app.api" not in loaded


def test_public_names_are_documented_and_no_modules() -> None:
    for name in {*tbcad.__all__} - {"__version__"}:
        assert len(inspect.getdoc(getattr(tbcad, name)) or "") > 40, name
        assert name in dir(tbcad)
        assert find_spec(f"tbcad.{name}") is None


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'desing'"):
        _ = tbcad.desing  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["tbcad", "tbcad.app.api.designs"])
def test_examples_in_docstrings(name: str) -> None:
    module = __import__(name, fromlist=["design"])
    tried = doctest.testmod(module)
    assert tried.failed == 0
    assert tried.attempted > 0


def test_mirrors_as_a_table() -> None:
    """The columns of mirrors.csv, a row for each mirror of both cameras."""
    small = tbcad.design(n=2)
    table = small.to_dataframe()
    assert list(table.index) == [*small.a.ids, *small.b.ids]
    assert table.columns.to_list() == [name for name in MirrorRow.columns() if name != "id"]
    assert (table.loc["a0003", ["px", "py", "pz"]] == small.a.mirrors.apex[2]).all()


def test_a_table_without_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pip install pandas"):
        tbcad.design(n=2).to_dataframe()


def test_short_reprs() -> None:
    """No object that a notebook shows prints its arrays."""
    small = tbcad.design(n=2)
    shown = (small, small.a, small.a.mirrors, small.a.cells, small.spec)
    assert all(len(repr(one)) < 120 for one in shown)


@pytest.mark.slow
@pytest.mark.usefixtures("standing")
def test_example_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    example = re.search(r"<!-- test: example -->\n```python\n(.*?)```", text, re.DOTALL)
    assert example is not None
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(example[1], names)
    result, field = names["result"], names["field"]
    assert isinstance(result, tbcad.Build)
    assert result.passed
    assert (tmp_path / "small" / "shell_a.step").is_file()
    assert isinstance(field, tbcad.LightField)
    spec = tbcad.load_spec(None)
    for value in (spec, names["design"], names["array"], result, result.report, field):
        assert len(repr(value)) < 250


@pytest.mark.slow
def test_printed_parts_are_valid_and_assembled() -> None:
    """The post stands on the axis of the object, below it; the carrier is above the base plate."""
    design = tbcad.design(n=3, settings={"capture_diameter_mm": "35", "prototype.k": "4"})
    parts = design.printed_parts()
    assert {"carrier", "bearing_head", "camera_bracket"} <= set(parts)
    assert all(part.is_valid and part.volume > 0 for part in parts.values())
    assert parts["carrier"].label == "carrier"
    floor = design.spec.prototype.frame.floor_mm
    assert all(
        floor - 1e-6 < part.bounding_box().min.Z
        for name, part in parts.items()
        if not name.startswith("coupon")
    )


def test_bad_input_is_one_line() -> None:
    with pytest.raises(InputError, match=r"n and settings go with a design file"):
        tbcad.design(tbcad.load_spec(None), n=4)
    for part in (tbcad.design(n=3).shell, tbcad.design(n=3).mandrel):
        with pytest.raises(InputError, match=r"there is no camera 'c': allowed are 'a' and 'b'"):
            part("c")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"optics\.n is 99"):
        tbcad.design(n=99)


def test_a_function_says_in_one_line_what_it_wants() -> None:
    missing = r"(?i)^[^\n]+(no such f|is not there|is missing)[^\n]+$"
    names = "calibrate dataset intrinsics merge optimize refocus simulate_run tolerance view"
    for name in names.split():
        with pytest.raises(InputError, match=r"\w+ is 3, allowed is [^\n]+: change it$"):
            getattr(tbcad, name)(3)
        with pytest.raises(InputError, match=missing):
            getattr(tbcad, name)("absent")


def test_a_mandrel_is_a_part() -> None:
    part = tbcad.design(n=2).mandrel("b")
    assert part.label == "mandrel_b"
    assert part.is_valid
    assert abs(part.bounding_box().max.X) < 1e-6
