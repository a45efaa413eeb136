"""Torque, several contacts, contacts that grow, and many grasps at once."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from stiction_client import (
    Contact,
    Contacts,
    FrictionModel,
    InvalidArgument,
    NoFeasibleForce,
    RequiredForce,
    antipodal,
    grasp,
    n_fingers,
    required_normal_force,
)

Make = Callable[..., FrictionModel]

AREA = 6e-5
ZERO = np.zeros((3, 3))
COVARIANCE = np.diag([4e-4, 1e-2, 4e-3])

CONTACTS = {
    "flat": Contact.flat(AREA),
    "round": Contact.round(AREA, at_force=5.0),
    "two flat": antipodal(Contact.flat(AREA)),
    "three round": n_fingers(3, Contact.round(AREA, at_force=5.0), object_radius=0.03),
}


def coulomb(make_model: Make) -> FrictionModel:
    return make_model((0.4, 0.0, 0.0), ZERO, scale=0.0)


def test_a_grasp_told_by_numbers_is_made_of_the_contacts_that_they_tell() -> None:
    assert grasp(AREA) == Contacts(CONTACTS["flat"])
    assert grasp(AREA, fingers=2) == CONTACTS["two flat"]
    assert grasp(AREA, 5.0, 3, 0.03) == CONTACTS["three round"]
    with pytest.raises(InvalidArgument, match="fingers is 101"):
        grasp(AREA, fingers=101)


def test_torque_alone_asks_for_its_share_of_the_limit_surface(make_model: Make) -> None:
    """Flat disk under uniform pressure: M = ⅔ μ F a (Johnson 1985)."""
    answer = required_normal_force(coulomb(make_model), 0.0, contacts=Contact.flat(AREA), torque=0.01)
    radius = math.sqrt(AREA / math.pi)
    assert answer.normal_force == pytest.approx(0.01 / (0.4 * 2.0 / 3.0 * radius), rel=1e-13)


def test_load_and_torque_add_as_root_of_squares(make_model: Make) -> None:
    arm = 2.0 / 3.0 * math.sqrt(AREA / math.pi)
    answer = required_normal_force(coulomb(make_model), 3.0, contacts=Contact.flat(AREA), torque=4.0 * arm)
    assert answer.normal_force == pytest.approx(5.0 / 0.4, rel=1e-13)


def test_the_torque_that_a_round_finger_bears_grows_with_the_force_to_four_thirds(make_model: Make) -> None:
    """M = 3π/16 μ F a with Hertz's a ∝ F^⅓, so that F = F₀ (M/M₀)^¾."""
    finger = Contact.round(AREA, at_force=5.0)
    at_reference = 0.4 * 5.0 * 3.0 * math.pi / 16.0 * math.sqrt(AREA / math.pi)
    for times in (0.1, 1.0, 30.0):
        answer = required_normal_force(coulomb(make_model), 0.0, contacts=finger, torque=times * at_reference)
        assert answer.normal_force == pytest.approx(5.0 * times**0.75, rel=1e-12)


def test_what_elements_under_hertz_pressure_hold_is_summed(make_model: Make) -> None:
    """Against the sum over a fine disk: Σ μ(f)·f with μ = .5 − f/N, whose pressure is not uniform."""
    model = make_model((0.5, 0.0, -1.0), ZERO, scale=0.0)
    force = required_normal_force(model, 1.5, contacts=Contact.round(AREA, at_force=5.0)).normal_force
    radius = math.sqrt(AREA / math.pi) * (force / 5.0) ** (1.0 / 3.0)
    r = radius * np.sqrt((np.arange(100_000) + 0.5) / 100_000)  # rings of equal area
    pressure = 1.5 * force / (math.pi * radius**2) * np.sqrt(1.0 - (r / radius) ** 2)
    element = pressure * model.element_area
    held = np.mean((0.5 - element) * pressure) * math.pi * radius**2
    assert held == pytest.approx(1.5, rel=1e-6)  # rings: midpoint rule


