import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from stiction_client import (
    Contact,
    FrictionModel,
    InvalidArgument,
    NoFeasibleForce,
    Scale,
    Scales,
    grasp,
    required_normal_force,
)
from stiction_client.quantile import FrictionQuantile, _peak_of_hyperbola

Make = Callable[..., FrictionModel]

AREA = 6e-5
ELEMENTS = 60.0
"""AREA over the models' element area."""

ZERO = np.zeros((3, 3))

EVERYWHERE = (0.0, 1e15)
"""Normal forces observed, N: none that is asked for lies outside."""


def capacity(model: FrictionModel, force: Any, probability: float, velocity: float = 0.0) -> Any:
    """Load that a contact of AREA holds under ``force`` N, straight from the model's own quantile."""
    elements = AREA / model.element_area
    force = np.asarray(force, float)
    return force * model.predict(velocity, force / elements, probability)


def rounding(model: FrictionModel, force: Any) -> Any:
    """What ``capacity`` may be off by: where the quantile nears 0 it is the difference of numbers of this size."""
    return 1e-13 * np.abs(force * (model.predict(0.0, np.asarray(force) / ELEMENTS) + 1.0))


@st.composite
def models(draw: st.DrawFn) -> FrictionModel:
    """Models of any slope and correlation, on which the capacity may rise, peak, or never get above zero."""
    make = draw(st.just(_make))
    factor = np.array(draw(st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9))).reshape(3, 3)
    factor *= np.array([0.1, 1.0, 0.5])[:, None] * draw(st.sampled_from([0.0, 1e-3, 0.1, 1.0]))
    return make(
        coefficients=(
            draw(st.floats(-0.1, 1.5)),
            draw(st.floats(-5.0, 5.0)),
            draw(st.one_of(st.just(0.0), st.floats(-2.0, 0.5))),
        ),
        covariance=factor @ factor.T,
        scale=draw(st.sampled_from([0.0, 1e-3, 0.02, 0.2])),
        degrees_of_freedom=draw(st.sampled_from([1.0, 3.0, 11.0, 1e4, np.inf])),
        scatter_degrees_of_freedom=draw(st.sampled_from([1.0, 11.0, np.inf])),
        fastest=draw(st.sampled_from([0.0, 5e-4, 1.0])),
        forces=draw(st.sampled_from([(0.0, 1e9), (0.0, 1.0), (0.02, 0.1), (0.3, 0.3)])),
    )


def _make(**parts: Any) -> FrictionModel:
    from stiction_client import Cost, Domain

    return FrictionModel(
        material="x",
        method="ols",
        version=1,
        coefficients=np.array(parts["coefficients"]),
        covariance=np.array(parts["covariance"]),
        scale=parts["scale"],
        n=10,
        degrees_of_freedom=parts["degrees_of_freedom"],
        scatter_degrees_of_freedom=parts["scatter_degrees_of_freedom"],
        domain=Domain((0.0, parts["fastest"]), parts["forces"]),
        identifiable=np.ones(3, bool),
        element_area=1e-6,
        cost=Cost(0.0),
    )


loads = st.floats(1e-3, 30.0)
probabilities = st.sampled_from([1e-6, 1e-3, 0.01, 0.1, 0.5])
velocities = st.sampled_from([0.0, 1e-3, 0.1])
limits = st.one_of(st.none(), st.floats(0.1, 500.0))
search = settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def solve(model: FrictionModel, load: float, probability: float, **options: Any) -> float:
    """The required force, infinite where there is none."""
    try:
        return required_normal_force(model, load, probability, contact_area=AREA, **options).normal_force
    except NoFeasibleForce:
        return np.inf


def test_coulomb_friction_without_uncertainty_is_load_over_friction(make_model: Make) -> None:
    model = make_model((0.4, 0.0, 0.0), ZERO, scale=0.0, normal_force_domain=EVERYWHERE)
    answer = required_normal_force(model, 3.0, contact_area=AREA)
    assert answer.normal_force == pytest.approx(7.5, rel=1e-14)
    assert answer.friction_coefficient == 0.4
    assert answer.feasible_interval[1] == answer.margin == answer.largest_load == np.inf
    assert answer.element_force == pytest.approx(7.5 / ELEMENTS, rel=1e-14)


