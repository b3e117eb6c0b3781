"""Write what has a record elsewhere: the glossary, the table of verify/README.md.

    python docs/reference.py

tests/app/reference compares them with their records.
"""

from pathlib import Path

from tbcad_verify.report.methods import markdown_tables

from tbcad.app.reference.entries import glossary_page

ROOT = Path(__file__).parents[1]


def pages() -> dict[Path, str]:
    """The text of each page."""
    readme = ROOT / "verify" / "README.md"
    return {
        ROOT / "docs" / "glossary.md": glossary_page(),
        readme: with_table(readme, "checks", markdown_tables()),
    }


def with_table(page: Path, name: str, table: str) -> str:
    """The text of a page with what stands between the comments of a name replaced."""
    begin, end = (f"<!-- {name}: {one} -->\n" for one in ("begin", "end"))
    before, _, rest = page.read_text(encoding="utf-8").partition(begin)
    return before + begin + table + end + rest.partition(end)[2]


if __name__ == "__main__":
    for page, text in pages().items():
        page.write_text(text, encoding="utf-8")
