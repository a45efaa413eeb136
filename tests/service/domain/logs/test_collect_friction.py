"""Why a log says nothing of friction, in the words that whoever sent it reads."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import slipcore
from service.domain.logs import collect_friction
from slipcore import Collected, ContactFriction, GraspLog

SHAPE = (3, 1, 2)
BOUND = ContactFriction(0.4, 0.314, np.inf, is_bound=True, reason="it held")


def log(force: float | None = -1.0, sensor: str = "left", **metadata: str) -> GraspLog:
    place = np.array([[[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0]]])
    forces = None if force is None else np.broadcast_to([0.0, 0.0, force], (*SHAPE, 3)).copy()
    time = np.arange(3.0)
    return GraspLog(time, place, np.zeros((*SHAPE, 3)), 1e-6, force=forces, sensor=sensor, metadata=metadata)


def history(contact: bool = True, slipping: int = 2) -> Any:
    slip = np.zeros(SHAPE, bool)
    slip.flat[:slipping] = True
    return SimpleNamespace(contact=np.full(SHAPE, contact), slip=slip)


@pytest.fixture
def nothing(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Collect nothing, for this reason and with this friction of the contact."""

    def make(left_out: str | None = None, contact: ContactFriction | None = None) -> None:
        none = collect_friction._no_samples(log()).samples
        found = Collected(none, none, contact, left_out)
        monkeypatch.setattr(slipcore, "collect_friction", lambda *_, **__: found)

    make()
    return make


def why(log: GraspLog, history: Any, reconstruction: Any = None) -> str:
    found, because = collect_friction.collect(log, history, reconstruction)
    assert len(found.samples) == len(found.elements) == 0
    assert because is not None
    return because


def test_pixels_give_no_friction() -> None:
    told = "the log's scale is unknown; friction needs velocities in m/s, not pixels a second"
    assert why(log(scale="unknown"), history()) == told


@pytest.mark.parametrize(
    ("sensor", "what"),
    [
        ("left", "describe the gel of sensor 'left', from which forces follow, and send the log again"),
        ("unknown", "describe its gel, from which forces follow, and send the log again with the sensor's name"),
        ("stream", "describe its gel, from which forces follow, and send the log again with the sensor's name"),
    ],
)
def test_without_forces_it_is_said_what_they_may_follow_from(sensor: str, what: str) -> None:
    told = why(log(force=None, sensor=sensor), history())
    begin = "the log has no forces; friction is tangential over normal force. If a sensor sees only its markers move, "
    assert told.startswith(begin + what)


def test_columns_that_were_left_out_are_named_as_far_as_eighty_letters_go() -> None:
    told = why(log(force=None, columns_left_out="f" * 81), history())
    assert f"If they are among the columns that were left out ({'f' * 80}), say which in a mapping. If a sensor" in told


def test_what_never_touched_is_told_with_its_frames() -> None:
    assert why(log(), history(contact=False)) == "no element was in contact in any of the 3 frames"


@pytest.mark.usefixtures("nothing")
def test_what_did_not_slip_enough_is_told_with_how_much_did() -> None:
    told = (
        "no slip gave a friction sample (2 slipping elements in 3 frames); an element counts once all around it slips"
    )
    assert why(log(), history()).startswith(told)
    assert "(0 slipping elements in 3 frames)" in why(log(), history(slipping=0))
    alone = why(log(displacement="none"), history())
    assert alone == "forces alone show slip but no velocity, so there are no friction samples"


def test_a_load_that_was_borne_is_told_beside_the_reason(nothing: Any) -> None:
    nothing("elements roll", BOUND)
    told = why(log(), history())
    assert told == "elements roll; by the load that the contact bore, friction is at least 0.31"


@pytest.mark.usefixtures("nothing")
@pytest.mark.parametrize(("noise", "is_unsure"), [(0.1, False), (0.11, True)])
def test_reconstructed_forces_may_be_too_unsure(noise: float, is_unsure: bool) -> None:
    """An element's largest force, 1 N, against ten times the noise."""
    of_samples = {"force_to_noise": 10.0}
    reconstruction = SimpleNamespace(force_noise=noise, of_samples=of_samples, for_samples=lambda log: log)
    told = why(log(), history(), reconstruction)
    assert ("elements' normal forces follow from displacement to" in told) is is_unsure
    if is_unsure:
        assert "to ± 1.1e+02 mN of at most 1e+03 mN, too unsure for samples; let all of the contact slide" in told


def test_a_log_with_samples_needs_no_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, largest = list[dict[str, Any]](), list[float]()
    some = Collected(SimpleNamespace(__len__=1), None, None, None)._replace(samples=np.ones(4))  # type: ignore[arg-type]

    def collect(seen: GraspLog, _: object, **options: Any) -> Collected:
        assert seen.force is not None
        asked.append(options)
        largest.append(float(np.abs(seen.force).max()))
        return some

    monkeypatch.setattr(slipcore, "collect_friction", collect)
    assert collect_friction.collect(log(), history(), None) == (some, None)
    unsure: Any = SimpleNamespace(
        force_noise=9.0,
        of_samples={"force_to_noise": 10.0},
        for_samples=lambda log: replace(log, force=2.0 * log.force),
    )
    assert collect_friction.collect(log(), history(), unsure) == (some, None)
    assert asked == [{}, {"force_to_noise": 10.0}]
    assert largest[1] == 2.0 * largest[0]  # of samples, averaged alike
