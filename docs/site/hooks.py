"""Hooks of mkdocs: pages from files outside docs/, generated reference pages, links between them.

Pages stay where readers of the repository find them; the site shows each under one address.
"""

import posixpath
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
# Pages of the site by their files in the repository.
OUTSIDE = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "verify/README.md": "verification.md",
    "benchmarks/README.md": "speed.md",
}
ADDRESSES = OUTSIDE | {"docs/decisions": "decisions/index.md"}
SOURCES = {address: name for name, address in OUTSIDE.items()}
FENCE = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?![a-z]+:|#)([^)#\s]+)(#[^)\s]*)?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add pages from outside docs/, generated pages, and every file that a page links to."""
    sys.path.insert(0, str(Path(__file__).parent))  # mkdocs loads hooks one by one, without it
    import reference

    pages = {site: (ROOT / source).read_text("utf-8") for source, site in OUTSIDE.items()}
    pages["decisions/index.md"] = _decisions()
    pages |= reference.pages()
    for address, text in pages.items():
        files.append(File.generated(config, address, content=text))
    for name in sorted(_linked_files(pages)):
        if files.get_file_from_path(_address(name)) is None:
            content = (ROOT / name).read_bytes()
            files.append(File.generated(config, _address(name), content=content))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Links as the site has them."""
    del config, files
    source = _source(page.file.src_uri)
    parts = FENCE.split(markdown)
    return "".join(
        part if part.startswith("```") else LINK.sub(lambda m: _relinked(m, source), part)
        for part in parts
    )


def _relinked(link: re.Match[str], source: str) -> str:
    """A link of a file of the repository, as a link between pages of the site."""
    here = posixpath.dirname(_address(source)) or "."
    target = posixpath.relpath(_address(_target(source, link[1])), here)
    return f"]({target}{link[2] or ''})"


def _target(source: str, link: str) -> str:
    """File of the repository that a link of another one leads to."""
    name = posixpath.normpath(posixpath.join(posixpath.dirname(source), link))
    return name if name in ADDRESSES or not (ROOT / name).is_dir() else f"{name}/manifest.json"


def _address(name: str) -> str:
    """Address of a file of the repository in the site; files outside docs/ keep their folders."""
    return ADDRESSES.get(name, name.removeprefix("docs/"))


def _source(address: str) -> str:
    """File of the repository that a page shows."""
    return SOURCES.get(address, f"docs/{address}")


def _linked_files(pages: dict[str, str]) -> Iterator[str]:
    """Files outside docs/ that pages link to."""
    inside = {f"docs/{path.relative_to(ROOT / 'docs')}" for path in ROOT.glob("docs/**/*.md")}
    texts = {name: (ROOT / name).read_text("utf-8") for name in inside | set(OUTSIDE)}
    texts |= {_source(address): text for address, text in pages.items()}
    for source, text in texts.items():
        for link in LINK.finditer("".join(FENCE.split(text)[::2])):
            name = _target(source, link[1])
            if not name.startswith("docs/") and name not in ADDRESSES and (ROOT / name).is_file():
                yield name


def _decisions() -> str:
    """The list of decisions, by their headings."""
    rows = ["# Decisions", "", "What was chosen, why, and what it costs.", ""]
    for path in sorted(ROOT.glob("docs/decisions/*.md")):
        title = path.read_text("utf-8").splitlines()[0].lstrip("# ")
        rows.append(f"- [{title}]({path.name})")
    return "\n".join(rows) + "\n"