def test_friction_that_falls_with_force_gives_the_smaller_root_of_the_parabola(make_model: Make) -> None:
    # F (0.5 - F/60) = load: F = 15 ∓ √(225 - 60 load)
    model = make_model((0.5, 0.0, -1.0), ZERO, scale=0.0, normal_force_domain=(0.0, 0.5))
    answer = required_normal_force(model, 3.0, contact_area=AREA)
    root = np.sqrt(225.0 - 180.0)
    assert answer.normal_force == pytest.approx(15.0 - root, rel=1e-13)
    assert answer.feasible_interval == pytest.approx((15.0 - root, 15.0 + root), rel=1e-13)
    assert answer.margin == pytest.approx(2.0 * root, rel=1e-13)
    assert answer.largest_load == pytest.approx(3.75, rel=1e-14)


def test_scatter_and_velocity_enter_the_quantile(make_model: Make) -> None:
    model = make_model((0.5, -10.0, 0.0), ZERO, scale=0.05, scatter_degrees_of_freedom=np.inf)
    answer = required_normal_force(model, 1.0, 0.05, contact_area=AREA, tangential_velocity=0.004)
    assert answer.normal_force == pytest.approx(1.0 / (0.5 - 0.04 - 1.6448536269514722 * 0.05), rel=1e-12)


SCALES = Scales(Scale(0.07, 5.0), Scale(0.02, np.inf), Scale(0.03, 1e3))


@search
@given(models(), velocities, probabilities, st.sampled_from([1.0, 60.0, 1e6]), st.floats(0.0, 2.0))
def test_the_hyperbola_is_the_models_own_quantile_of_a_contact(
    model: FrictionModel, velocity: float, probability: float, elements: float, force: float
) -> None:
    scattering = replace(model, scales=SCALES)
    expected = scattering.predict(velocity, force, probability, of="contact", elements=elements)
    found, _ = FrictionQuantile.of(scattering, velocity, probability, elements)(force)
    size = abs(float(scattering.predict(velocity, force))) + abs(found)
    assert abs(max(found, 0.0) - expected) <= 1e-12 * (size + 1.0)


@search
@given(models(), velocities, probabilities, st.booleans())
def test_numbers_are_answered_as_arrays_are(
    model: FrictionModel, velocity: float, probability: float, scatters: bool
) -> None:
    asked = replace(model, scales=SCALES if scatters else None)
    for contact in (Contact.flat(AREA), Contact.round(AREA, at_force=5.0)):
        options: dict[str, Any] = {"contacts": contact, "torque": 2e-3, "tangential_velocity": velocity}
        many = required_normal_force(asked, np.array([1.5]), probability, **options)
        if np.isnan(many.normal_force[0]):
            with pytest.raises(NoFeasibleForce) as refusal:
                required_normal_force(asked, 1.5, probability, **options)
            assert many.outcome[0] == refusal.value.cause
            continue
        one = required_normal_force(asked, 1.5, probability, **options)
        for name in ("normal_force", "element_force", "friction_coefficient", "elements"):
            assert getattr(many, name)[0] == pytest.approx(getattr(one, name), rel=1e-11), name
        assert many.support[0] == one.support


