from dataclasses import replace

import numpy as np
import pytest

import estimators
from db.records import SamplesOfLog
from service.domain import same_grasp
from service.domain.same_grasp import fingerprint, with_copies
from slipcore import GraspLog
from slipcore.samples import FrictionSamples
from stiction_client.support import notes


def single(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32).astype(np.float64)


def test_times_places_names_and_precision_leave_the_fingerprint_as_it_is(
    ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert ramp.force is not None
    own = fingerprint(ramp)
    others = (
        replace(ramp, time=ramp.time + 1000.0),
        replace(ramp, position=2.0 * ramp.position, displacement=1.1 * ramp.displacement),  # another pitch and rest
        replace(ramp, sensor="other", metadata={"run": "2"}, truth=None),
        replace(ramp, displacement=single(ramp.displacement), force=single(ramp.force)),
        replace(ramp, force=np.where(ramp.force == 0.0, -0.0, ramp.force)),
    )
    assert {fingerprint(other) for other in others} == {own}
    monkeypatch.setattr(same_grasp, "FRAMES", 7)
    assert fingerprint(ramp) == own


def test_noise_an_element_and_a_frame_make_another_fingerprint(ramp: GraspLog) -> None:
    assert ramp.force is not None
    noise = np.random.default_rng(1).normal(0.0, 1e-6, ramp.force.shape)
    turned = replace(ramp, force=ramp.force.swapaxes(1, 2))
    others = (replace(ramp, force=ramp.force + noise), ramp.take(slice(-1)), turned)
    assert len({fingerprint(ramp), *map(fingerprint, others)}) == 4


def test_without_forces_displacements_are_compared(ramp: GraspLog) -> None:
    bare = replace(ramp, force=None)
    assert fingerprint(replace(bare, time=ramp.time + 1.0)) == fingerprint(bare) != fingerprint(ramp)
    assert fingerprint(replace(bare, displacement=1.001 * ramp.displacement)) != fingerprint(bare)


def test_a_note_names_the_copies_and_what_to_do() -> None:
    v, f_n, mu = (np.random.default_rng(2).uniform(0.1, 1.0, 50) for _ in range(3))
    samples = FrictionSamples(mu, v, f_n, mu * f_n, v, np.arange(50) % 9, np.ones(50), 1e-6)
    model = estimators.fit([samples], method="ols")
    alone = SamplesOfLog("a", "blob", None)
    assert with_copies(model, [alone]) is model
    (told,) = notes(with_copies(model, [alone, replace(alone, copies=("b",))]).diagnostics)
    assert told == "1 log repeats the measurements of another log: counted once (b of a); " + same_grasp.REMEDY
    (told,) = notes(with_copies(model, [replace(alone, copies=tuple("bcdefgh"))]).diagnostics)
    assert told.startswith("7 logs repeat ")
    assert "f of a, 2 more)" in told