def test_a_measured_pressure_holds_what_its_elements_hold(make_model: Make) -> None:
    model = make_model((0.5, 0.0, -1.0), ZERO, scale=0.0)
    generator = np.random.default_rng(3)
    pressure, x, y = generator.uniform(0.0, 1e5, 50), *generator.normal(0.0, 3e-3, (2, 50))
    contact = Contact.measured(pressure, x, y, model.element_area)
    answer = required_normal_force(model, 1.5, contacts=contact)
    element = pressure / pressure.sum() * answer.normal_force
    assert np.sum((0.5 - element) * element) == pytest.approx(1.5, rel=1e-12)
    centre = pressure @ x / pressure.sum(), pressure @ y / pressure.sum()
    arm = pressure @ np.hypot(x - centre[0], y - centre[1]) / pressure.sum()
    assert contact.torque_arm == pytest.approx(arm, rel=1e-14)


def test_fingers_share_load_and_torque_evenly(make_model: Make) -> None:
    one = required_normal_force(make_model(), 1.0, contacts=Contact.flat(AREA), torque=2e-3)
    two = required_normal_force(make_model(), 2.0, contacts=antipodal(Contact.flat(AREA)), torque=4e-3)
    assert two.normal_force == pytest.approx(one.normal_force, rel=1e-14)
    lid = required_normal_force(make_model(), 0.0, contacts=n_fingers(3, Contact.flat(AREA), 0.03), torque=0.09)
    assert lid.normal_force == pytest.approx(
        required_normal_force(make_model(), 1.0, contact_area=AREA).normal_force, rel=1e-13
    )


def test_a_safety_factor_multiplies_the_load(make_model: Make) -> None:
    sure = required_normal_force(make_model(), 1.0, contact_area=AREA, torque=1e-3, safety_factor=1.5)
    assert sure.normal_force == required_normal_force(make_model(), 1.5, contact_area=AREA, torque=1.5e-3).normal_force


@pytest.mark.parametrize("contacts", CONTACTS.values(), ids=CONTACTS)
def test_many_grasps_at_once_are_each_as_one_alone(make_model: Make, contacts: Contact | Contacts) -> None:
    model = make_model((0.5, 2.0, -0.8), COVARIANCE)
    generator = np.random.default_rng(1)
    load, torque = generator.uniform(0.0, 6.0, 300), generator.uniform(0.0, 0.02, 300)
    load[:20], torque[10:30] = 0.0, 0.0
    limit = generator.uniform(1.0, 50.0, 300)
    answers = required_normal_force(model, load, 0.01, contacts=contacts, torque=torque, normal_force_limit=limit)
    outcomes = set()
    for number in range(300):
        options: dict[str, Any] = {"torque": torque[number], "normal_force_limit": limit[number]}
        if np.isnan(answers.normal_force[number]):
            with pytest.raises(NoFeasibleForce) as refusal:
                required_normal_force(model, float(load[number]), 0.01, contacts=contacts, **options)
            assert answers.outcome[number] == refusal.value.cause
        else:
            alone = required_normal_force(model, float(load[number]), 0.01, contacts=contacts, **options)
            assert answers.normal_force[number] == pytest.approx(alone.normal_force, rel=1e-12)
            assert answers.feasible_interval[1][number] == pytest.approx(alone.feasible_interval[1], rel=1e-12)
            assert answers.within_domain[number] == alone.within_domain
            assert answers.outcome[number] in {"held", "held within bounds"}
        outcomes.add(str(answers.outcome[number]))
    assert {"held within bounds", "limit"} <= outcomes


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    contacts=st.sampled_from(list(CONTACTS.values())),
    coefficients=st.tuples(st.floats(-0.1, 1.5), st.floats(-5.0, 5.0), st.floats(-2.0, 0.5)),
    spread=st.sampled_from([0.0, 1e-3, 1e-1]),
    load=st.one_of(st.just(0.0), st.floats(1e-3, 10.0)),
    torque=st.one_of(st.just(0.0), st.floats(1e-5, 0.05)),
)
def test_brute_force_finds_no_smaller_and_no_greater_force_that_holds(
    make_model: Make, contacts: Contacts | Contact, coefficients: Any, spread: float, load: float, torque: float
) -> None:
    assume(load or torque)  # no load is held by no force, whatever greater ones do
    model = make_model(coefficients, spread * COVARIANCE)
    force = np.geomspace(1e-6, 1e6, 20_001)
    together = contacts if isinstance(contacts, Contacts) else Contacts(contacts)
    contact, reference = together.contact, together.contact.reference_force
    area = contact.area * ((force / reference) ** (2.0 / 3.0) if reference else 1.0)
    arm = contact.torque_arm * ((force / reference) ** (1.0 / 3.0) if reference else 1.0)
    tangential, moment = load / together.count, torque / together.count
    if together.lever_arm is not None:
        tangential, moment = math.hypot(tangential, moment / together.lever_arm), 0.0
    element = contact.pressure_square * force * model.element_area / area
    held = force * model.predict(0.0, element, 0.01)
    asked = np.hypot(tangential, moment / arm)
    certain = held > asked * (1.0 + 1e-9) + 1e-12 * force
    impossible = held < asked * (1.0 - 1e-9) - 1e-12 * force
    try:
        answer = required_normal_force(model, load, 0.01, contacts=contacts, torque=torque)
    except NoFeasibleForce:
        assert not certain.any()
        return
    low, high = answer.feasible_interval
    assert not impossible[(force > low * (1.0 + 1e-9)) & (force < high * (1.0 - 1e-9))].any()
    assert not certain[(force < low * (1.0 - 1e-9)) | (force > high * (1.0 + 1e-9))].any()