@pytest.mark.parametrize("load", [1.5, np.float64(1.5)])
def test_one_grasp_is_answered_in_plain_numbers(make_model: Make, load: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Arrays of one, and decompositions of 3 x 3 matrices, took most of the time."""

    def refused(*_: Any, **__: Any) -> None:
        raise AssertionError

    monkeypatch.setattr(np.linalg, "eigh", refused)
    for name in ("where", "asarray", "broadcast_arrays", "hypot", "sum", "any", "clip", "minimum", "einsum"):
        monkeypatch.setattr(np, name, refused)
    answer = required_normal_force(make_model(), load, contact_area=AREA, torque=1e-3)
    assert type(answer.normal_force) is float


@pytest.mark.parametrize("known", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.3, -2.0, 0.7)])
def test_one_unknown_behind_all_coefficients_spreads_as_it_alone_does(
    make_model: Make, known: tuple[float, float, float]
) -> None:
    """Such a covariance has two eigenvalues of 0, and rounding makes them negative as likely as not."""
    way = 0.02 * np.array(known)
    model = make_model((0.5, 0.0, 0.0), np.outer(way, way), scale=0.0, degrees_of_freedom=np.inf)
    quantile = FrictionQuantile.of(model, 1e-3, 0.01)
    for force in (0.01, 0.1):
        spread = 2.3263478740408408 * abs(way @ [1.0, 1e-3, force])
        assert quantile(force)[0] == pytest.approx(0.5 - spread, rel=1e-12)


def test_a_contact_is_the_default_where_the_model_tells_its_scales(make_model: Make) -> None:
    without, scattering = make_model(), replace(make_model(), scales=SCALES)
    answers = {
        of: required_normal_force(scattering, 1.5, contact_area=AREA, of=of) for of in (None, "contact", "element")
    }
    assert answers[None] == answers["contact"]
    assert (answers[None].of, answers[None].elements) == ("contact", pytest.approx(ELEMENTS))
    assert (answers["element"].of, answers["element"].elements) == ("element", 1.0)
    assert answers[None].normal_force < answers["element"].normal_force
    assert required_normal_force(without, 1.5, contact_area=AREA).of == "element"
    of_contact, of_element = (
        required_normal_force(without, 1.5, contact_area=AREA, of=of) for of in ("contact", "element")
    )
    assert of_contact.normal_force == of_element.normal_force  # all scatter is taken as shared


def test_a_flat_contact_holds_its_own_quantile_times_the_force(make_model: Make) -> None:
    model = replace(make_model(), scales=SCALES)
    told = required_normal_force(model, 1.5, 0.01, contact_area=AREA)
    friction = model.predict(0.0, told.normal_force / ELEMENTS, 0.01, of="contact", elements=ELEMENTS)
    assert float(friction) == pytest.approx(told.friction_coefficient, rel=1e-12)
    assert told.normal_force * float(friction) == pytest.approx(1.5, rel=1e-12)


@pytest.mark.parametrize("load", [0.05, 1.5, 4.0])
def test_a_round_contact_never_counts_more_elements_than_it_has(make_model: Make, load: float) -> None:
    model = replace(make_model(), scales=SCALES)
    contact = Contact.round(AREA, at_force=5.0)
    told = required_normal_force(model, load, 0.01, contacts=contact)
    there = contact.elements(told.normal_force, model.element_area)
    assert 0.5 * there < told.elements <= there
    element = contact.element_force(told.normal_force, model.element_area)
    held = told.normal_force * float(model.predict(0.0, element, 0.01, of="contact", elements=there))
    assert load <= held < 1.02 * load
    many = required_normal_force(model, np.array([load, 1e6]), 0.01, contacts=contact)
    assert many.normal_force[0] == pytest.approx(told.normal_force, rel=1e-12)
    assert many.elements[0] == pytest.approx(told.elements, rel=1e-9)
    assert (many.of, many.outcome[1]) == ("contact", "physics")


@pytest.mark.parametrize(("of", "elements", "name"), [("grasp", None, "of"), (None, 0.5, "elements")])
def test_who_slips_must_be_known(make_model: Make, of: str | None, elements: float | None, name: str) -> None:
    with pytest.raises(InvalidArgument, match=f"^{name} is"):
        required_normal_force(make_model(), 1.0, contact_area=AREA, of=of, elements=elements)


def test_a_load_above_the_peak_is_refused_with_the_most_that_can_be_held(make_model: Make) -> None:
    model = make_model((0.5, 0.0, -1.0), ZERO, scale=0.0)
    with pytest.raises(NoFeasibleForce) as caught:
        required_normal_force(model, 3.8, contact_area=AREA)
    assert caught.value.largest_load == pytest.approx(3.75, rel=1e-14)
    assert caught.value.normal_force == pytest.approx(15.0, rel=1e-6)  # a flat peak is known to half the digits
    assert caught.value.least_slip_probability is None  # nothing is uncertain: it slips whatever is accepted
    assert "no normal force holds 3.8 N" in str(caught.value)
    assert "3.75 N, at a normal force of 15 N" in str(caught.value)
    copied = pickle.loads(pickle.dumps(caught.value))
    assert (copied.largest_load, str(copied)) == (caught.value.largest_load, str(caught.value))


@pytest.mark.parametrize("contact", [Contact.flat(AREA), Contact.round(AREA, 5.0)], ids=["flat", "round"])
@pytest.mark.parametrize(("load", "limit"), [(3.0, None), (1.6, 6.0)])
def test_a_refusal_says_which_slip_probability_would_be_held(
    make_model: Make, contact: Contact, load: float, limit: float | None
) -> None:
    """So that a planner can decide whether that is too much, as for an answer that it had before the newest grasp."""
    model, asked = make_model(scale=0.05), {"contacts": contact, "normal_force_limit": limit}
    with pytest.raises(NoFeasibleForce) as caught:
        required_normal_force(model, load, 1e-9, **asked)
    least = caught.value.least_slip_probability
    assert least is not None
    assert f"; with a slip probability of {least:g} it would be held" in str(caught.value)
    assert required_normal_force(model, load, least, **asked).normal_force > 0.0
    with pytest.raises(NoFeasibleForce) as again:
        required_normal_force(model, load, 0.985 * least, **asked)  # three digits, rounded up
    assert again.value.least_slip_probability == least


def test_no_refusal_offers_to_lose_more_than_one_grasp_in_ten(make_model: Make) -> None:
    model, asked = make_model(scale=0.05), {"contact_area": AREA, "normal_force_limit": 6.0}
    assert required_normal_force(model, 2.0, 0.4, **asked).normal_force > 0.0
    for refused in (1e-3, 0.1, 0.12):
        with pytest.raises(NoFeasibleForce) as caught:
            required_normal_force(model, 2.0, refused, **asked)
        assert caught.value.least_slip_probability is None


def test_the_peak_itself_is_still_held(make_model: Make) -> None:
    model = make_model((0.5, 0.0, -1.0), ZERO, scale=0.0)
    answer = required_normal_force(model, 3.75 * (1.0 - 1e-15), contact_area=AREA)
    assert answer.normal_force == pytest.approx(15.0, rel=1e-6)
    assert answer.margin == pytest.approx(0.0, abs=1e-5)


def test_the_most_that_is_held_takes_few_steps(make_model: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    slopes, original = [], FrictionQuantile.second_derivative
    monkeypatch.setattr(
        FrictionQuantile, "second_derivative", lambda q, force: slopes.append(force) or original(q, force)
    )
    model = make_model()
    held = required_normal_force(model, 1.0, 1e-3, contact_area=AREA).largest_load
    assert 2 < len(slopes) < 12  # Newton's method; to halve a bracket until it is known takes fifty
    forces = ELEMENTS * slopes[-1] * np.linspace(0.5, 1.5, 10**5)
    assert held == pytest.approx(np.max(capacity(model, forces, 1e-3)), rel=1e-9)  # so flat is a peak


def test_a_limit_on_the_force_bounds_answer_and_interval(make_model: Make) -> None:
    model = make_model((0.5, 0.0, -1.0), ZERO, scale=0.0)
    answer = required_normal_force(model, 3.0, contact_area=AREA, normal_force_limit=10.0)
    assert answer.feasible_interval[1] == pytest.approx(10.0, rel=1e-15)
    assert answer.largest_load == pytest.approx(10.0 * (0.5 - 1.0 / 6.0), rel=1e-14)
    with pytest.raises(NoFeasibleForce, match=r"normal force up to 5 N\); the largest load held so is 2.08333 N"):
        required_normal_force(model, 3.0, contact_area=AREA, normal_force_limit=5.0)


def test_what_is_to_be_held_beside_the_load_is_named_where_nothing_holds_it(make_model: Make) -> None:
    """A torque was passed over, and the refusal read as if so little load were too much."""
    model = make_model((0.5, 0.0, -1.0), ZERO, scale=0.0)
    contacts = grasp(AREA)
    with pytest.raises(NoFeasibleForce, match=r"holds 0\.1 N \(slip probability 0\.001, beside a torque of 5 N·m\)"):
        required_normal_force(model, 0.1, contacts=contacts, torque=5.0)
    with pytest.raises(NoFeasibleForce, match=r"\(slip probability 0\.001, with a safety factor of 100\)"):
        required_normal_force(model, 0.1, contacts=contacts, safety_factor=100.0)


def test_a_limit_that_is_just_what_is_needed_holds(make_model: Make) -> None:
    for load in np.linspace(0.5, 3.5, 30):
        needed = required_normal_force(make_model(), float(load), contact_area=AREA).normal_force
        limited = required_normal_force(make_model(), float(load), contact_area=AREA, normal_force_limit=needed)
        assert limited.normal_force == pytest.approx(needed, rel=1e-12)


def test_friction_too_uncertain_to_promise_any_is_refused(make_model: Make) -> None:
    model = make_model((0.3, 0.0, 0.0), np.diag([0.04, 0.0, 0.0]), degrees_of_freedom=3.0)
    with pytest.raises(NoFeasibleForce, match="no load is held so at any force") as caught:
        required_normal_force(model, 0.1, 1e-3, contact_area=AREA)
    assert (caught.value.largest_load, caught.value.normal_force) == (0.0, 0.0)


def test_an_unsure_slope_makes_great_forces_useless(make_model: Make) -> None:
    sure = make_model((0.5, 0.0, 0.0), ZERO, normal_force_domain=EVERYWHERE)
    unsure = make_model((0.5, 0.0, 0.0), np.diag([0.0, 0.0, 0.04]))
    assert required_normal_force(sure, 2.0, contact_area=AREA).largest_load == np.inf
    assert required_normal_force(unsure, 2.0, contact_area=AREA).largest_load < 10.0


def test_friction_that_only_great_forces_bring_is_found(make_model: Make) -> None:
    """An uncertain intercept that the slope's error undoes: q < 0 at small forces, > 0 beyond."""
    sd, correlation = np.array([0.2, 0.0, 0.5]), -0.999
    covariance = np.outer(sd, sd) * np.array([[1.0, 0.0, correlation], [0.0, 1.0, 0.0], [correlation, 0.0, 1.0]])
    model = make_model((0.4, 0.0, 0.0), covariance, scale=0.01, normal_force_domain=(0.0, 1.0))
    assert capacity(model, 0.1, 1e-3) == 0.0
    answer = required_normal_force(model, 3.0, contact_area=AREA)
    force = np.linspace(0.0, 200.0, 2_000_001)
    holds = force[capacity(model, force, 1e-3) >= 3.0]
    assert answer.normal_force == pytest.approx(holds[0], abs=1e-4)
    assert answer.feasible_interval[1] == pytest.approx(holds[-1], abs=1e-4)


def test_no_load_needs_no_force(make_model: Make) -> None:
    answer = required_normal_force(make_model(), 0.0, contact_area=AREA)
    assert answer.normal_force == 0.0
    assert answer.feasible_interval[1] > 0.0
    for hopeless in (make_model((-0.1, 0.0, 0.0), ZERO), make_model((0.0, 0.0, 0.0), ZERO, scale=0.0)):
        assert required_normal_force(hopeless, 0.0, contact_area=AREA).feasible_interval == (0.0, 0.0)


def test_leaving_the_model_s_data_is_warned_of(make_model: Make) -> None:
    model = make_model()
    inside = required_normal_force(model, 1.0, contact_area=AREA)
    assert inside.within_domain
    assert inside.warning is None
    outside = required_normal_force(model, 1e-3, contact_area=AREA)
    assert not outside.within_domain
    assert outside.warning is not None
    assert outside.warning.startswith("normal force extrapolated to")
    assert (inside.support, outside.support) == ("supported", "extrapolated")
    fast = required_normal_force(model, 1.0, contact_area=AREA, tangential_velocity=0.02)
    assert fast.warning is not None
    assert fast.warning.startswith("tangential velocity extrapolated")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tangential_load": -1.0}, "tangential_load is -1.0; allowed: 0 to 1e\\+09 N"),
        ({"tangential_load": np.nan}, "tangential_load is nan"),
        ({"tangential_load": np.inf}, "tangential_load is inf"),
        ({"slip_probability": 0.0}, "slip_probability is 0.0; allowed: 1e-12 to 0.5"),
        ({"slip_probability": 1.0}, "slip_probability is 1.0"),
        ({"slip_probability": 0.6}, "slip_probability is 0.6"),
        ({"slip_probability": np.nan}, "slip_probability is nan"),
        ({"slip_probability": 1e-13}, "slip_probability is 1e-13"),
        ({"degrees_of_freedom": np.nan}, "model is not finite at this slip probability"),
        ({"contact_area": 0.0}, "contact_area is 0.0"),
        ({"contact_area": np.inf}, "contact_area is inf"),
        ({"tangential_velocity": -1e-3}, "tangential_velocity is -0.001"),
        ({"tangential_velocity": np.nan}, "tangential_velocity is nan"),
        ({"normal_force_limit": 0.0}, "normal_force_limit is 0.0"),
        ({"normal_force_limit": np.nan}, "normal_force_limit is nan"),
        ({"coefficients": (np.nan, 0.0, 0.0)}, "model is not finite"),
        ({"covariance": np.full((3, 3), np.inf)}, "model is not finite"),
    ],
)
def test_arguments_that_cannot_be_are_refused(make_model: Make, changes: dict[str, Any], message: str) -> None:
    parts = {
        name: changes.pop(name) for name in ("coefficients", "covariance", "degrees_of_freedom") if name in changes
    }
    arguments = {"tangential_load": 1.0, "contact_area": AREA} | changes
    with pytest.raises(InvalidArgument, match=message):
        required_normal_force(make_model(**parts), **arguments)


