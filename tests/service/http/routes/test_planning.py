from collections.abc import Callable
from dataclasses import replace
from typing import Any

import httpx
import numpy as np
import pytest

from db.records import NewModel, StoredModel
from service.domain.planning import plan
from slipcore import GraspLog
from stiction_client import FrictionClient, Scale, SensorFriction, SensorScale, grasp, required_normal_force
from stiction_client.container import encode

Wait = Callable[[httpx.Client, str], dict[str, Any]]
LOAD = {"material": "fitted", "tangential_load": 0.5, "contact_area": 1e-4}

pytestmark = pytest.mark.usefixtures("fitted")


@pytest.mark.parametrize(
    ("more", "fingers"),
    [
        ({}, {}),
        ({"slip_probability": 0.01, "tangential_velocity": 1e-4, "normal_force_limit": 50.0}, {}),
        ({"torque": 1e-3, "safety_factor": 1.5}, {"fingers": 2, "round_at": 5.0}),
        ({"torque": 1e-3}, {"fingers": 3, "object_radius": 0.03}),
        ({"of": "contact", "elements": 30.0}, {}),
    ],
)
def test_the_grasp_force_is_the_planners_own(
    client: httpx.Client, more: dict[str, Any], fingers: dict[str, float]
) -> None:
    answer = client.post("/v1/grasp-force", json=LOAD | more | fingers)
    assert answer.status_code == 200, answer.text
    told = answer.json()
    with FrictionClient(str(client.base_url)) as planner:
        model = planner.model("fitted")
        expected = required_normal_force(model, 0.5, contacts=grasp(1e-4, **fingers), **more)
    assert told["normal_force"] == expected.normal_force
    assert told["feasible_interval"][0] == expected.normal_force
    assert (told["material"], told["method"], told["version"]) == ("fitted", model.method, model.version)
    assert told["chosen_because"].startswith(f"{model.method}: ")
    named = client.post("/v1/grasp-force", json=LOAD | more | fingers | {"method": "ols"}).json()
    assert (named["method"], named["chosen_because"]) == ("ols", None)
    assert (told["of"], told["elements"]) == (expected.of, expected.elements)
    assert told["friction_coefficient"] == pytest.approx(expected.friction_coefficient)


def test_without_a_model_a_planner_is_told_what_the_load_of_a_held_contact_says(
    client: httpx.Client, ramp: GraspLog, upload: Callable[..., httpx.Response], wait: Wait
) -> None:
    """A contact that was pressed and pulled at so little that it gives no sample."""
    still = replace(ramp.take(slice(0, 60)), truth=None)
    client.post("/v1/materials", json={"name": "held"}).raise_for_status()
    accepted = upload(client, encode(still), material="held")
    job = wait(client, accepted.json()["job"]["id"])
    assert job["status"] == "refused"
    assert "friction is at least 0.2" in job["reason"]
    answer = client.post("/v1/grasp-force", json=LOAD | {"material": "held"})
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/no-model")
    told = "of its newest grasps the one that held best bore a load for which friction was at least 0.2"
    assert told in answer.json()["detail"]
    assert still.force is not None
    doubtful = replace(
        still, force=still.force * np.array([1e3, 1e3, 1.0])
    )  # in mN: by its findings no bound is believed
    wait(client, upload(client, encode(doubtful), material="held").json()["job"]["id"])
    again = client.post("/v1/grasp-force", json=LOAD | {"material": "held"})
    assert again.json()["detail"] == answer.json()["detail"]


def test_a_load_that_no_force_holds_is_refused_with_the_most_that_is_held(client: httpx.Client) -> None:
    answer = client.post("/v1/grasp-force", json=LOAD | {"tangential_load": 100.0, "normal_force_limit": 1.0})
    problem = answer.json()
    assert (answer.status_code, problem["type"]) == (409, "/problems/no-feasible-force")
    assert 0.0 < problem["largest_load"] < 1.0
    assert problem["cause"] == "limit"
    assert problem["normal_force"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("path", "body", "status", "kind"),
    [
        ("grasp-force", LOAD | {"material": "felt"}, 404, "unknown-material"),
        ("grasp-force", LOAD | {"method": "conjugate"}, 409, "no-model"),
        ("grasp-force", LOAD | {"method": "guess"}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"contact_area": 0.0}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"contact_area": 1e30}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"of": "grasp"}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"elements": 0.5}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"fingers": 0}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"fingers": True}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"object_radius": 0.0}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"safety_factor": 0.5}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"tangential_load": -1.0}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"slip_probability": 0.6}, 422, "invalid-request"),
        ("grasp-force", LOAD | {"force": 1.0}, 422, "invalid-request"),
        ("recognise", {}, 422, "invalid-request"),
        ("recognise", {"grasp_log": "nothing"}, 404, "unknown-grasp-log"),
        ("recognise", {"grasp_log": "nothing", "materials": ["felt"]}, 404, "unknown-material"),
        ("recognise", {"grasp_log": "nothing", "materials": []}, 422, "invalid-request"),
        ("recognise", {"grasp_log": "nothing", "unknown": 1.0}, 422, "invalid-request"),
        ("recognise", {"grasp_log": "nothing", "method": "conjugate"}, 409, "no-model"),
    ],
)
def test_a_question_that_cannot_be_is_refused(
    client: httpx.Client, path: str, body: dict[str, Any], status: int, kind: str
) -> None:
    answer = client.post(f"/v1/{path}", json=body)
    assert (answer.status_code, answer.json()["type"]) == (status, f"/problems/{kind}"), answer.text


