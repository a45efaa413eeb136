"""What is worth asking for, and that errors and seconds are those of the settings."""

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from estimators import FrictionModel, fit
from service.report import work_precision
from service.report.work_precision import Setting, WorkPrecision
from slipcore import GraspLog, InvalidInput, collect_samples, detect_slip
from slipcore.contact import Scene, tangential_ramp


def ignored(_: float) -> None:
    """Of no concern here."""


@pytest.fixture(scope="module")
def log() -> GraspLog:
    return tangential_ramp(points=10, friction=0.5, marker_noise=1e-6, force_noise=2e-3)


@pytest.fixture(scope="module")
def model(log: GraspLog) -> FrictionModel:
    return fit(collect_samples(log, detect_slip(log)), method="hierarchical")


def test_only_what_nothing_beats_is_worth_asking_for() -> None:
    settings = (
        Setting("quick", 1.0, 0.5),
        Setting("as quick, worse", 1.0, 0.6),
        Setting("slow", 4.0, 0.1),
        Setting("slower and worse", 5.0, 0.2),
        Setting("the same again", 4.0, 0.1),
        Setting("compared with", 9.0, math.nan),
    )
    assert WorkPrecision("all", "error", settings).worth_asking() == (True, False, True, False, True, True)


def test_a_scene_is_refined_as_long_as_its_seconds_last() -> None:
    told: list[float] = []
    found = work_precision.of_scene(Scene.from_toml("table1_condition1"), 0.05, 0, told.append)
    by_tier = {each.ask: each.error for each in found.settings if "tier" in each.ask}
    assert by_tier == {'--tier "closed form"': pytest.approx(0.0275), '--tier "beams"': 0.5}
    grids = [each for each in found.settings if "accuracy" in each.ask]
    assert len(grids) == 1, "one is always made"
    assert float(grids[0].ask.split()[1]) >= grids[0].error > 0.0
    with pytest.raises(InvalidInput, match="seconds"):
        work_precision.of_scene(Scene.from_toml("table1_condition1"), 0.0, 0, ignored)


@pytest.mark.parametrize("after", [0, 1])
def test_ctrl_c_keeps_what_was_found_until_then(after: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object) -> Iterator[Setting]:
        yield from [Setting("a", 1.0, 0.5)][:after]
        raise KeyboardInterrupt

    monkeypatch.setattr(work_precision, "_ever_finer", stopped)
    with pytest.raises(KeyboardInterrupt) as end:
        work_precision.of_scene(Scene.from_toml("table1_condition1"), 1.0, 0, ignored)
    found = getattr(end.value, "found", None)
    assert (found is None) == (after == 0)
    assert found is None or [each.ask for each in found.settings] == ["a"]


def test_detectors_are_compared_with_truth_or_with_the_default(log: GraspLog) -> None:
    with_truth = work_precision.of_detection(log, "ramp", ignored)
    errors = {each.ask: each.error for each in with_truth.settings}
    history = detect_slip(log, "rigid_fit", lookahead=32)
    assert log.truth is not None
    wrong = (history.slip != log.truth.slip_contact_factor)[log.truth.contact].mean()
    assert errors["--method rigid_fit"] == pytest.approx(wrong)
    assert errors["--method filter"] < errors["--method rigid_fit"]
    first, *others = work_precision.of_detection(replace(log, truth=None), "ramp", ignored).settings
    assert (first.ask, first.told, math.isnan(first.error)) == ("--method filter", work_precision.COMPARED, True)
    assert all(0.0 <= each.error < 1.0 for each in others)


def test_fits_are_compared_with_the_exact_posterior(log: GraspLog, model: FrictionModel) -> None:
    told: list[float] = []
    found = work_precision.of_fits([collect_samples(log, detect_slip(log))], "ramp", told.append)
    by_ask = {each.ask: each for each in found.settings}
    assert by_ask["--method hierarchical"].told.startswith(f"μ = {model.predict(*_middle(model)):.4f} ± ")
    assert math.isnan(by_ask["--method hierarchical"].error)
    assert max(each.error for each in found.settings if "bayes" in each.ask) < 0.2
    assert told[-1] == 1.0


def test_models_of_a_service_say_what_they_took(log: GraspLog, model: FrictionModel) -> None:
    least_squares = fit(collect_samples(log, detect_slip(log)), method="ols")
    found = work_precision.of_models("paper", [least_squares, model])
    first, second = found.settings
    assert (first.ask, first.seconds, second.seconds) == (
        "--method ols",
        least_squares.cost.seconds,
        model.cost.seconds,
    )
    assert (math.isnan(second.error), first.error > 0.0) == (True, True)
    alone = work_precision.of_models("paper", [least_squares])
    assert ("by ols" in alone.measure, math.isnan(alone.settings[0].error)) == (True, True)


def _middle(model: FrictionModel) -> tuple[float, float]:
    v, force = (0.5 * sum(ends) for ends in (model.domain.tangential_velocity, model.domain.normal_force))
    return v, force


def test_the_picture_has_a_point_for_each_setting_with_an_error() -> None:
    settings = (Setting("quick", 1.0, 0.5), Setting("slow", 4.0, 0.1), Setting("compared with", 1.0, math.nan))
    found = [WorkPrecision("one", "its error", settings), WorkPrecision("two", "another", settings[:1])]
    first, second = work_precision.draw(found).axes
    assert [text.get_text() for text in first.texts] == ["1", "2"]
    assert [text.get_text() for text in first.get_legend().get_texts()] == ["1: quick", "2: slow"]
    assert ("its error" in first.get_title(), [text.get_text() for text in second.texts]) == (True, ["1"])