@search
@given(model=models(), load=loads, probability=probabilities, velocity=velocities, limit=limits)
def test_the_answer_holds_and_brute_force_finds_no_smaller_one(
    model: FrictionModel, load: float, probability: float, velocity: float, limit: float | None
) -> None:
    force = np.concatenate([np.geomspace(1e-6, 1.0, 2001), np.geomspace(1.0, limit or 1e6, 20001)])
    force = force[force <= (limit or np.inf)]
    holds = force[capacity(model, force, probability, velocity) >= load * (1.0 + 1e-9)]
    answer = solve(model, load, probability, tangential_velocity=velocity, normal_force_limit=limit)
    if holds.size:
        assert answer <= holds[0] * (1.0 + 1e-9)
    if np.isfinite(answer):
        assert capacity(model, answer, probability, velocity) >= load * (1.0 - 1e-9) - rounding(model, answer)
        assert answer <= (limit or np.inf) * (1.0 + 1e-15)
        below = force[force < answer * (1.0 - 1e-9)]
        assert (capacity(model, below, probability, velocity) <= load * (1.0 + 1e-9) + rounding(model, below)).all()


@search
@given(model=models(), load=loads, probability=probabilities, place=st.floats(0.0, 1.0))
def test_every_force_in_the_interval_holds(model: FrictionModel, load: float, probability: float, place: float) -> None:
    try:
        low, high = required_normal_force(model, load, probability, contact_area=AREA).feasible_interval
    except NoFeasibleForce:
        assume(False)
    top = high if np.isfinite(high) else 100.0 * low
    force = low * (top / low) ** place
    assert capacity(model, force, probability) >= load * (1.0 - 1e-9) - rounding(model, force)
    if np.isfinite(high):
        assert capacity(model, 1.001 * high, probability) < load


