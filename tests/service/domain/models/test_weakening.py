"""The log that lowers what a planner may count on is named, as long as it does."""

from collections.abc import Sequence

import estimators
from db.records import NewModel
from estimators import FrictionModel, Moments, ScatterPrior
from service.domain.models.stored_results import to_new_model
from service.domain.models.weakening import BEFORE, EFFECT, LOG, SENSOR, with_weakening
from tests.estimators.test_influence import grasp

PRIOR = ScatterPrior()


def fitted(logs: dict[str, Moments], before: Sequence[FrictionModel] = ()) -> list[FrictionModel]:
    """What a fit of these logs stores, beside the models before."""
    models = [estimators.fit(list(logs.values()), method=method) for method in ("hierarchical", "ols")]
    stored: dict[str, NewModel] = {model.method: to_new_model(model) for model in before}
    return with_weakening(models, stored, logs, PRIOR)


def logs(effects: Sequence[float]) -> dict[str, Moments]:
    """A log of each effect, named by its place."""
    return {f"log{k}": grasp(k, effect) for k, effect in enumerate(effects)}


def test_the_log_is_named_with_what_to_do_while_most_of_the_fall_is_its() -> None:
    before = fitted(logs([0.0] * 5))
    assert before[0].notes == ()
    first = fitted(logs([0.0] * 5 + [-0.4]), before)
    told = first[0].diagnostics
    assert told[LOG] == "log5"
    assert -0.45 < float(told[EFFECT]) < -0.2
    assert first[0].notes == (told["weakening"],)
    assert "by log log5" in first[0].notes[0]
    assert "withdraw it if something was wrong" in first[0].notes[0]
    assert LOG not in first[1].diagnostics  # least squares tells no scatter between grasps apart
    second = fitted(logs([0.0] * 5 + [-0.4, 0.0]), first)
    assert second[0].diagnostics[LOG] == "log5"
    assert second[0].diagnostics[BEFORE] == told[BEFORE]
    third = fitted(logs([0.0] * 5 + [-0.4, 0.0, -0.7]), second)
    assert third[0].diagnostics[LOG] == "log7"  # a fall of its own, whatever weakened the model before
    withdrawn = {name: part for name, part in logs([0.0] * 5 + [-0.4, 0.0]).items() if name != "log5"}
    assert fitted(withdrawn, second)[0].notes == ()


def test_a_log_that_agrees_is_not_looked_for() -> None:
    before = fitted(logs([0.0] * 5))
    assert fitted(logs([0.0] * 6), before)[0].notes == ()
    assert fitted(logs([0.0] * 5 + [-0.03]), before)[0].notes == ()  # a fall by 3.5 %


def test_a_log_that_takes_a_fifteenth_is_named() -> None:
    before = fitted(logs([0.0] * 5))
    assert fitted(logs([0.0] * 5 + [-0.05]), before)[0].diagnostics[LOG] == "log5"  # a fall by 6.5 %


def test_no_log_is_blamed_for_being_the_first_of_another_sensor() -> None:
    """That any sensor may grasp now is what weakens the model, whichever log came of it."""
    of_one = {name: part.of_sensor("a") for name, part in logs([0.0] * 5).items()}
    both = of_one | {"log5": grasp(5, 0.3).of_sensor("b")}
    model = fitted(both, fitted(of_one))[0]
    assert model.scales is not None
    assert model.scales.between_sensors is not None
    assert LOG not in model.diagnostics
    assert any("sensor" in note for note in model.notes)


def test_a_fall_of_one_sensor_alone_is_told_with_its_name() -> None:
    """Friction as any sensor shows it falls by less than a twentieth here."""
    steady = {f"log{k}": grasp(k, 0.0).of_sensor("a" if k % 2 else "b") for k in range(12)}
    before = fitted(steady)
    model = fitted(steady | {"log12": grasp(50, -0.08).of_sensor("b")}, before)[0]
    assert model.diagnostics[LOG] == "log12"
    assert f"a planner with the sensor {model.diagnostics[SENSOR]!r} may count on" in model.notes[0]


def test_a_first_fit_has_nothing_to_compare_with() -> None:
    models = [estimators.fit(list(logs([0.0, -0.4]).values()), method="hierarchical")]
    assert with_weakening(models, {}, logs([0.0, -0.4]), PRIOR) == models


def test_no_log_is_named_where_two_fell_as_much() -> None:
    """Without either the other one still lowers what a planner may count on."""
    before = fitted(logs([0.0] * 5))
    model = fitted(logs([0.0] * 5 + [-0.4, -0.4]), before)[0]
    assert model.notes == ()
    assert LOG not in model.diagnostics