def test_a_grasp_is_recognised_from_its_log_and_from_its_samples(
    client: httpx.Client, material: str, fitted: dict[str, Any]
) -> None:
    client.put(f"/v1/materials/{material}/aliases/alias%20of%20{material}").raise_for_status()
    of_log = client.post("/v1/recognise", json={"grasp_log": fitted["id"], "materials": ["fitted", material]})
    assert of_log.status_code == 200, of_log.text
    told = of_log.json()
    (candidate,) = told["candidates"]
    assert (candidate["material"], candidate["method"], candidate["version"]) == ("fitted", "hierarchical", 1)
    assert candidate["probability"] > 0.9
    by_ols = client.post("/v1/recognise", json={"grasp_log": fitted["id"], "materials": ["fitted"], "method": "ols"})
    assert [each["method"] for each in by_ols.json()["candidates"]] == ["ols"]
    assert candidate["probability"] + told["unknown"] == pytest.approx(1.0)
    few = {
        name: value[:400] if isinstance(value, list) else value for name, value in samples_of(client, fitted).items()
    }
    of_samples = client.post("/v1/recognise", json={"samples": few, "materials": ["fitted", "fitted"]})
    assert of_samples.json()["candidates"][0]["material"] == "fitted"
    with FrictionClient(str(client.base_url)) as planner:
        assert planner.recognise(fitted["id"], ["fitted"]).probability == {"fitted": candidate["probability"]}


def test_more_candidates_than_are_compared_at_once_are_to_be_named(
    client: httpx.Client, fitted: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plan, "MOST_CANDIDATES", 0)
    answer = client.post("/v1/recognise", json={"grasp_log": fitted["id"], "materials": ["fitted"]})
    assert (answer.status_code, "name those that it may be" in answer.text) == (422, True), answer.text


def test_a_surface_that_is_none_of_them_is_unknown(client: httpx.Client, fitted: dict[str, Any]) -> None:
    samples = samples_of(client, fitted)
    slippery = samples | {"friction_coefficient": [value / 4.0 for value in samples["friction_coefficient"]]}
    told = client.post("/v1/recognise", json={"samples": slippery, "materials": ["fitted"]}).json()
    assert told["unknown"] > 0.9


def test_a_grasp_is_compared_as_its_own_sensor_shows_each_material(
    client: httpx.Client, fitted: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the fitted material one sensor shows a quarter of what all others do."""
    candidates = plan._candidates

    def with_a_dull_sensor(context: Any, names: Any, method: str) -> list[StoredModel]:
        return [replace(each, model=shown_by_dull(each.model)) for each in candidates(context, names, method)]

    monkeypatch.setattr(plan, "_candidates", with_a_dull_sensor)
    samples = samples_of(client, fitted)
    slippery = samples | {"friction_coefficient": [value / 4.0 for value in samples["friction_coefficient"]]}
    asked = {"samples": slippery, "materials": ["fitted"]}
    unknown = [client.post("/v1/recognise", json=asked | by).json()["unknown"] for by in ({}, {"sensor": "dull"})]
    assert unknown[0] > 0.9
    assert unknown[1] < 0.1
    with FrictionClient(str(client.base_url)) as planner:
        assert planner.recognise(fitted["id"], ["fitted"]).unknown < 0.1
        assert planner.recognise(fitted["id"], ["fitted"], sensor="dull").unknown > 0.9


def test_a_stored_log_is_compared_as_its_sensor_shows_each_material(
    client: httpx.Client, fitted: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    candidates = plan._candidates

    def with_its_sensor_dull(context: Any, names: Any, method: str) -> list[StoredModel]:
        found = candidates(context, names, method)
        return [replace(each, model=shown_by_dull(each.model, fitted["sensor"])) for each in found]

    monkeypatch.setattr(plan, "_candidates", with_its_sensor_dull)
    told = client.post("/v1/recognise", json={"grasp_log": fitted["id"], "materials": ["fitted"]}).json()
    assert told["unknown"] > 0.9


def shown_by_dull(model: NewModel, name: str = "dull") -> NewModel:
    """The model of several sensors, of which the one of this name shows a quarter of the friction."""
    assert model.scales is not None
    friction = SensorFriction(
        gain=-0.75,
        standard_error=0.01,
        coefficients=tuple(np.array(model.coefficients) / 4.0),
        covariance=tuple(map(tuple, np.array(model.covariance) / 16.0)),
        degrees_of_freedom=np.inf,
        scale=model.scale,
        scatter_degrees_of_freedom=np.inf,
    )
    told = SensorScale(Scale(0.01, np.inf), {name: friction}).to_json()
    return replace(model, scales=replace(model.scales, between_sensors=told))


@pytest.mark.parametrize(
    ("change", "status", "kind"),
    [
        ({"weight": []}, 422, "invalid-request"),
        ({"normal_force": ["much"]}, 422, "invalid-request"),
        ({"element_area": 0.0}, 422, "invalid-request"),
        (None, 422, "invalid-samples"),
    ],
)
def test_samples_that_cannot_be_are_refused(
    client: httpx.Client, fitted: dict[str, Any], change: dict[str, Any] | None, status: int, kind: str
) -> None:
    samples = samples_of(client, fitted)
    none = {name: [] if isinstance(value, list) else value for name, value in samples.items()}
    body = {"samples": none if change is None else samples | change, "materials": ["fitted"]}
    answer = client.post("/v1/recognise", json=body)
    assert (answer.status_code, answer.json()["type"]) == (status, f"/problems/{kind}"), answer.text


def samples_of(client: httpx.Client, log: dict[str, Any]) -> dict[str, Any]:
    samples: dict[str, Any] = client.get(f"/v1/grasp-logs/{log['id']}/samples").json()
    return samples
