"""What commands that ask a service say in words, without a service."""

import json
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict
from unittest.mock import Mock

import pytest

from service.cli import main, remote
from stiction_client.records import NextGrasp

TOLD = NextGrasp(
    "paper", "ols", 3, 0.05, 5e-4, 4e-3, 0.9, 4.5, 0.06, 0.04, 0.31, "not identified", "record more grasps"
)
Say = Callable[..., str]


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Mock:
    told = Mock()
    monkeypatch.setattr(remote, "connected", lambda *_: nullcontext(told))
    return told


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str]) -> Say:
    def command(*arguments: str) -> str:
        with pytest.raises(SystemExit) as ending:
            main([*arguments])
        assert not ending.value.code
        return capsys.readouterr().out

    return command


def test_the_grasp_to_record_next_is_told_in_words_with_its_units(client: Mock, say: Say) -> None:
    client.next_grasp.return_value = TOLD
    lines = " ".join(say("next", "paper", "--load", "1").split())
    for words in (
        "press with 0.0500 N an element",
        "slip by 0.500 mm at 4.00 mm/s, towards 0.900 rad",
        "takes 4.50 s",
        "known to ± 0.0600 now, ± 0.0400 after that",
        "support not identified: record more grasps",
    ):
        assert words in lines
    assert json.loads(say("next", "paper", "--json")) == asdict(TOLD)


def test_what_is_not_given_is_asked_for_as_a_planner_does(client: Mock, say: Say) -> None:
    client.next_grasp.return_value = TOLD
    say("next", "paper")
    client.next_grasp.assert_called_once_with(
        "paper", None, 0.0, 1e-2, 60, method="auto", load=0.0, drop_probability=1e-3
    )
