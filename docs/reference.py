"""Write the pages that have a record elsewhere: glossary, and tables of verify/README.md.

    python docs/reference.py

tests/app/reference compares them with their records.
"""

from pathlib import Path

from tbcad_verify.report.methods import markdown_tables

from tbcad.app.reference.entries import glossary_page

ROOT = Path(__file__).parents[1]
BEGIN, END = "<!-- checks: begin -->\n", "<!-- checks: end -->\n"


def pages() -> dict[Path, str]:
    """The text of each page."""
    readme = ROOT / "verify" / "README.md"
    before, _, rest = readme.read_text(encoding="utf-8").partition(BEGIN)
    text = before + BEGIN + markdown_tables() + END + rest.partition(END)[2]
    return {ROOT / "docs" / "glossary.md": glossary_page(), readme: text}


if __name__ == "__main__":
    for page, text in pages().items():
        page.write_text(text, encoding="utf-8")
