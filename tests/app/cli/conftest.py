"""Commands as they are typed, and what they print."""

from typing import Any

import pytest

from tbcad.app.cli import run
from tests.app.cli.commands import Command


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str]) -> Command:
    """Run a command of words, which is to end with a code; gives what it printed."""

    def command(*words: object, code: int = 0) -> Any:
        capsys.readouterr()
        assert run([*map(str, words)]) == code
        return capsys.readouterr()

    return command
