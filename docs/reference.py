"""Write the pages that have a record elsewhere: glossary, and tables of verify/README.md.

    python docs/reference.py

tests/app/reference compares them with their records.
"""

import re
from pathlib import Path

from tbcad_verify.report.methods import AS_BUILT, EXPORT, markdown_table

from tbcad.app.reference.entries import glossary_page

ROOT = Path(__file__).parents[1]
HEADS = {EXPORT: ("check", "method", "tolerance"), AS_BUILT: ("check", "figure", "limit")}


def pages() -> dict[Path, str]:
    """The text of each page."""
    readme = ROOT / "verify" / "README.md"
    text = readme.read_text(encoding="utf-8")
    for table, head in HEADS.items():
        first = re.escape(f"| {' | '.join(head)} |")
        begin, end = next(re.finditer(rf"^{first}\n(\|.*\n)+", text, re.MULTILINE)).span()
        text = text[:begin] + markdown_table(table, head) + text[end:]
    return {ROOT / "docs" / "glossary.md": glossary_page(), readme: text}


if __name__ == "__main__":
    for page, text in pages().items():
        page.write_text(text, encoding="utf-8")