def test_a_force_is_never_larger_for_a_smaller_load(make_model: Make) -> None:
    """Of a model whose friction at no force is too uncertain to promise any, as one fitted to heavy grasps is."""
    sd, correlation = np.array([0.2, 0.0, 0.5]), -0.999
    covariance = np.outer(sd, sd) * np.array([[1.0, 0.0, correlation], [0.0, 1.0, 0.0], [correlation, 0.0, 1.0]])
    for model in (make_model((0.4, 0.0, 0.0), covariance, scale=0.01), make_model()):
        loads = np.array([0.0, 1e-300, 1e-100, 1e-30, 1e-12, 1e-6, 1e-3, 0.1, 1.0])
        forces = [required_normal_force(model, float(load), contact_area=AREA).normal_force for load in loads]
        assert np.all(np.diff(forces) >= -1e-15 * np.array(forces[1:]))  # rounding of one and the same root
        assert forces[0] == 0.0


def test_a_no_says_why(make_model: Make) -> None:
    falling = make_model((0.5, 0.0, -1.0), ZERO, scale=0.0)
    unsure = make_model((0.5, 0.0, 0.0), np.diag([0.0, 0.0, 0.25]), degrees_of_freedom=np.inf)
    cases = (
        (falling, 3.8, {}, "physics", "even the friction that is expected holds less"),
        (falling, 3.0, {"normal_force_limit": 5.0}, "limit", "a normal force above the limit would hold it"),
        (unsure, 3.0, {}, "ignorance", "record more grasps"),
        (unsure, 30.0, {}, "range", "record grasps that press harder"),
    )
    for model, load, options, cause, sentence in cases:
        with pytest.raises(NoFeasibleForce, match=sentence) as refusal:
            required_normal_force(model, load, contact_area=AREA, **options)  # type: ignore[arg-type]
        assert refusal.value.cause == cause


