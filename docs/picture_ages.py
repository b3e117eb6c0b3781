"""Make the documentation's pictures again, and tell which are older than what they show.

    tbcad build --n 18 --out exports/
    python docs/picture_ages.py exports/                 # those that follow from a build: minutes
    python docs/picture_ages.py exports/ rig sides       # only these
    python docs/picture_ages.py exports/ --made capture  # made by its command: note what it shows
    python docs/picture_ages.py exports/ --check         # exit code 1 where one is old; CI runs it

docs/picture_ages.toml has each picture's command and what it shows of the paper's design;
docs/picture_ages.json a digest of that as it was when the picture was made. Places are compared
to a millimetre, mirrors to a hundredth: what is smaller is not seen.
"""

import hashlib
import json
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from tbcad.records.tables import BallRow, MirrorRow
from tbcad.report.page.bodies import prototype_bodies

DOCS = Path(__file__).parent
PICTURES, ROWS, NOTED = (
    DOCS / "pictures",
    DOCS / "picture_ages.toml",
    DOCS / "picture_ages.json",
)
UNSEEN = re.compile(r"<(script|style|svg)\b.*?</\1>|<[^>]*>|[\d.]+", re.DOTALL)
OFF_MM = 0.13  # so that lengths in halves of a millimetre are not rounded up here and down there
PLACES = re.compile(r"\b(BUILD|TEMP|FILE|STEM)\b")  # in a command


def rows() -> dict[str, dict[str, Any]]:
    """What docs/picture_ages.toml says of each picture, by its name without suffix."""
    return tomllib.loads(ROWS.read_text(encoding="utf-8"))


def noted() -> dict[str, dict[str, str]]:
    """Digests as they were when each picture was made."""
    found: dict[str, dict[str, str]] = json.loads(NOTED.read_text(encoding="utf-8"))
    return found


def digest(lines: Iterable[str]) -> str:
    """A short digest of lines, in any order."""
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()[:12]


def _machine(build: Path) -> Iterable[str]:
    for body in prototype_bodies(build):
        ends = (body.vertices.min(axis=0), body.vertices.max(axis=0))
        yield f"{body.name} {[[round(float(x) + OFF_MM) for x in end] for end in ends]}"


def _mirrors(build: Path) -> Iterable[str]:
    for row in MirrorRow.read(build):
        yield f"{row.id} {row.radius_mm and round(row.radius_mm, 2)}"


def _balls(build: Path) -> Iterable[str]:
    return (f"{row.number} {row.kind} {row.size}" for row in BallRow.read(build))


def _page(build: Path) -> Iterable[str]:
    """Words of the report as far as its picture reaches, without figures."""
    text = (build / "report.html").read_text(encoding="utf-8").partition('<section id="checks"')[0]
    yield " ".join(UNSEEN.sub(" ", text).split())


SHOWN: dict[str, Callable[[Path], Iterable[str]]] = {
    **{"machine": _machine, "mirrors": _mirrors},
    **{"balls": _balls, "page": _page},
}


def shown(build: Path) -> dict[str, str]:
    """Digests of what pictures of a build show."""
    return {what: digest(lines(build)) for what, lines in SHOWN.items()}


def old_pictures(now: dict[str, str]) -> dict[str, str]:
    """Pictures that show another state than the present one, and why they are known to."""
    then = noted()
    return {
        name: row.get("old", "")
        for name, row in rows().items()
        if any(then.get(name, {}).get(what) != now[what] for what in row["shows"])
    }


def note(names: Iterable[str], now: dict[str, str]) -> None:
    """Note what pictures show that were just made."""
    then, told = noted(), rows()
    then |= {name: {what: now[what] for what in told[name]["shows"]} for name in names}
    text = json.dumps(dict(sorted(then.items())), indent=1)
    NOTED.write_text(text + "\n", encoding="utf-8")


def make(name: str, command: str, build: Path) -> None:
    """Make a picture by its command."""
    file = PICTURES / f"{name}.png"
    with tempfile.TemporaryDirectory() as temp:
        places = {"BUILD": build, "TEMP": temp, "FILE": file, "STEM": file.with_suffix("")}
        filled = PLACES.sub(lambda found: str(places[found[0]]), command)
        subprocess.run(["bash", "-euc", filled], check=True, cwd=DOCS.parent)


def main(build: Path, words: list[str]) -> int:
    """Make, note or check."""
    names, now, told = [word for word in words if not word.startswith("--")], shown(build), rows()
    if "--check" in words:
        old = old_pictures(now)
        for name, why in old.items():
            print(f"{name}: {'older' if why else 'OLD'}: {why or told[name]['by']}")
        return int(not all(old.values()))
    for name in names or [name for name, row in told.items() if "BUILD" in row["by"]]:
        if "--made" not in words:
            print(name, flush=True)
            make(name, told[name]["by"], build)
        note([name], now)
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2:]))
