import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import special

from stiction_client import (
    FrictionModel,
    InvalidArgument,
    NoFeasibleForce,
    Scale,
    Scales,
    conservative_friction,
    drake_friction,
    friction_cone,
    mujoco_geom,
    physx_material,
    required_normal_force,
    sdf_surface,
)
from stiction_client.defaults import BEND
from stiction_client.support import INDEPENDENT, ONE_GRASP, Support, disagreement, kinds, notes, support, uncertainty

Make = Callable[..., FrictionModel]

EXACT = np.diag([1e-8, 1e-8, 1e-8])


def test_each_kind_of_support_and_what_to_do(make_model: Make) -> None:
    """The data reach from 1e-5 to 4e-3 m/s and from 0.002 to 0.3 N."""
    known = make_model((0.4, 0.0, 0.0), EXACT)
    cases = {
        (known, 0.0, 0.1): ("supported", "± 0.1%"),
        (known, 0.0, 0.6): ("extrapolated", "normal force extrapolated to 0.6 N an element, observed 0.002 to 0.3"),
        (known, 0.01, 0.1): ("extrapolated", "tangential velocity extrapolated to 0.01 m/s"),
        (make_model((0.4, 0.0, 0.0), np.diag([1e-3, 0, 0])), 0.0, 0.1): ("not identified", "± 17% only: record more"),
        (make_model((0.4, 0.0, -1.0), EXACT), 0.0, 0.5): (
            "implausible",
            "comes out at -0.1 at 0 m/s and 0.5 N an element",
        ),
        (make_model((0.4, 0.0, -1.0), EXACT), 0.0, 0.39): ("extrapolated", "observed 0.002 to 0.3"),
        (make_model((0.4, 4.0, 0.0), EXACT), 1e3, 0.1): (
            "implausible",
            "comes out at 4e+03 at 1000 m/s and 0.1 N an element, over twice what it is within the data, too far",
        ),
        (make_model((0.4, 4.0, 0.0), EXACT), 0.107, 0.1): ("extrapolated", "observed 0 to 0.004"),
        (make_model((0.4, 4.0, 0.0), EXACT), 0.109, 0.1): ("implausible", "over twice"),
        (replace(known, identifiable=np.zeros(3, bool)), 0.0, 0.1): ("not identified", "no coefficient is known"),
        (replace(known, outdated=True), 0.0, 0.1): ("stale", "ask for a fit"),
        (replace(known, current=False), 0.0, 0.1): ("stale", "fetch the current model"),
        (make_model((0.4, 0.0, -1.5), EXACT), 0.0, 0.1): ("implausible", "comes out at -0.05, at 1e-05 m/s and 0.3 N"),
        (replace(known, diagnostics={"surface_change": "friction is lower"}), 0.0, 0.1): ("stale", "clean the surface"),
        (replace(known, diagnostics={"doubtful_logs": "1 of 4 logs is doubtful"}), 0.0, 0.1): (
            "implausible",
            "1 of 4 logs is doubtful: mend",
        ),
    }
    for (model, v, f_n), (kind, advice) in cases.items():
        found = model.support_at(v, f_n)
        assert found.kind == kind
        assert advice in found.advice
        assert kinds(model, v, f_n, model.stale) == kind


def test_an_extrapolation_says_how_well_friction_is_known_there(make_model: Make) -> None:
    """At twice the largest force of the data a law without error may bend by a tenth: 1.96 of these are told."""
    told = make_model((0.4, 0.0, 0.0), 0.0 * EXACT).support_at(0.0, 0.6).advice
    assert told.endswith("; the expected friction is known to within ± 20% there: record a grasp there")
    uncertain = make_model((0.4, 0.0, 0.0), np.diag([0.0, 9.0, 0.0]))
    slope, bend = 3.0 * special.stdtrit(uncertain.degrees_of_freedom, 0.975), 1.96 * BEND * np.log(0.4 / 4e-3)
    assert f"known to within ± {np.hypot(slope, bend):.0%} there" in uncertain.support_at(0.4, 0.1).advice


