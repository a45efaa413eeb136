"""What relaxing a model's grip is worth: which episodes are run, and which are kept."""

from pathlib import Path

import pytest

from benchmarks.control import relaxing
from benchmarks.control.tasks import LIFTS
from stiction_client.controller import gains


def test_each_model_is_right_too_high_and_too_low_and_relaxed_or_not() -> None:
    assert list(relaxing.FACTORS.values()) == [1.0, 1.4, 0.6]
    suffixes = ("", ", not relaxed")
    assert set(relaxing.VARIANTS) == {f"{name}{suffix}" for name in relaxing.FACTORS for suffix in suffixes}
    still = relaxing.VARIANTS["known, not relaxed"].keywords["relax_rate"]
    assert still * 10.0 < 0.02  # of the force, within ten seconds
    assert gains()["relax_rate"].low == still


def test_what_is_kept_is_not_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relaxing, "TASKS", LIFTS[:1])
    monkeypatch.setattr(relaxing, "VARIANTS", {"known": relaxing.VARIANTS["known"]})
    keep = tmp_path / "kept.jsonl"
    first = list(relaxing.episodes(1, keep))
    assert [(each.strategy, each.task, each.seed) for each in first] == [("known", LIFTS[0].name, 0)]
    assert first[0].held
    monkeypatch.setattr(relaxing, "run", None)
    assert next(iter(relaxing.episodes(1, keep)))[:3] == first[0][:3]
