"""The benchmark of campaigns: rates, and a picture of all cases."""

import pytest

from benchmarks.contact import campaigns
from benchmarks.contact.campaigns import Rate, draw, warm
from slipcore.contact import Scene
from tests.executors import Here


def test_a_rate_is_in_logs_an_hour() -> None:
    assert Rate("processes", 2, "npz", 120, 36.0).per_hour == pytest.approx(12_000.0, rel=1e-12)


def test_each_worker_simulates_before_the_clock_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds: list[int] = []
    monkeypatch.setattr(campaigns, "simulate", lambda _scene, seed: seeds.append(seed))
    warm(Here(), 2)
    assert seeds == list(range(8))
    assert Scene.from_toml(campaigns.SCENE).name


def test_a_picture_has_a_bar_for_each_case_and_format() -> None:
    found = [Rate(by, 1, form, 10, 1.0) for by in ("processes", "Dask") for form in ("npz", "parquet")]
    (axes,) = draw(found).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["processes, 1", "Dask, 1"]
    assert len(axes.patches) == 4