def test_a_limit_that_the_expected_friction_just_needs_is_not_what_is_in_the_way(make_model: Make) -> None:
    """A higher one would not help: it is the error of the slope that no force outweighs."""
    unsure = make_model((0.5, 0.0, 0.0), np.diag([0.0, 0.0, 0.25]), degrees_of_freedom=np.inf)
    for limit, cause in ((6.0 * (1.0 - 1e-9), "limit"), (6.0, "ignorance"), (6.0 * (1.0 + 1e-9), "ignorance")):
        with pytest.raises(NoFeasibleForce) as refusal:
            required_normal_force(unsure, 3.0, contact_area=AREA, normal_force_limit=limit)
        assert refusal.value.cause == cause, limit


def test_as_many_grasps_slip_under_load_and_torque_as_were_allowed(make_model: Make) -> None:
    """Round fingers whose elements draw one friction law and one scatter for all of them (200,000 draws)."""
    model = make_model(degrees_of_freedom=np.inf, scatter_degrees_of_freedom=np.inf)
    finger, probability, draws = Contact.round(AREA, at_force=5.0), 0.02, 200_000
    answer = required_normal_force(model, 2.0, probability, contacts=antipodal(finger), torque=4e-3)
    generator, force = np.random.default_rng(5), answer.normal_force
    radius = math.sqrt(AREA / math.pi) * (force / 5.0) ** (1.0 / 3.0)
    r = radius * np.sqrt((np.arange(400) + 0.5) / 400)
    element = 1.5 * force / (math.pi * radius**2) * np.sqrt(1.0 - (r / radius) ** 2) * model.element_area
    beta = model.coefficients + generator.multivariate_normal(np.zeros(3), model.covariance, draws)
    scatter = model.scale * generator.normal(size=draws)
    weights = element / element.sum()
    friction = beta[:, 0] + beta[:, 2] * (weights @ element) + scatter
    asked = np.hypot(1.0, 2e-3 / (3.0 * math.pi / 16.0 * radius))
    slips = np.mean(friction * force < asked)
    assert abs(slips - probability) < 4.0 * math.sqrt(probability * (1.0 - probability) / draws)


@pytest.mark.parametrize(
    "wrong", [True, None, "1.5", 1 + 2j, [True, False], [[1.0, 2.0], [3.0]], float("nan"), -1.0, 1e300, 10**400]
)
@pytest.mark.parametrize("name", ["tangential_load", "torque", "contact_area", "tangential_velocity", "safety_factor"])
def test_what_is_no_number_in_range_is_refused_by_name(make_model: Make, name: str, wrong: Any) -> None:
    arguments = {"tangential_load": 1.0, "contact_area": AREA} | {name: wrong}
    allowed = "contact_area" if (name, wrong) != ("contact_area", None) else "contact_area and contacts"
    with pytest.raises(InvalidArgument) as refusal:
        required_normal_force(make_model(), **arguments)
    assert refusal.value.name == (allowed if name == "contact_area" else name)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Contact.flat(1e30), "area"),
        (lambda: Contact.round(AREA, 0.0), "at_force"),
        (lambda: n_fingers(0, Contact.flat(AREA), 0.03), "count"),
        (lambda: n_fingers(3, Contact.flat(AREA), 0.0), "object_radius"),
        (lambda: Contact.measured(np.zeros(3), np.zeros(3), np.zeros(3), 1e-6), "total pressure"),
    ],
)
def test_a_contact_that_cannot_be_is_refused_by_name(make: Callable[[], object], name: str) -> None:
    with pytest.raises(InvalidArgument, match=f"^{name} is"):
        make()


def test_a_torque_on_a_contact_without_arm_is_refused(make_model: Make) -> None:
    with pytest.raises(InvalidArgument, match=r"torque is 0\.1; allowed: 0 where the contact has no torque_arm"):
        required_normal_force(make_model(), 1.0, contacts=Contact(AREA), torque=0.1)
    without = required_normal_force(make_model(), 1.0, contacts=Contact(AREA))
    assert without.normal_force == required_normal_force(make_model(), 1.0, contacts=Contact.flat(AREA)).normal_force


