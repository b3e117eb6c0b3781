"""Write the pages that have a record elsewhere: glossary, tables of verify/README.md and fields.md.

    python docs/reference.py

tests/app/reference compares them with their records.
"""

import tomllib
from pathlib import Path

from tbcad_verify.report.methods import markdown_tables

from tbcad.app.reference.entries import glossary_page

ROOT = Path(__file__).parents[1]
FREE_KEYS = ROOT / "verify" / "tbcad_verify" / "record" / "free_keys.toml"


def pages() -> dict[Path, str]:
    """The text of each page."""
    readme, fields = ROOT / "verify" / "README.md", ROOT / "docs" / "fields.md"
    return {
        ROOT / "docs" / "glossary.md": glossary_page(),
        readme: with_table(readme, "checks", markdown_tables()),
        fields: with_table(fields, "free keys", free_keys()),
    }


def with_table(page: Path, name: str, table: str) -> str:
    """The text of a page with what stands between the comments of a name replaced."""
    begin, end = (f"<!-- {name}: {one} -->\n" for one in ("begin", "end"))
    before, _, rest = page.read_text(encoding="utf-8").partition(begin)
    return before + begin + table + end + rest.partition(end)[2]


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