@search
@given(model=models(), load=loads, more=st.floats(1.0, 5.0), probability=probabilities, limit=limits)
def test_more_load_never_needs_less_force(
    model: FrictionModel, load: float, more: float, probability: float, limit: float | None
) -> None:
    less = solve(model, load, probability, normal_force_limit=limit)
    assert solve(model, load * more, probability, normal_force_limit=limit) >= less * (1.0 - 1e-12)


@search
@given(model=models(), load=loads, probability=st.floats(1e-9, 0.5), factor=st.floats(1e-3, 1.0))
def test_a_smaller_slip_probability_never_needs_less_force(
    model: FrictionModel, load: float, probability: float, factor: float
) -> None:
    assert solve(model, load, probability * factor) >= solve(model, load, probability) * (1.0 - 1e-12)


@pytest.mark.parametrize("probability", [0.2, 0.01])
@pytest.mark.parametrize("degrees_of_freedom", [5.0, 40.0])
def test_as_many_contacts_slip_as_were_allowed(make_model: Make, probability: float, degrees_of_freedom: float) -> None:
    """Draw coefficients and scatter from the posterior that the Student-t prediction stands for (400,000 draws)."""
    model = make_model(degrees_of_freedom=degrees_of_freedom, scatter_degrees_of_freedom=degrees_of_freedom)
    answer = required_normal_force(model, 2.0, probability, contact_area=AREA, tangential_velocity=2e-3)
    generator, draws = np.random.default_rng(17), 400_000
    stretch = np.sqrt(degrees_of_freedom / generator.chisquare(degrees_of_freedom, draws))
    scatter = stretch * model.scale * generator.normal(size=draws)
    errors = stretch[:, None] * generator.multivariate_normal(np.zeros(3), model.covariance, draws)
    x = np.array([1.0, 2e-3, answer.element_force])
    slips = (((model.coefficients + errors) @ x + scatter) * answer.normal_force < 2.0).mean()
    assert abs(slips - probability) < 4.0 * np.sqrt(probability * (1.0 - probability) / draws)


