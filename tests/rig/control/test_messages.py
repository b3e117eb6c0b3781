"""Lines as the manuals of GRBL 1.1h and grblHAL show them."""

import pytest

from tbcad.rig.control.messages import UNKNOWN, Status, meaning, parse


@pytest.mark.parametrize(
    ("line", "kind", "code"),
    [
        ("ok", "ok", 0),
        ("error:20", "error", 20),
        ("ALARM:9", "alarm", 9),
        ("Grbl 1.1h ['$' for help]", "banner", 0),
        ("GrblHAL 1.1f ['$' or '$HELP' for help]", "banner", 0),
        ("$100=250.000", "setting", 100),
        ("[MSG:'$H'|'$X' to unlock]", "other", 0),
        (">G54G20:ok", "other", 0),
        ("okay", "other", 0),
        ("<broken", "other", 0),
    ],
)
def test_kind_and_code(line: str, kind: str, code: int) -> None:
    found = parse(line)
    assert (found.kind, found.code) == (kind, code)


def test_status_report() -> None:
    found = parse("<Hold:0|MPos:5.000,2.000,0.000|FS:500,8000|WCO:1.500,0.000,0.000>").status
    assert found is not None
    assert (found.state, found.substate) == ("Hold", 0)
    assert found.place("MPos", "X") == 5
    assert found.place("WCO", "X") == 1.5
    assert found.place("WPos", "X") is None
    assert found.place("MPos", "A") is None


def test_status_report_with_damaged_numbers() -> None:
    assert parse("<Idle|MPos:5.0,x>").status == Status("Idle", None, {"MPos": ()})


def test_meanings() -> None:
    assert "homing is not enabled" in meaning(parse("error:5"))
    assert "beyond the soft limits" in meaning(parse("ALARM:2"))
    assert meaning(parse("error:250")) == meaning(parse("ALARM:250")) == UNKNOWN
