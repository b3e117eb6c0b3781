"""The notebook of the documentation runs as a whole, and is kept without output."""

import os
import re
from pathlib import Path
from typing import Any

import pytest

nbformat = pytest.importorskip("nbformat")
ROOT = Path(__file__).parents[1]
NOTEBOOK = ROOT / "docs" / "notebook.ipynb"
SECONDS = 600


@pytest.fixture(scope="module")
def notebook() -> Any:
    return nbformat.read(NOTEBOOK, as_version=4)


def test_it_is_kept_without_output(notebook: Any) -> None:
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(cells) == 10
    assert not [cell for cell in cells if cell.outputs or cell.execution_count]


def test_its_links_lead_to_pages(notebook: Any) -> None:
    text = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    links = re.findall(r"\]\((?!http)([^)#]+)", text)
    assert links
    assert all((NOTEBOOK.parent / link).is_file() for link in links)


def test_the_page_has_the_same_cells(notebook: Any) -> None:
    """`python docs/notebook.py` writes the page, with what the cells show."""
    page = (ROOT / "docs" / "notebook.md").read_text(encoding="utf-8")
    assert re.findall(r"```python\n(.*?)\n```", page, re.DOTALL) == [
        cell.source for cell in notebook.cells if cell.cell_type == "code"
    ]
    assert all(cell.source in page for cell in notebook.cells if cell.cell_type == "markdown")


@pytest.mark.slow
def test_it_runs(notebook: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    monkeypatch.setenv("PYTHONPATH", f"{ROOT}{os.pathsep}{ROOT / 'verify'}")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=SECONDS, resources=resources).execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    kinds = [kind for output in shown for kind in output.get("data", {})]
    assert kinds.count("image/png") == 6  # a plot, both photographs, four views
    assert kinds.count("text/html") == 2  # the design's map, the table
    printed = "".join(output.get("text", "") for output in shown)
    assert re.search("coverage, spheres.*limit 60", printed)
    assert "valid: True" in printed
    plain = "".join(output.get("data", {}).get("text/plain", "") for output in shown)
    assert "True" in plain
    assert "cameras.csv" in plain
