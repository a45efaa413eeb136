import json
import re
from collections.abc import Callable
from dataclasses import fields, replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import estimators
from db.records import StoredModel
from service.domain.models.stored_results import to_friction_model, to_new_model
from service.http.schemas.models import FrictionModelOut
from stiction_client import FrictionModel, InvalidArgument, Scale, Scales, SensorFriction, SensorScale

Make = Callable[..., FrictionModel]


def on_the_service(model: FrictionModel) -> estimators.FrictionModel:
    shared = {field.name for field in fields(estimators.FrictionModel)} & {
        field.name for field in fields(FrictionModel)
    }
    return estimators.FrictionModel(**{name: getattr(model, name) for name in shared})


SCALES = Scales(Scale(0.07, 3.5), Scale(0.02, np.inf), Scale(0.03, 1e4))
LEFT = SensorFriction(
    0.1, 0.02, (0.5, 0.0, -0.1), ((1e-4, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.1)), 9.0, 0.03, np.inf
)
OF_SENSORS = replace(SCALES, between_sensors=SensorScale(Scale(0.08, 3.0), {"left": LEFT}))


@pytest.mark.parametrize("degrees_of_freedom", [1.0, 2.5, 11.0, 1e6, np.inf])
@pytest.mark.parametrize("quantile", [None, 1e-9, 1e-3, 0.05, 0.5, 0.95])
def test_client_and_estimators_predict_the_same(
    make_model: Make, degrees_of_freedom: float, quantile: float | None
) -> None:
    model = make_model(degrees_of_freedom=degrees_of_freedom, scatter_degrees_of_freedom=25.0)
    v, f_n = np.linspace(0.0, 0.01, 7)[:, None], np.linspace(0.0, 1.0, 5)
    expected = on_the_service(model).predict(v, f_n, quantile)
    np.testing.assert_allclose(model.predict(v, f_n, quantile), expected, rtol=1e-12, atol=0)
    assert expected.shape == (7, 5)


@pytest.mark.parametrize(("of", "elements"), [("element", None), ("contact", 1), ("contact", 50)])
@pytest.mark.parametrize("quantile", [None, 1e-3, 0.05, 0.95])
def test_client_and_estimators_predict_the_same_of_contacts(
    make_model: Make, of: str, elements: int | None, quantile: float | None
) -> None:
    model = replace(make_model(), scales=SCALES)
    v, f_n = np.linspace(0.0, 0.01, 7)[:, None], np.linspace(0.0, 1.0, 5)
    expected = on_the_service(model).predict(v, f_n, quantile, of=of, elements=elements)
    np.testing.assert_allclose(model.predict(v, f_n, quantile, of=of, elements=elements), expected, rtol=1e-12, atol=0)


@pytest.mark.parametrize("quantile", [None, 1e-3])
@pytest.mark.parametrize("part", [0.25, 4.0])
def test_a_larger_element_under_the_same_pressure_has_the_same_friction(
    make_model: Make, quantile: float | None, part: float
) -> None:
    model = replace(make_model(), scales=OF_SENSORS)
    other = model.at_element_area(part * model.element_area)
    v, f_n = np.linspace(0.0, 0.01, 7)[:, None], np.linspace(0.0, 1.0, 5)
    for one, two in ((model, other), (model.of_sensor("left"), other.of_sensor("left"))):
        # Of a contact of the same area, whose scatter averages out over as many elements as it has.
        expected = one.predict(v, f_n, quantile, "contact", 60.0)
        np.testing.assert_allclose(two.predict(v, part * f_n, quantile, "contact", 60.0 / part), expected, rtol=1e-12)
    assert other.domain.normal_force == pytest.approx([part * bound for bound in model.domain.normal_force], rel=1e-15)
    back = other.at_element_area(model.element_area)
    np.testing.assert_allclose(back.covariance, model.covariance, rtol=1e-14)
    assert back.coefficients.tolist() == pytest.approx(model.coefficients.tolist(), rel=1e-14)


@pytest.mark.parametrize("area", [0.0, -1e-6, np.inf, np.nan])
def test_an_element_without_an_area_is_refused(make_model: Make, area: float) -> None:
    with pytest.raises(InvalidArgument, match=r"^area is"):
        make_model().at_element_area(area)


@pytest.mark.parametrize(("of", "elements"), [("grasp", 5), ("contact", None), ("contact", 0), ("contact", np.nan)])
def test_what_is_predicted_must_be_known(make_model: Make, of: str, elements: float | None) -> None:
    with pytest.raises(InvalidArgument, match=r"^(of|elements) is"):
        make_model().predict(0.0, 0.1, 0.01, of=of, elements=elements)


