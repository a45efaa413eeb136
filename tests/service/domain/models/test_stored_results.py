import math
from dataclasses import fields, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

import estimators
import slipcore
import stiction_client
from db.records import StoredModel
from service.domain.models import stored_results
from service.http.schemas.models import FrictionModelOut
from slipcore import FrictionSamples, GraspLog, SlipHistory
from slipcore.patch_record import REGIMES


@pytest.fixture(scope="module")
def history(ramp: GraspLog) -> SlipHistory:
    return slipcore.detect_slip(ramp)


@pytest.fixture(scope="module")
def samples(ramp: GraspLog, history: SlipHistory) -> FrictionSamples:
    return slipcore.collect_samples(ramp, history)


def test_samples_come_back_to_the_last_bit(samples: FrictionSamples, tmp_path: Path) -> None:
    path = tmp_path / "samples"
    path.write_bytes(stored_results.encode_samples(samples))
    found = stored_results.decode_samples(path)
    assert len(samples) > 0
    for entry in fields(FrictionSamples):
        if entry.name == "sensor":  # which the log's record has
            continue
        stored, original = getattr(found, entry.name), getattr(samples, entry.name)
        np.testing.assert_array_equal(stored, original)
        assert np.asarray(stored).dtype == np.asarray(original).dtype


def test_a_history_comes_back_to_the_last_bit(history: SlipHistory, tmp_path: Path) -> None:
    path = tmp_path / "history"
    path.write_bytes(stored_results.encode_history(history))
    found = stored_results.decode_history(path)
    np.testing.assert_array_equal(found.time, history.time)
    np.testing.assert_array_equal(found.stick_ratio, history.stick_ratio)
    assert found.contact is not None
    assert found.slip is not None
    np.testing.assert_array_equal(found.contact, history.contact)
    np.testing.assert_array_equal(found.slip, history.slip)
    for kind in stored_results.EVENT_KINDS:
        np.testing.assert_array_equal(getattr(found.events, kind).element, getattr(history.events, kind).element)
        np.testing.assert_array_equal(getattr(found.events, kind).time, getattr(history.events, kind).time)


def test_contact_patches_come_back_with_their_frames_and_regimes(history: SlipHistory, tmp_path: Path) -> None:
    (patch,) = history.patches
    two = replace(history, patches=(patch, replace(patch, first=patch.first + 1)))
    (tmp_path / "history").write_bytes(stored_results.encode_history(two))
    found = stored_results.decode_history(tmp_path / "history").patches
    assert found is not None
    frames = np.arange(patch.first, patch.first + len(patch.pose))
    np.testing.assert_array_equal(found.frame, [*frames, *(frames + 1)])
    np.testing.assert_array_equal(found.patch, np.repeat([0, 1], len(frames)))
    np.testing.assert_array_equal(found.pose, np.concatenate([patch.pose, patch.pose]))
    assert [REGIMES[code] for code in found.regime] == [*patch.regime, *patch.regime]


def test_a_history_without_patches_has_none(history: SlipHistory, tmp_path: Path) -> None:
    (tmp_path / "history").write_bytes(stored_results.encode_history(replace(history, patches=())))
    found = stored_results.decode_history(tmp_path / "history").patches
    assert found is not None
    assert len(found.frame) == len(found.pose) == 0


def test_a_history_with_maps_of_an_older_version_has_no_patches(history: SlipHistory, tmp_path: Path) -> None:
    arrays = stored_results._unpack(_stored(history, tmp_path))
    with (tmp_path / "older").open("wb") as stream:
        for array in arrays[:-4]:
            np.save(stream, array, allow_pickle=False)
    found = stored_results.decode_history(tmp_path / "older")
    assert found.patches is None
    np.testing.assert_array_equal(found.slip, history.slip)


def _stored(history: SlipHistory, folder: Path) -> Path:
    (folder / "history").write_bytes(stored_results.encode_history(history))
    return folder / "history"


def test_a_history_of_an_older_version_has_no_maps(history: SlipHistory, tmp_path: Path) -> None:
    events = [getattr(history.events, kind) for kind in stored_results.EVENT_KINDS]
    arrays = [history.time, history.stick_ratio, *(part for each in events for part in (each.element, each.time))]
    path = tmp_path / "history"
    with path.open("wb") as stream:
        for array in arrays:
            np.save(stream, array, allow_pickle=False)
    found = stored_results.decode_history(path)
    assert (found.contact, found.slip) == (None, None)
    np.testing.assert_array_equal(found.events.release.time, history.events.release.time)


def test_the_same_results_are_the_same_bytes(samples: FrictionSamples, history: SlipHistory) -> None:
    assert stored_results.encode_samples(samples) == stored_results.encode_samples(samples)
    assert stored_results.encode_history(history) == stored_results.encode_history(history)


