"""The design file that tbcad init writes."""

import re
import tomllib
from pathlib import Path

import pytest

from tbcad.app.reference.keys import ELSEWHERE, design_template, key_sections
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import PAPER, load_spec, shipped_designs

NAMES = list(shipped_designs())
KEYS = [key for section in key_sections() for key in section.keys]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "design.toml"


@pytest.mark.parametrize("name", NAMES[:2])
class TestTemplate:
    def test_gives_the_design_that_it_begins_from(self, name: str, file: Path) -> None:
        file.write_text(design_template(name), encoding="utf-8")
        assert load_spec(file) == load_spec(Path(name))

    def test_gives_the_same_with_every_key_set(self, name: str, file: Path) -> None:
        """What is a comment is a key and its default."""
        text = re.sub(r"^# (\w+ = )", r"\1", design_template(name), flags=re.MULTILINE)
        file.write_text(text, encoding="utf-8")
        assert load_spec(file) == load_spec(Path(name))
        assert sum(text.count(f"\n{key.name.rpartition('.')[2]} = ") for key in KEYS) >= len(KEYS)

    def test_tells_all_about_every_key(self, name: str, file: Path) -> None:
        text = " ".join(re.sub(r"^# ?", "", design_template(name), flags=re.MULTILINE).split())
        for key in KEYS:
            assert key.description in text
            assert f"Allowed: {key.allowed}" in text

    def test_keeps_what_the_design_says(self, name: str, file: Path) -> None:
        """Every comment, but for where the keys are that it leaves out: here they are all."""
        template = design_template(name)
        lines = shipped_designs()[name].read_text(encoding="utf-8").splitlines()
        assert f"# {ELSEWHERE}" in lines
        assert ELSEWHERE not in template
        for line in lines:
            assert not line.startswith("# ") or line == f"# {ELSEWHERE}" or line in template


def test_the_main_keys_are_set() -> None:
    table = tomllib.loads(design_template())
    assert table["optics"]["n"] == 18
    assert set(table["mirrors"]) == {"radius_rule", "margin_mm"}
    assert load_spec(None) == Spec()


def test_names_of_designs_are_those_of_their_files() -> None:
    assert NAMES[0] == PAPER
    assert {"afternoon-print", "mukaigawa-flat", "sensor-10mp"} <= set(NAMES)