def test_a_known_sensor_has_its_own_law_and_another_may_have_any(make_model: Make) -> None:
    alone, model = (replace(make_model(), scales=scales) for scales in (SCALES, OF_SENSORS))
    np.testing.assert_allclose(
        model.scatter(0.01)[0],
        np.hypot(SCALES.between_grasps.quantile(0.01), Scale(0.08, 3.0).quantile(0.01)),
        rtol=1e-12,
    )
    assert model.predict(0.0, 0.1, 0.01) < alone.predict(0.0, 0.1, 0.01)
    right = model.of_sensor("right")
    assert (right.scales, right.coefficients.tolist()) == (model.scales, model.coefficients.tolist())
    assert right.notes == ("no grasp of it is by a sensor 'right': the answer allows for the gain of any sensor",)
    assert "'lefft' (did you mean 'left'?)" in model.of_sensor("lefft").notes[0]
    left = model.of_sensor("left")
    assert left.predict(0.0, 0.1) == pytest.approx(0.49)
    assert (left.scales, left.degrees_of_freedom, left.scale) == (SCALES, 9.0, 0.03)


@pytest.mark.parametrize("scales", [None, SCALES, OF_SENSORS])
def test_a_model_is_the_same_after_the_way_from_a_fit_to_a_planner_and_back(
    make_model: Make, scales: Scales | None
) -> None:
    model = replace(make_model(), scales=scales, diagnostics={"rank": 3.0, "kind": "grasp", "rhat": None})
    fitted = replace(on_the_service(model), diagnostics=model.diagnostics | {"rhat": np.nan})
    once_stored = to_friction_model(to_new_model(fitted))
    stored = StoredModel(7, model.material, model.version, True, False, datetime.now(UTC), to_new_model(once_stored))
    told = FrictionModelOut.of(stored).model_dump(mode="json")
    again = FrictionModel.from_json(told)
    assert again.to_json() == model.to_json() | {"created_at": again.created_at}
    assert FrictionModel.from_json(again.to_json()).to_json() == again.to_json()


def test_a_model_that_an_older_service_tells_has_no_scales(answers: SimpleNamespace) -> None:
    assert "scales" not in answers.model
    assert FrictionModel.from_json(answers.model).scales is None


@pytest.mark.parametrize("level", [0.5, 0.95, 0.999])
def test_client_and_estimators_give_the_same_intervals(make_model: Make, level: float) -> None:
    model = make_model()
    np.testing.assert_allclose(model.interval(level), on_the_service(model).interval(level), rtol=1e-12, atol=0)
    np.testing.assert_allclose(model.standard_errors, np.sqrt([2e-5, 1e-2, 4e-3]), rtol=1e-15, atol=0)


@pytest.mark.parametrize("quantile", [0.0, 1.0, -0.1, 2.0, np.nan])
def test_a_quantile_outside_its_range_is_refused(make_model: Make, quantile: float) -> None:
    with pytest.raises(InvalidArgument, match=r"quantile is .*; allowed: above 0 and below 1"):
        make_model().predict(0.0, 0.1, quantile)
    with pytest.raises(InvalidArgument, match="level is"):
        make_model().interval(quantile)


def test_leaving_the_data_is_named(make_model: Make) -> None:
    model = make_model()
    assert model.extrapolation(1e-3, 0.1) is None
    assert model.extrapolation(0.0, 0.1) is None  # slower than any sample: the limit that a grasp which holds is
    assert model.extrapolation(0.005, 0.1) == "tangential velocity extrapolated to 0.005 m/s, observed 0 to 0.004"
    both = model.extrapolation(0.005, 0.5)
    assert both is not None
    assert both.endswith("; normal force extrapolated to 0.5 N an element, observed 0.002 to 0.3")


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        (("coefficients", 0), True, "coefficients, which is True, no number"),
        (("coefficients", 0), "0.4", "coefficients, which is '0.4', no number"),
        (("coefficients", 0), float("nan"), "coefficients, which is nan"),
        (("covariance", 0, 0), -1.0, "covariance, with the variance -1"),
        (("covariance", 0, 1), 1e-6, "covariance, which is not symmetric"),
        (("covariance", 0, 0), 1e-30, "covariance, by which some friction has a negative variance"),
        (("covariance", 2, 2), float("nan"), "covariance, which is nan"),
        (("scale",), -1.0, "scale, which is -1; allowed: finite, 0 or more"),
        (("degrees_of_freedom",), 0, "degrees_of_freedom, which is 0; allowed: finite, above 0"),
        (("element_area",), 0.0, "element_area, which is 0; allowed: finite, above 0"),
        (("domain", "normal_force"), [0.3, 0.1], "normal_force, from 0.3 to 0.1"),
        (("domain", "normal_force", 0), -0.1, "normal_force, which is -0.1; allowed: finite, 0 or more"),
        (("coefficients", 0), 10**400, "coefficients, which is 1000"),
        (("element_area",), 1e308, "element_area, which is 1e+308; allowed: finite, of a size up to 1e+100"),
        (("n",), 3.7, "n, which is 3.7, no whole number"),
        (("version",), True, "version, which is True, no number"),
        (("material",), ["paper"], "material, which is ['paper'], no text"),
        (("created_at",), None, "created_at, which is None, no text"),
        (("cost", "seconds"), -1.0, "seconds, which is -1; allowed: finite, 0 or more"),
        (("identifiable", 1), "false", "identifiable, which is 'false', neither true nor false"),
        (("scales", "between_sensors", "sensors", "left", "coefficients", 0), True, "coefficients, which is True"),
        (("scales", "between_grasps", "value"), "0.1", "value, which is '0.1', no number"),
    ],
)
def test_a_file_with_what_no_fit_gives_is_refused_by_name(
    make_model: Make, tmp_path: Path, path: tuple[str | int, ...], value: object, told: str
) -> None:
    model = make_model()
    off = np.array([[0.0, 1e-5, 0.0], [1e-5, 0.0, 0.0], [0.0, 0.0, 0.0]])
    replace(model, scales=OF_SENSORS, covariance=model.covariance + off).save(tmp_path / "paper.json")
    FrictionModel.load(tmp_path / "paper.json")
    whole = json.loads((tmp_path / "paper.json").read_text())
    part = whole["model"]
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    (tmp_path / "paper.json").write_text(json.dumps(whole))
    with pytest.raises(InvalidArgument, match=re.escape(told)):
        FrictionModel.load(tmp_path / "paper.json")