def test_friction_at_rest_asks_for_slower_slip_where_all_was_as_fast(make_model: Make) -> None:
    """Of slip at 1 mm/s alone the law is known there, and its slope with velocity not at all."""
    along = np.array([1.0, -1e3, 0.0])  # of β, by which friction at 1 mm/s stays
    at_one = make_model((0.4, 0.0, 0.0), EXACT + 0.01 * np.outer(along, along))
    at_one = replace(at_one, domain=replace(at_one.domain, tangential_velocity=(1e-3, 1e-3)))
    assert at_one.support_at(1e-3, 0.1).kind == "supported"
    assert at_one.support_at(0.0, 0.1) == Support(
        "not identified",
        "the expected friction is known to within ± 0.1% where slip was slowest, at 0.001 m/s, but not at 0 m/s: "
        "record slower slip",
    )
    assert kinds(at_one, 0.0, 0.1) == "not identified"
    steep = replace(at_one, coefficients=np.array([1.4, -1e3, 0.0]))  # 0.4 at 1 mm/s, and 1.4 at rest
    assert (steep.support_at(0.0, 0.1).kind, kinds(steep, 0.0, 0.1)) == ("not identified", "not identified")


def of_one_speed(make_model: Make, noted: bool = True) -> FrictionModel:
    """Of slip at 1 mm/s, from where to rest friction is assumed to change by a twentieth (a standard deviation)."""
    slope = 0.05 * 0.4 / 1e-3
    along = slope * np.array([-1e-3, 1.0, 0.0])  # of β, by which friction at 1 mm/s stays
    model = make_model((0.4, 0.0, 0.0), EXACT + np.outer(along, along))
    told = {"slowest_slip": 1e-3, "assumed_change": "it is assumed"} if noted else {}
    return replace(model, domain=replace(model.domain, tangential_velocity=(1e-3, 1e-3)), diagnostics=told)


def test_slower_than_all_slip_is_outside_of_data_that_do_not_show_what_velocity_does(make_model: Make) -> None:
    model = of_one_speed(make_model)
    half = 0.05 * special.stdtrit(model.degrees_of_freedom, 0.975)
    found = model.support_at(0.0, 0.1)
    outside = "tangential velocity extrapolated to 0 m/s, observed 0.001 to 0.001"
    assert model.extrapolation(0.0, 0.1) == outside
    assert found == Support(
        "extrapolated",
        f"{outside}; the expected friction is known to within ± {half:.0%} there, if velocity changes it no more than "
        "is assumed: record slip at other speeds",
    )
    assert model.support_at(1e-3, 0.1).kind == "supported"
    assert model.extrapolation(1e-3, 0.1) is None
    assert kinds(model, [0.0, 9e-4, 1e-3, 2e-3], 0.1).tolist() == [*["extrapolated"] * 2, "supported", "extrapolated"]
    assert model.notes == ("it is assumed",)


def test_what_is_not_known_where_it_slid_is_not_at_rest_either(make_model: Make) -> None:
    model = of_one_speed(make_model)
    vague = replace(model, covariance=model.covariance + np.diag([1e-3, 0.0, 0.0]))
    assert vague.support_at(0.0, 0.1).kind == kinds(vague, 0.0, 0.1) == "not identified"
    nothing = replace(model, identifiable=np.zeros(3, bool))
    assert nothing.support_at(0.0, 0.1).kind == kinds(nothing, 0.0, 0.1) == "not identified"
    assert replace(model, current=False).support_at(0.0, 0.1).kind == "stale"


def test_a_model_stored_without_such_notes_means_what_it_meant(make_model: Make) -> None:
    before = of_one_speed(make_model, noted=False)
    assert before.extrapolation(0.0, 0.1) is None
    assert before.support_at(0.0, 0.1).kind == kinds(before, 0.0, 0.1) == "not identified"


def test_a_planner_is_given_a_force_that_allows_for_what_is_assumed_and_is_told(make_model: Make) -> None:
    model = of_one_speed(make_model)
    grip = required_normal_force(model, 1.0, 1e-2, contact_area=6e-5)
    sure = required_normal_force(replace(model, covariance=EXACT), 1.0, 1e-2, contact_area=6e-5)
    assert grip.normal_force > 1.05 * sure.normal_force
    assert (grip.support, grip.within_domain) == ("extrapolated", False)
    assert grip.warning == model.extrapolation(0.0, grip.element_force)
    assert grip.notes == model.notes
    many = required_normal_force(model, np.array([1.0, 1.0]), 1e-2, contact_area=6e-5, tangential_velocity=[0.0, 1e-3])
    assert many.support.tolist() == ["extrapolated", "supported"]
    assert many.within_domain.tolist() == [False, True]
    assert many.normal_force[0] == pytest.approx(grip.normal_force)


