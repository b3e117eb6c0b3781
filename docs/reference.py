"""Write the pages that have a record elsewhere: glossary, and tables of verify/README.md.

    python docs/reference.py

tests/app/reference compares them with their records.
"""

import re
import tomllib
from pathlib import Path

from tbcad_verify.report.methods import AS_BUILT, EXPORT, markdown_table

from tbcad.app.reference.entries import glossary_page

ROOT = Path(__file__).parents[1]
FREE_KEYS = ROOT / "verify" / "tbcad_verify" / "record" / "free_keys.toml"
HEADS = {EXPORT: ("check", "method", "tolerance"), AS_BUILT: ("check", "figure", "limit")}


def pages() -> dict[Path, str]:
    """The text of each page."""
    readme = ROOT / "verify" / "README.md"
    text = readme.read_text(encoding="utf-8")
    for table, head in HEADS.items():
        first = re.escape(f"| {' | '.join(head)} |")
        begin, end = next(re.finditer(rf"^{first}\n(\|.*\n)+", text, re.MULTILINE)).span()
        text = text[:begin] + markdown_table(table, head) + text[end:]
    begin, end = next(re.finditer(r"^\| keys \| why \|\n(\|.*\n)+", text, re.MULTILINE)).span()
    text = text[:begin] + free_keys() + text[end:]
    return {ROOT / "docs" / "glossary.md": glossary_page(), readme: text}


def free_keys() -> str:
    """The keys of a design that the verification does not read, and why."""
    rows = tomllib.loads(FREE_KEYS.read_text(encoding="utf-8"))["keys"]
    lines = [
        f"| {', '.join(f'`{name}`' for name in one['names'])} | {one['why']} |" for one in rows
    ]
    return "\n".join(["| keys | why |", "|---|---|", *lines]) + "\n"


if __name__ == "__main__":
    for page, text in pages().items():
        page.write_text(text, encoding="utf-8")