def test_a_saved_model_comes_back_to_the_last_bit(make_model: Make, tmp_path: Path) -> None:
    model = replace(make_model(degrees_of_freedom=np.inf), scales=SCALES)
    model.save(tmp_path / "paper.json")
    again = FrictionModel.load(tmp_path / "paper.json")
    assert again.to_json() == model.to_json()
    assert again.degrees_of_freedom == np.inf
    assert again.scales == SCALES
    np.testing.assert_array_equal(again.covariance, model.covariance)
    assert [path.name for path in tmp_path.iterdir()] == ["paper.json"]


def test_of_a_model_that_cannot_be_put_in_place_nothing_stays(make_model: Make, tmp_path: Path) -> None:
    (tmp_path / "paper.json").mkdir()
    with pytest.raises(IsADirectoryError):
        make_model().save(tmp_path / "paper.json")
    assert [path.name for path in tmp_path.iterdir()] == ["paper.json"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "one that FrictionModel.save wrote"),
        ("[]", "one that FrictionModel.save wrote"),
        ("[" * 100_000, "one that FrictionModel.save wrote"),
        ('{"format": "stiction-friction-model", "version": 2, "version": 1}', "version, which stands twice"),
        ('{"format": "stiction-friction-model", "version": true, "model": {}}', "of version 1; save it anew"),
        ('{"format": "stiction-friction-model", "version": 2, "model": {}}', "of version 1; save it anew, or upgrade"),
        ('{"format": "stiction-friction-model", "version": 1, "model": {}}', "a whole model"),
        ('{"format": "stiction-friction-model", "version": 1, "model": null}', "a whole model"),
    ],
)
def test_a_file_that_holds_no_model_is_refused(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "paper.json").write_text(content)
    with pytest.raises(InvalidArgument, match=message):
        FrictionModel.load(tmp_path / "paper.json")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((-1e-3, 0.05), r"^tangential_velocity is -0\.001; allowed: 0 to 1000 m/s, as a magnitude$"),
        ((True, 0.05), r"^tangential_velocity is True; allowed: numbers: "),
        ((0.0, [0.05, "x"]), r"^normal_force is .*; allowed: numbers: 0 to 1e\+300 N an element$"),
        ((0.0, np.nan), r"^normal_force is nan; "),
        ((0.0, 0.05, [0.05, 0.5]), r"^quantile is \[0\.05, 0\.5\]; allowed: above 0 and below 1$"),
        ((0.0, 0.05, True), r"^quantile is True; "),
    ],
)
def test_a_model_is_asked_at_a_velocity_and_a_force(make_model: Make, arguments: Any, message: str) -> None:
    with pytest.raises(InvalidArgument, match=message):
        make_model().predict(*arguments)


@pytest.mark.parametrize("wrong", [{}, None, "wood", [], {"format": "stiction"}])
def test_what_is_no_record_of_a_model_is_refused_as_such(wrong: Any) -> None:
    with pytest.raises(InvalidArgument, match=r"record is one that lacks or garbles .*; allowed: what to_json and the"):
        FrictionModel.from_json(wrong)