def test_friction_that_could_be_anything_is_told_without_a_part_of_it(make_model: Make) -> None:
    told = make_model((0.4, 0.0, 0.0), np.diag([1.0, 0.0, 0.0])).support_at(0.0, 0.1).advice
    assert told == "the samples do not determine the expected friction there: record more grasps, and others"


def test_velocities_that_nobody_knows_are_no_support(make_model: Make) -> None:
    told = "the object's motion is unknown"
    model = replace(make_model((0.4, 0.0, 0.0), EXACT), diagnostics={"unknown_velocity": told})
    still = replace(model, domain=replace(model.domain, tangential_velocity=(0.0, 0.0)))
    found = still.support_at(1e-3, 0.1)
    assert (found.kind, found.advice) == ("not identified", f"{told}: record a grasp with its motion")
    assert still.support_at(0.0, 0.1).kind == "supported"
    assert kinds(still, [0.0, 1e-3], 0.1).tolist() == ["supported", "not identified"]
    assert model.support_at(1e-3, 0.1).kind == "supported"  # other grasps tell of velocity


@pytest.mark.parametrize("kind", ["element", "time block", "none"])
def test_one_grasp_has_support_only_where_the_next_one_may_differ(make_model: Make, kind: str) -> None:
    model = replace(make_model((0.4, 0.0, 0.0), EXACT), diagnostics={"cluster_kind": kind})
    found = model.support_at(0.0, 0.1)
    assert (found.kind, found.advice) == ("not identified", ONE_GRASP)
    assert kinds(model, [0.0, 1e-3], 0.1).tolist() == ["not identified"] * 2
    several = replace(model, diagnostics={"cluster_kind": "grasp"})
    allowing = replace(model, diagnostics={"cluster_kind": kind, "scale_between_grasps": 0.1})
    assert several.support_at(0.0, 0.1).kind == allowing.support_at(0.0, 0.1).kind == "supported"


@pytest.mark.parametrize("kind", ["grasp", "merged"])
def test_who_takes_all_samples_for_independent_supports_no_answer(make_model: Make, kind: str) -> None:
    told = {"cluster_kind": kind, "assumes": "independent errors"}
    model = replace(make_model((0.4, 0.0, 0.0), EXACT), diagnostics=told)
    assert model.support_at(0.0, 0.1) == Support("not identified", INDEPENDENT)
    assert kinds(model, [0.0, 0.6], 0.1).tolist() == ["not identified"] * 2
    assert required_normal_force(model, 0.3, of="element", contact_area=6e-5).support == "not identified"
    with pytest.raises(ValueError, match="independent"):
        mujoco_geom(model, 0.1)
    assert mujoco_geom(model, 0.1, allow_unidentified=True)


def test_a_model_tells_what_it_rests_on_in_the_middle_of_its_data(make_model: Make) -> None:
    known, unknown = make_model((0.4, 0.0, 0.0), EXACT), make_model((0.4, 0.0, 0.0), np.diag([1e-3, 0, 0]))
    assert (known.support, unknown.support) == ("supported", "not identified")
    assert unknown.advice.startswith("the expected friction is known to within")


