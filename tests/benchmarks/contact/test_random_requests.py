"""Random requests: what is counted, what is kept, what is ended."""

import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from benchmarks.contact import random_requests
from benchmarks.contact.random_requests import (
    BudgetRequest,
    RandomRequest,
    TooLong,
    budget_request,
    budget_table,
    expected_work,
    kinds_of,
    request,
    requests,
    scene_of,
    table,
    true_error,
    until,
)
from slipcore.contact.errors import InfeasibleLoad, OutOfReach
from slipcore.contact.plan.plan import Plan
from slipcore.contact.tiers import requests as runs
from slipcore.contact.tiers.accuracy import Difference, Refined
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.probe import ContactProbe
from slipcore.frames import GraspLog

ANSWERED = RandomRequest(0, ("FiniteLayer",), "answered", 0.1, 0.04, 0.02, 1.0)


def test_estimates_are_counted_within_a_factor_of_three_and_below_a_third() -> None:
    made = [
        ANSWERED,
        replace(ANSWERED, seed=1, estimated=0.09, true=0.02),
        replace(ANSWERED, seed=2, kinds=(), estimated=0.04, true=0.15),
        replace(ANSWERED, seed=3, kinds=(), became="refused"),
        replace(ANSWERED, seed=4, became="infeasible"),
    ]
    whole, layered = table(made, range(5)).splitlines()[2:]
    assert whole == "| all | 5 | 4 | 3 | 1 | 0 | 67 % | 33 % | 33 % | 2.0 | 1.0 |"
    assert layered == "| FiniteLayer | 0 | 2 | 2 | 0 | 0 | 100 % | 50 % | 0 % | 3.2 | 1.0 |"


def test_requests_begin_with_the_cheapest_and_go_on_where_they_ended(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[int] = []

    def counted(seed: int, _: float) -> RandomRequest:
        asked.append(seed)
        return replace(ANSWERED, seed=seed)

    monkeypatch.setattr(random_requests, "request", counted)
    monkeypatch.setattr(random_requests, "expected_work", lambda seed: -seed)
    requests(tmp_path / "requests.json", range(3), 1.0)
    made = requests(tmp_path / "requests.json", range(1, 5), 1.0)
    assert asked == [2, 1, 0, 4, 3]
    assert {entry.seed for entry in made} == {1, 2, 3, 4}
    assert ANSWERED in requests(tmp_path / "requests.json", range(5), 1.0)


def test_refused_and_long_scenes_are_counted_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*_: object, **__: object) -> None:
        raise OutOfReach("accuracy", 0.1, 0.2, 5.0)

    monkeypatch.setattr(random_requests, "simulate_to", refuses)
    assert request(0, 1.0).became == "refused"
    monkeypatch.undo()
    assert request(0, 0.0).became == "too long"
    with pytest.raises(TooLong):
        until(-np.inf)(0.5)


@pytest.mark.parametrize(
    ("cells", "coupled", "finer"),
    [(20, False, 80), (50, False, 150), (60, False, 150), (94, False, 188), (20, True, 80), (34, True, 100)],
)
def test_the_truth_is_on_a_finer_grid_in_half_the_steps(
    monkeypatch: pytest.MonkeyPatch, cells: int, coupled: bool, finer: int
) -> None:
    ran: list[Fidelity] = []
    monkeypatch.setattr(random_requests, "run", lambda _, fidelity, __: ran.append(fidelity))
    monkeypatch.setattr(random_requests, "difference", lambda *_: Difference(0.1, 0.2, 0.0))
    found = Refined(cast("GraspLog", None), Fidelity(cells, 2, 1e-3), Difference(0.1, 0.1, 0.1), 1.0)
    assert (
        true_error(cast("Plan", SimpleNamespace(problem=SimpleNamespace(coupled=coupled))), found, lambda _: None)
        == 0.2
    )
    assert ran == [Fidelity(finer, 4, 1e-3)]


def test_a_scene_should_cost_more_with_the_effects_that_take_iterations() -> None:
    plain = min(range(20), key=expected_work)
    assert not {"NormalTangentialCoupling", "VelocityFriction", "long"} & set(kinds_of(plain))
    dearest = max(range(20), key=expected_work)
    assert "NormalTangentialCoupling" in kinds_of(dearest)
    assert expected_work(dearest) > 10.0 * expected_work(plain)


def test_every_eighth_scene_is_held_for_longer() -> None:
    assert [scene_of(seed).duration for seed in range(6, 9)] == [2.0, 8.0, 2.0]


def test_budgets_are_counted_by_what_of_them_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    made = [BudgetRequest(seed, 4.0, used, 0.02) for seed, used in enumerate((3.0, 3.6, 4.0, 4.7, 4.9, 0.0))]
    assert budget_table(made).splitlines()[2] == "| 6 | 1 | 3 | 1 | 1 | 0.75 | 1.00 | 1.23 | 0.020 |"
    assert len(budget_table([]).splitlines()) == 2
    for error, expected in (
        (OutOfReach("seconds", 4.0, 9.0, 9.0), BudgetRequest(0, 4.0, 0.0, 0.0)),
        (InfeasibleLoad(np.zeros(3), 0.5), None),
    ):
        monkeypatch.setattr(random_requests, "simulate_to", lambda *_, error=error, **__: (_ for _ in ()).throw(error))
        assert budget_request(0, 4.0) == expected


def test_budgets_run_by_processor_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a log in which the other programs of a machine take up all of its time."""

    def takes_long(*_: object, **__: object) -> Refined:
        clock = runs.Runs(ContactProbe(1e-3), 1.0, lambda _: None)
        time.sleep(0.3)
        return Refined(cast("GraspLog", None), Fidelity(20), Difference(0.1, 0.1, 0.1), clock.spent)

    monkeypatch.setattr(random_requests, "simulate_to", takes_long)
    made = budget_request(0, 1.0)
    assert made is not None
    assert made.used < 0.2