def test_a_history_is_summed_up(history: SlipHistory) -> None:
    found = stored_results.summarise_history(history, 0.25, "0" * 64)
    assert found.contact_frames == int(history.contact.any(axis=(1, 2)).sum())
    assert found.stick_ratio_min == np.nanmin(history.stick_ratio)
    assert found.macro_slip_frames == int(history.macro_slip.sum())
    assert (found.onsets, found.touches) == (len(history.events.onset), len(history.events.touch))
    assert (found.method, found.seconds, found.history_blob) == (history.method, 0.25, "0" * 64)


def test_a_history_without_contact_has_no_numbers_for_it(history: SlipHistory) -> None:
    assert stored_results.summarise_history(history, 0.0, "", is_scaled=False).noise is None
    nothing = replace(history, stick_ratio=np.full(len(history.time), np.nan), noise=math.nan)
    found = stored_results.summarise_history(nothing, 0.0, "")
    assert (found.contact_frames, found.stick_ratio_min, found.noise) == (0, None, None)


def test_samples_are_summed_up(samples: FrictionSamples) -> None:
    found = stored_results.summarise_samples(samples, None, "0" * 64)
    assert found.count == len(samples)
    assert found.friction_coefficient_mean == samples.friction_coefficient.mean()
    assert found.tangential_velocity == (samples.tangential_velocity.min(), samples.tangential_velocity.max())
    assert found.normal_force == (samples.normal_force.min(), samples.normal_force.max())


@pytest.mark.parametrize("degrees_of_freedom", [12.5, math.inf])
def test_a_stored_model_predicts_as_the_fitted_one(samples: FrictionSamples, degrees_of_freedom: float) -> None:
    fitted = replace(estimators.fit(samples), degrees_of_freedom=degrees_of_freedom)
    found = stored_results.to_friction_model(stored_results.to_new_model(fitted))
    v, f_n = 1e-3, 0.05
    assert found.predict(v, f_n) == fitted.predict(v, f_n)
    assert found.predict(v, f_n, quantile=0.05) == fitted.predict(v, f_n, quantile=0.05)
    assert math.isfinite(float(found.predict(v, f_n, quantile=0.05)))


def test_diagnostics_that_json_cannot_say_are_left_empty(samples: FrictionSamples) -> None:
    fitted = replace(estimators.fit(samples), diagnostics={"rhat": math.nan, "why": "short", "n": 3.0})
    assert stored_results.to_new_model(fitted).diagnostics == {"rhat": None, "why": "short", "n": 3.0}


def test_samples_keep_their_kind(samples: FrictionSamples, tmp_path: Path) -> None:
    path, kind = tmp_path / "samples", np.where(np.arange(len(samples)) % 3 == 0, "contact", "element")
    path.write_bytes(stored_results.encode_samples(replace(samples, kind=kind)))
    assert stored_results.decode_samples(path).kind.tolist() == kind.tolist()


def test_samples_keep_that_their_velocities_are_relative(samples: FrictionSamples, tmp_path: Path) -> None:
    path, contact = tmp_path / "samples", np.arange(len(samples)) % 3 == 0
    relative = replace(samples, kind=np.where(contact, "contact", "element"), velocity_is_relative=~contact)
    path.write_bytes(stored_results.encode_samples(relative))
    np.testing.assert_array_equal(stored_results.decode_samples(path).velocity_is_relative, ~contact)
    for grasp, told in ((samples, False), (relative, True), (samples.take(np.zeros(len(samples), bool)), None)):
        assert stored_results.summarise_samples(grasp, None, "0" * 64).velocity_is_relative is told


def test_samples_stored_without_their_noise_are_still_read(samples: FrictionSamples, tmp_path: Path) -> None:
    path = tmp_path / "samples"
    arrays = [getattr(samples, name) for name in stored_results.SAMPLE_ARRAYS[:-2]]
    path.write_bytes(stored_results._pack([*arrays, np.array(samples.element_area)]))
    found = stored_results.decode_samples(path)
    assert (found.element_area, found.normal_force_noise, found.velocity_noise) == (samples.element_area, 0.0, 0.0)
    assert set(found.kind) == {"element"}
    assert not found.velocity_is_relative.any()
    np.testing.assert_array_equal(found.normal_force, samples.normal_force)


@pytest.mark.parametrize("method", ["ols", "hierarchical"])
def test_a_planner_has_the_model_that_the_service_answers_with(samples: FrictionSamples, method: str) -> None:
    fitted = estimators.fit([replace(samples, time=samples.time + 9.0 * part) for part in range(3)], method=method)
    model = stored_results.to_new_model(fitted)
    stored = StoredModel(1, "paper", 3, True, False, datetime(2026, 11, 21, 8, 41, tzinfo=UTC), model)
    told = stiction_client.FrictionModel.from_json(FrictionModelOut.of(stored).model_dump(mode="json")).to_json()
    made = stored_results.to_client_model(stored).to_json()
    assert datetime.fromisoformat(made.pop("created_at")) == datetime.fromisoformat(told.pop("created_at"))
    assert made == told
