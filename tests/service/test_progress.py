"""A command that takes long says so; one that does not stays quiet."""

import time

import pytest

from service.cli import progress
from service.cli.progress import patience


def test_a_command_says_how_long_it_has_been_at_it_and_stays_quiet_if_quick(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with patience("thinking"):
        pass
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr(progress, "MOMENT", 0.05)
    with patience("thinking"):
        time.sleep(0.2)
    out, err = capsys.readouterr()
    assert out == ""
    assert "thinking: 0 s" in err
    assert err.endswith("\n")
