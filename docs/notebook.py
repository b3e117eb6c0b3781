"""Run docs/notebook.ipynb and write what it shows as a page: docs/notebook.md and its pictures.

Run: python docs/notebook.py. The notebook itself is kept without output.
"""

import base64
import re
import tempfile
from pathlib import Path
from typing import Any

import nbclient
import nbformat

DOCS = Path(__file__).parent
NOTEBOOK, PAGE = DOCS / "notebook.ipynb", DOCS / "notebook.md"
PICTURES = DOCS / "pictures"
SVG = re.compile(r"<svg.*?</svg>", re.DOTALL)
NOTE = "*The notebook [notebook.ipynb](notebook.ipynb), as `python docs/notebook.py` ran it.*"


def executed(path: Path = NOTEBOOK) -> Any:
    """The notebook with the output of all cells; it runs in a folder of its own."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        nbclient.NotebookClient(notebook, timeout=600, resources=resources).execute()
    return notebook


def picture(number: str, suffix: str, content: bytes) -> str:
    """Write a picture of the page; its link."""
    name = f"notebook-{number}.{suffix}"
    (PICTURES / name).write_bytes(content)
    return f"![Output of the cell above](pictures/{name})"


def shown(output: Any, number: str) -> str:
    """An output as Markdown; pictures as files."""
    data = output.get("data", {})
    if png := data.get("image/png"):
        return picture(number, "png", base64.b64decode(png))
    html = data.get("text/html", "")
    if SVG.search(html):
        text = SVG.sub("", html).replace("<div>", "").replace("</div>", "")
        return f"{text}\n\n{picture(number, 'svg', SVG.findall(html)[0].encode())}"
    text = output.get("text") or data.get("text/plain", "")
    return f"```text\n{text.rstrip()}\n```"


def page(notebook: Any) -> str:
    """The page: cells and what they show."""
    parts = []
    for number, cell in enumerate(notebook.cells):
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        outputs = [output for output in cell.outputs if output.get("name") != "stderr"]
        names = (f"{number}-{k}" if k > 1 else f"{number}" for k in range(1, len(outputs) + 1))
        parts += map(shown, outputs, names)
    return "\n\n".join([parts[0], NOTE, *parts[1:]]) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(executed()), encoding="utf-8")
