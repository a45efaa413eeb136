"""What the page of a material draws its samples from."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import estimators
from db.records import NewModel
from service.domain.models.stored_results import to_new_model
from service.web import samples
from slipcore.samples import FrictionSamples
from tests.service.web.test_frames import unpacked

ROWS, COLUMNS = 3, 4
LAW = np.array([0.5, 4.0, -0.6])


def grasp(seed: int, noise: float = 0.02, of_contact: int = 0) -> FrictionSamples:
    """Samples of the law on a lattice of 3 × 4 elements; the last few of whole contacts."""
    rng = np.random.default_rng([seed, 5])
    n = 240
    v, f_n, place = rng.uniform(1e-4, 5e-3, n), rng.uniform(0.05, 0.2, n), rng.integers(0, ROWS * COLUMNS, n)
    place[n - of_contact :] = ROWS * COLUMNS
    kind = np.where(np.arange(n) < n - of_contact, "element", "contact")
    mu = LAW @ [np.ones(n), v, f_n] + noise * rng.standard_normal(n)
    return FrictionSamples(mu, v, f_n, mu * f_n, 3.0 + np.arange(n) * 0.01, place, np.ones(n), 1e-6, kind=kind)


@pytest.fixture(scope="module")
def model() -> NewModel:
    return to_new_model(estimators.fit([grasp(k) for k in range(4)], "hierarchical"))


def packed(model: NewModel, *logs: FrictionSamples, grid: tuple[int, int] = (ROWS, COLUMNS)) -> Any:
    return unpacked(samples.pack(model, [(each, grid) for each in logs]))


def test_samples_stand_beside_the_models_plane_and_band(model: NewModel) -> None:
    seen = grasp(0)
    header, found = packed(model, seen)
    np.testing.assert_allclose(found["friction"], seen.friction_coefficient, rtol=1e-6)
    plane = [np.ones(len(seen)), found["velocity"], found["force"]]
    np.testing.assert_allclose(found["residual"], found["friction"] - np.array(model.coefficients) @ plane, atol=1e-6)
    v, f_n = np.meshgrid(found["lattice_velocity"], found["lattice_force"], indexing="ij")
    law = np.array(model.coefficients) @ np.stack([np.ones(v.size), v.ravel(), f_n.ravel()])
    np.testing.assert_allclose(found["mean"], law, rtol=1e-5)
    assert (found["low"] < found["mean"]).all()
    assert (found["mean"] < found["high"]).all()
    assert v.max() == pytest.approx(seen.tangential_velocity.max())
    assert found["seconds"].min() == 0.0
    assert found["seconds"].max() == pytest.approx(2.39)
    assert header["share"] == pytest.approx(found["outside"].mean())
    assert 0.02 < header["share"] < 0.2


def test_a_place_that_errs_is_seen_where_it_is(model: NewModel) -> None:
    seen = grasp(1, noise=0.0)
    wrong = replace(seen, friction_coefficient=seen.friction_coefficient + 0.2 * (seen.element == 7))
    _, found = packed(model, wrong)
    assert len(found["place_residual"]) == ROWS * COLUMNS
    assert int(np.argmax(found["place_residual"])) == 7
    assert found["place_residual"][7] == pytest.approx(0.2, abs=0.05)


def test_places_without_samples_and_samples_of_whole_contacts_are_on_no_place(model: NewModel) -> None:
    seen = grasp(2, of_contact=5)
    _, found = packed(model, seen.take((seen.element != 3) | (seen.kind == "contact")))
    assert np.flatnonzero(np.isnan(found["place_residual"])).tolist() == [3]
    assert np.isfinite(found["residual"]).all()


def test_by_place_counts_the_newest_sensors_lattice_alone(model: NewModel) -> None:
    other = grasp(3, noise=0.0)
    other = replace(other, friction_coefficient=other.friction_coefficient + 1.0)
    newest = grasp(4, noise=0.0)
    header, found = unpacked(samples.pack(model, [(newest, (ROWS, COLUMNS)), (other, (2, 9))]))
    assert (header["rows"], header["columns"], header["logs"]) == (ROWS, COLUMNS, 2)
    assert np.abs(found["place_residual"]).max() < 0.1


def test_many_samples_are_thinned_out_and_counted(model: NewModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(samples, "MOST_SAMPLES", 100)
    header, found = packed(model, grasp(5), grasp(6))
    assert (header["of"], len(found["friction"])) == (480, 96)


def test_unknown_velocities_are_drawn_at_rest_and_told(model: NewModel) -> None:
    seen = grasp(7)
    header, found = packed(model, replace(seen, velocity_is_relative=np.ones(len(seen), bool)), grasp(8))
    assert header["at_rest"] == 1
    assert (found["velocity"][: len(seen)] == 0.0).all()


def test_elements_of_another_area_count_at_the_models(model: NewModel) -> None:
    seen = grasp(9)
    (_, same), (_, larger) = packed(model, seen), packed(model, seen.at_element_area(4e-6))
    np.testing.assert_allclose(larger["force"], same["force"], rtol=1e-5)
    np.testing.assert_allclose(larger["residual"], same["residual"], atol=1e-6)


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_the_file_of_a_fitted_material_is_kept_until_something_changes(client: Any, fitted: Any) -> None:
    path = f"/materials/{fitted['material']}/samples"
    answer = client.get(path)
    header, found = unpacked(answer.content)
    assert (answer.status_code, header["logs"]) == (200, 1)
    assert len(found["friction"]) > 50
    assert client.get(path, headers={"if-none-match": answer.headers["etag"]}).status_code == 304
    assert client.get(f"{path}?method=ols").headers["etag"] != answer.headers["etag"]


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_without_a_model_or_samples_there_is_no_file(browser: Any, add: Callable[..., int]) -> None:
    add("cardboard")
    assert browser.get("/materials/cardboard/samples").status_code == 409
    assert browser.get("/materials/nothing/samples").status_code == 404
    assert 'class="samples"' not in browser.get("/materials/cardboard").text