def test_the_largest_load_is_the_same_however_small_the_load_that_is_asked_for(make_model: Make) -> None:
    model = make_model((0.45, 0.0, -0.3), np.diag([1e-4, 0.0, 1e-2]))
    for contact in (Contact.flat(6e-5), Contact.round(6e-5, at_force=5.0)):
        answers = [required_normal_force(model, load, contacts=contact) for load in (0.0, 1e-300, 1e-30, 1e-3)]
        assert [each.largest_load for each in answers] == pytest.approx([answers[0].largest_load] * 4, rel=1e-9)
        held = [each.friction_coefficient * each.normal_force for each in answers[1:3]]
        assert np.all(np.array(held) >= np.array([1e-300, 1e-30]) * (1.0 - 1e-9))


def test_arrays_of_other_lengths_are_refused_by_name(make_model: Make) -> None:
    wrong = r"^tangential_load and torque is \[3\] and \[4\]; allowed: one length, or any shapes that broadcast$"
    with pytest.raises(InvalidArgument, match=wrong):
        required_normal_force(make_model(), np.ones(3), contact_area=6e-5, torque=np.zeros(4))


@pytest.mark.parametrize("model", ["paper", {"coefficients": [0.4, 0.0, 0.0]}, None])
def test_only_a_model_is_taken_for_one(model: Any) -> None:
    with pytest.raises(InvalidArgument, match=r"^model is .*; allowed: a FrictionModel, as FrictionClient\.model"):
        required_normal_force(model, 1.0, contact_area=6e-5)


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        ([0.0], [0.0, 1e-3], r"pressure, x and y is \[2\] and \[1\] and \[2\] numbers"),
        ([[0.0, 1e-3]], [[0.0, 1e-3]], r"pressure, x and y is \[2\] and \[1, 2\] and \[1, 2\] numbers"),
        ([0.0, "a"], [0.0, 1e-3], "^x is "),
        ([0.0, 1e-3], [0.0, np.nan], "^y is nan; allowed: -1 to 1 m"),
    ],
)
def test_a_measured_pressure_has_a_place_for_each_element(x: Any, y: Any, message: str) -> None:
    with pytest.raises(InvalidArgument, match=message):
        Contact.measured(np.array([1e3, 2e3]), x, y, 1e-6)


@pytest.mark.parametrize("wrong", [0, "", 6e-5, True, [Contact.flat(AREA)], np.array([1.0]), np.zeros(0)])
def test_only_contacts_are_taken_for_contacts(make_model: Make, wrong: Any) -> None:
    with pytest.raises(InvalidArgument, match=r"^contacts is .*; allowed: a Contact, or what antipodal"):
        required_normal_force(make_model(), 1.0, contacts=wrong)
    with pytest.raises(InvalidArgument, match=r"^contact is "):
        antipodal(wrong)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Contact(-1.0), "area"),
        (lambda: Contact(math.nan), "area"),
        (lambda: Contact("x"), "area"),  # type: ignore[arg-type]
        (lambda: Contact(AREA, reference_force=0.0), "reference_force"),
        (lambda: Contact(AREA, pressure_square=0.5), "pressure_square"),
        (lambda: Contact(AREA, torque_arm=-1e-3), "torque_arm"),
        (lambda: Contact(np.full(2, AREA), torque_arm=np.zeros(3)), "area and torque_arm"),
        (lambda: Contact.round(AREA, np.array([5.0, 6.0])), "at_force"),  # type: ignore[arg-type]
        (lambda: Contacts(Contact.flat(AREA), 0), "count"),
        (lambda: Contacts(Contact.flat(AREA), -2), "count"),
        (lambda: Contacts(Contact.flat(AREA), 2, 0.0), "lever_arm"),
    ],
)
def test_a_contact_made_by_hand_is_one(make: Callable[[], object], name: str) -> None:
    with pytest.raises(InvalidArgument, match=f"^{name} is"):
        make()