@pytest.mark.parametrize("probability", [0.01, 1e-3])
def test_no_more_contacts_slip_than_were_allowed_after_few_grasps(make_model: Make, probability: float) -> None:
    """Coefficients from four grasps, scatter from thousands of samples: two independent estimates (400,000 draws)."""
    model = make_model(degrees_of_freedom=3.0, scatter_degrees_of_freedom=np.inf)
    answer = required_normal_force(model, 2.0, probability, contact_area=AREA, tangential_velocity=2e-3)
    generator, draws = np.random.default_rng(18), 400_000
    stretch = np.sqrt(3.0 / generator.chisquare(3.0, draws))
    errors = stretch[:, None] * generator.multivariate_normal(np.zeros(3), model.covariance, draws)
    x = np.array([1.0, 2e-3, answer.element_force])
    friction = (model.coefficients + errors) @ x + model.scale * generator.normal(size=draws)
    slips = (friction * answer.normal_force < 2.0).mean()
    noise = 4.0 * np.sqrt(probability / draws)
    assert 0.5 * probability < slips < 1.05 * probability + noise  # 5 %: how far the root of squares may fall short


def test_a_nearly_singular_covariance_gives_no_invalid_root(make_model: Make) -> None:
    """Perfectly correlated, σ = 0: xᵀΣx is 0 at one force, where rounding makes the plain formula's root invalid."""
    direction = np.array([0.1, 0.0, -1.0])
    model = make_model((0.5, 0.0, -0.5), np.outer(direction, direction), scale=0.0)
    answer = required_normal_force(model, 2.0, contact_area=AREA)
    assert answer.friction_coefficient * answer.normal_force == pytest.approx(2.0, rel=1e-12)
    assert np.isfinite(answer.feasible_interval[1])


@pytest.mark.parametrize(("c", "s", "k", "g"), [(0.2, 0.5, 0.1, 0.3), (0.29, 0.1, -0.4, 0.3), (-0.2, 0.5, -2.0, 0.3)])
def test_the_peak_of_a_hyperbola_is_where_it_falls_off_on_both_sides(c: float, s: float, k: float, g: float) -> None:
    def height(force: float) -> float:
        return c * force - float(np.hypot(s, k + g * force))

    peak = _peak_of_hyperbola(c, s, k, g)
    assert peak > 0.0
    assert height(peak) > max(height(0.99 * peak), height(1.01 * peak))
    assert _peak_of_hyperbola(-g, s, k, g) == 0.0
    assert _peak_of_hyperbola(g, s, k, g) == np.inf
