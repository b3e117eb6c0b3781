"""A build whose prototype cannot be made."""

from pathlib import Path

import tbcad

# Camera b is no half turn of camera a: nothing can stand in for both halves.
LEANING = ["n=2", "camera_mm=[100, 5, -100]"]


def test_leaves_the_prototype_out_and_says_why(tmp_path: Path) -> None:
    built = tbcad.build(tbcad.load_spec(None, LEANING), tmp_path / "exports", verify=False)
    assert built.parts == ("shell",)
    assert built.note.startswith("no prototype: a prototype needs cameras that a half turn")
    names = {path.name for path in (tmp_path / "exports").iterdir()}
    assert {"shell_a.step", "design.json", "manifest.json"} <= names
    assert "prototype.json" not in names