def test_three_coefficients_that_no_data_tell_are_never_supported(make_model: Make) -> None:
    model = replace(make_model(), identifiable=np.zeros(3, bool))
    grip = required_normal_force(model, 1.0, contact_area=6e-5)
    assert grip.within_domain
    assert grip.support == "not identified"
    assert grip.warning == grip.advice


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_support_does_not_depend_on_the_units_of_force(make_model: Make, scale: float) -> None:
    units = np.array([1.0, 1.0, 1.0 / scale])
    model = make_model((0.4, 0.0, -0.3), np.diag([1e-5, 1e-2, 1e-3]), normal_force_domain=(0.002, 0.3))
    same = replace(
        model,
        coefficients=model.coefficients * units,
        covariance=model.covariance * np.outer(units, units),
        domain=replace(model.domain, normal_force=(0.002 * scale, 0.3 * scale)),
    )
    forces = np.array([1e-4, 0.01, 0.2, 0.5, 5.0])
    np.testing.assert_array_equal(kinds(same, 0.0, forces * scale), kinds(model, 0.0, forces))
    expected = model.predict(0.0, forces, 0.01)
    np.testing.assert_allclose(same.predict(0.0, forces * scale, 0.01), expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("bounds", [(0.1, 0.1), (0.0, 0.1)])
def test_data_at_one_force_or_without_a_velocity_have_support(make_model: Make, bounds: tuple[float, float]) -> None:
    model = make_model((0.4, 0.0, 0.0), EXACT, normal_force_domain=bounds)
    still = replace(model, domain=replace(model.domain, tangential_velocity=(0.0, 0.0)))
    assert support(still, 0.0, 0.1).kind == "supported"
    assert support(still, 1e-3, 0.1).kind == "extrapolated"
    assert np.isfinite(still.predict(1e-3, [0.0, 0.1, 1.0], 0.01)).all()


def test_coefficients_that_are_not_finite_are_implausible(make_model: Make) -> None:
    assert make_model((np.nan, 0.0, 0.0), EXACT).support == "implausible"


@pytest.mark.parametrize(
    ("v", "f_n", "distance"),
    [(0.0, 0.6, 1.0), (0.0, 0.001, 0.5), (0.004 * np.e, 0.1, 1.0), (0.004 * np.e**2, 0.9, np.hypot(2.0, 2.0))],
)
def test_outside_the_data_the_interval_widens_by_a_tenth_of_friction_and_distance(
    make_model: Make, v: float, f_n: float, distance: float
) -> None:
    model = make_model((0.4, 0.0, 0.0), np.zeros((3, 3)), scale=0.0)
    expected = 0.4 + special.ndtri([0.05, 0.95]) * BEND * 0.4 * distance
    found = [float(model.predict(v, f_n, quantile)) for quantile in (0.05, 0.95)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert float(model.predict(0.004, 0.3, 0.05)) == 0.4  # up to the bounds nothing is added


def test_no_quantile_is_a_negative_friction(make_model: Make) -> None:
    far = make_model().predict(0.0, np.geomspace(1e-6, 1e6, 50), 1e-6)
    assert (far >= 0.0).all()
    assert far.min() == 0.0


def test_a_refusal_names_the_largest_force_observed_where_only_greater_ones_would_hold(make_model: Make) -> None:
    model = make_model((0.4, 0.0, 0.0), EXACT, normal_force_domain=(0.002, 0.05))
    with pytest.raises(NoFeasibleForce, match=r"beyond those observed, 0\.05 N an element, would hold") as refusal:
        required_normal_force(model, 100.0, contact_area=6e-5)
    assert (refusal.value.cause, refusal.value.largest_observed) == ("range", 0.05)
    assert str(pickle.loads(pickle.dumps(refusal.value))) == str(refusal.value)


@pytest.mark.parametrize(("more", "disagree"), [(0.0, False), (0.03, False), (0.06, True), (-0.06, True)])
def test_methods_disagree_where_their_intervals_have_nothing_in_common(
    make_model: Make, more: float, disagree: bool
) -> None:
    """Each knows its friction to ± 0.02, nearly."""
    one, other = (make_model((0.4 + part, 0.0, 0.0), np.diag([1e-4, 0.0, 0.0])) for part in (0.0, more))
    told = disagreement("ols", one, {"bayes": other})
    assert (told is not None) == disagree
    assert told is None or f"bayes expects {0.4 + more:.3g} ± 0.02" in told


def test_many_answers_tell_their_support_one_by_one(make_model: Make) -> None:
    model = make_model((0.4, 0.0, 0.0), EXACT, normal_force_domain=(0.002, 0.05))
    found = required_normal_force(model, np.array([0.5, 1.1, 100.0]), contact_area=6e-5)
    assert found.support.tolist() == ["supported", "extrapolated", ""]


@pytest.mark.parametrize(
    "export", [conservative_friction, drake_friction, friction_cone, mujoco_geom, physx_material, sdf_surface]
)
def test_exports_refuse_what_is_not_identified_unless_it_is_allowed(
    make_model: Make, export: Callable[..., object]
) -> None:
    model = make_model((0.4, 0.0, 0.0), np.diag([1e-3, 0, 0]))
    with pytest.raises(InvalidArgument, match=r"not identified .*; allowed: supported, or allow_unidentified=True"):
        export(model, 0.1)
    export(model, 0.1, allow_unidentified=True)


def test_exports_tell_the_friction_of_a_contact(make_model: Make) -> None:
    scales = Scales(Scale(0.05, np.inf), Scale(0.02, np.inf), Scale(0.03, np.inf))
    model = replace(make_model((0.4, 0.0, 0.0), EXACT), scales=scales)
    expected = float(model.predict(0.0, 0.1, 0.05, of="contact", elements=60))
    assert expected > float(model.predict(0.0, 0.1, 0.05))
    assert conservative_friction(model, 0.1) == pytest.approx(expected, rel=1e-12)  # 60 mm² of elements of 1 mm²
    assert conservative_friction(model, 0.1, contact_area=1e-9) == float(model.predict(0.0, 0.1, 0.05))


def test_what_can_be_relied_on_warns_of_nothing_more() -> None:
    assert Support("supported", "well known").warning(None) is None
    assert Support("extrapolated", "record").warning("outside") == "outside"
    assert Support("stale", "fit").warning("outside", None) == "outside; fit"


@pytest.mark.parametrize(("v", "f_n"), [(0.0, 0.1), (3e-3, 0.1), (3e-3, 0.3), (4e-3, 0.002)])
@pytest.mark.parametrize("array", [False, True])
def test_how_much_of_friction_is_unknown_is_that_of_the_whole_covariance(
    make_model: Make, v: float, f_n: float, array: bool
) -> None:
    """t · √(xᵀΣx) / xᵀβ with x = (1, v, f_n)."""
    correlated = np.array([[2e-4, 3e-3, -1e-3], [3e-3, 9.0, 2e-2], [-1e-3, 2e-2, 4e-2]])
    model = make_model((0.4, -20.0, 0.3), correlated, degrees_of_freedom=7.0)
    x = np.array([1.0, v, f_n])
    expected = special.stdtrit(7.0, 0.975) * np.sqrt(x @ correlated @ x) / (x @ model.coefficients)
    asked = (np.array([v]), np.array([f_n])) if array else (v, f_n)
    assert np.asarray(uncertainty(model, *asked)).item() == pytest.approx(expected, rel=1e-12)


def test_friction_that_is_nothing_beside_its_uncertainty_is_not_known_at_all(make_model: Make) -> None:
    assert uncertainty(make_model((0.0, 0.0, 0.0)), 0.0, 0.1) == np.inf
    assert uncertainty(make_model((-0.4, 0.0, 0.0)), 0.0, 0.1) == np.inf
    assert uncertainty(make_model((0.0, 0.0, 0.0), np.zeros((3, 3))), 0.0, 0.1) == np.inf


def test_a_disagreement_is_told_where_it_is_largest(make_model: Make) -> None:
    exact = np.zeros((3, 3))
    one = make_model((0.4, 0.0, 0.0), exact)
    by_force, by_speed = make_model((0.4, 0.0, 0.5), exact), make_model((0.4, 20.0, 0.0), exact)
    told = disagreement("ols", one, {"bayes": by_force})
    assert told is not None
    assert "bayes expects 0.55 ± 0, ols 0.4 ± 0 at 0 m/s and 0.3 N an element; look at the samples" in told
    told = disagreement("ols", one, {"same": one, "bayes": by_speed})
    assert told is not None
    assert "bayes expects 0.48 ± 0, ols 0.4 ± 0 at 0.004 m/s and 0.002 N an element" in told
    assert disagreement("ols", one, {"same": one}) is None
    assert disagreement("ols", one, {}) is None


def test_notes_come_in_the_order_of_what_weighs_most() -> None:
    told = {"unnoticed_change": "e", "weakening": "a", "same_grasps": "b", "sensor_gain": "", "element_areas": "d"}
    assert notes(told | {"others_calibrations": "c", "rank": 3.0}) == ("a", "b", "c", "d", "e")
