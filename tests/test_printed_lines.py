"""What counts as the same line, and what does not."""

from pathlib import Path

import pytest

from tests.printed_lines import main, same


@pytest.mark.parametrize(
    ("shown", "printed", "alike"),
    [
        ("0.078 mm (median)", "0.079 mm  (median)", True),
        ("0.078 mm (median)", "0.080 mm (median)", False),
        ("1585 highlights", "1586 highlights", True),
        ("1585 highlights", "1485 highlights", False),
        ("PASS: 193 cameras", "FAIL: 193 cameras", False),
        ("5 balls", "5 balls, 2 caps", False),
        ("5 balls", "6 balls", False),
        ("off by 1.4e-07 mm", "off by 1.5e-07 mm", True),
        ("off by 1.4e-07 mm", "off by 1.4e-06 mm", False),
    ],
)
def test_rounding_is_no_difference(shown: str, printed: str, alike: bool) -> None:
    assert same(shown, printed) == alike


def test_files_are_compared_but_for_seconds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown, printed = tmp_path / "shown", tmp_path / "printed"
    shown.write_text("12 s; done\n5 balls\n", encoding="utf-8")
    printed.write_text("7 s; done\n5 balls\n", encoding="utf-8")
    assert main(shown, printed) == 0
    printed.write_text("7 s; done\n6 balls\n", encoding="utf-8")
    assert main(shown, printed) == 1
    assert "> 6 balls" in capsys.readouterr().out
    printed.write_text("7 s; done\n", encoding="utf-8")
    assert main(shown, printed) == 1