def test_lever_arms_of_another_length_are_named(make_model: Make) -> None:
    lids = n_fingers(3, Contact.flat(AREA), np.array([0.02, 0.03]))
    with pytest.raises(InvalidArgument, match=r"^tangential_load and object_radius is \[3\] and \[2\]"):
        required_normal_force(make_model(), np.ones(3), contacts=lids)


def test_a_measured_pressure_may_be_a_map_of_the_sensor() -> None:
    x, y = np.meshgrid(np.linspace(-2e-3, 2e-3, 5), np.linspace(-1e-3, 1e-3, 3))
    pressure = np.maximum(1.0 - (x**2 + y**2) / 4e-6, 0.0)
    mapped = Contact.measured(pressure, x, y, 1e-6)
    assert mapped == Contact.measured(pressure.ravel(), x.ravel(), y.ravel(), 1e-6)
    assert mapped.area == pytest.approx(np.count_nonzero(pressure) * 1e-6)


def test_a_measured_pressure_counts_by_its_shape_alone() -> None:
    pressure, x, y = np.array([1.0, 2.0, 3.0]), np.array([0.0, 1e-3, 2e-3]), np.zeros(3)
    plain, faint = (Contact.measured(scale * pressure, x, y, 1e-6) for scale in (1.0, 1e-200))
    assert faint == plain


@pytest.mark.parametrize("power", ["flat", "round"])
def test_the_least_loads_need_no_more_force_than_greater_ones(make_model: Make, power: str) -> None:
    contact = Contact.flat(AREA) if power == "flat" else Contact.round(AREA, at_force=5.0)
    rough = make_model((1e5, 0.0, 0.0), np.zeros((3, 3)), scale=0.0, normal_force_domain=(0.0, 1e9))
    forces = [required_normal_force(rough, load, contacts=contact).normal_force for load in (0.0, 5e-324, 1e-300, 1.0)]
    assert forces == sorted(forces)
    assert forces[-1] == pytest.approx(1e-5)


def answer(model: FrictionModel, load: float, contact: Contact) -> RequiredForce | NoFeasibleForce:
    """What is answered to one grasp, a refusal too."""
    try:
        return required_normal_force(model, load, contacts=contact, torque=1e-3)
    except NoFeasibleForce as refusal:
        return refusal


def test_grasps_that_take_many_steps_and_those_that_slip_do_not_change_the_others(make_model: Make) -> None:
    """Most of 4000 grasps are settled sooner than those next to the most that is held, and some are never held."""
    model = make_model((0.45, 0.0, -1.0), np.diag([1e-5, 0.0, 1e-3]))
    for contact in (Contact.flat(AREA), Contact.round(AREA, at_force=5.0)):
        most = required_normal_force(model, 1.0, contacts=contact, torque=1e-3).largest_load
        load = np.r_[np.linspace(0.1, 0.5, 3600) * most, np.linspace(0.9, 1.1, 400) * most]
        many = required_normal_force(model, load, contacts=contact, torque=np.full(load.size, 1e-3))
        for index in (0, 1800, *range(3600, 4000, 7)):
            one = answer(model, float(load[index]), contact)
            if isinstance(one, NoFeasibleForce):
                assert many.outcome[index] == one.cause
                assert np.isnan(many.normal_force[index])
            else:
                assert many.normal_force[index] == pytest.approx(one.normal_force, rel=1e-9)
                assert many.feasible_interval[1][index] == pytest.approx(one.feasible_interval[1], rel=1e-6)
        assert (many.outcome[:3600] == "held within bounds").all()


def test_fingers_are_whole() -> None:
    with pytest.raises(InvalidArgument, match=r"^count is 2\.5; allowed: a whole number: 1 to 100 fingers$"):
        n_fingers(2.5, Contact.flat(6e-5), object_radius=0.03)  # type: ignore[arg-type]
