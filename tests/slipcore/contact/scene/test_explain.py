"""What a scene's explanation says, held against what is known of the scene."""

import dataclasses

import numpy as np
import pytest

from slipcore.contact.effects import (
    DroppedFrames,
    ElasticObject,
    FiniteLayer,
    FlatSurface,
    ForceNoise,
    FrictionPatch,
    GelDrift,
    MarkerNoise,
    NormalTangentialCoupling,
    ObjectMotion,
    SensorSampling,
    SphereSurface,
    TangentialLoad,
)
from slipcore.contact.errors import ManyRuns
from slipcore.contact.plan.plan import Effect
from slipcore.contact.scene import Finger, Scene
from slipcore.contact.scene import explain as explaining
from slipcore.contact.scene.explain import Explanation, explain
from slipcore.contact.tiers.boundary_elements import run
from slipcore.frames import GraspLog

LOAD, SENSOR = TangentialLoad((2.0, 0.0)), SensorSampling()
GEL = Finger(thickness=5e-3)


def explained(*effects: Effect, finger: Finger | None = None) -> Explanation:
    return explain(Scene("test", (*effects, SENSOR), finger=Finger() if finger is None else finger))


def proposed(explanation: Explanation) -> set[tuple[str, str]]:
    return {(proposal.action, proposal.effect) for proposal in explanation.proposals}


@pytest.fixture(scope="module")
def sheared() -> Explanation:
    return explained(LOAD, MarkerNoise(1e-6), ElasticObject(1e15), finger=GEL)


def test_every_effect_in_play_is_listed_with_its_reason(sheared: Explanation) -> None:
    assert [report.name for report in sheared.effects] == [
        "TangentialLoad",
        "MarkerNoise",
        "ElasticObject",
        "SensorSampling",
    ]
    assert all(report.why and report.cost for report in sheared.effects)


def test_cost_and_change_are_measured(sheared: Explanation) -> None:
    load, noise, stiff, _ = sheared.effects
    assert load.applications > 10  # the tangential solver runs for nothing else
    assert load.change.stick_ratio > 0.3  # Cattaneo–Mindlin at half of the sliding force: 1 − ½^⅔ = 0.37 slips
    assert noise.applications == 0  # observation never reaches the mechanics
    assert noise.change.stick_ratio == noise.change.force == 0.0
    assert noise.change.displacement > 0.0
    assert stiff.applications > 0
    assert stiff.change.largest < 1e-3


def test_what_is_only_observed_takes_no_run_of_the_mechanics(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    def counted(*arguments: object) -> GraspLog:
        made.append(1)
        return run(*arguments)

    monkeypatch.setattr(explaining, "run", counted)
    seen = (MarkerNoise(1e-6), ForceNoise(1e-3), GelDrift((1e-7, 0.0, 0.0)), DroppedFrames(0.2))
    found = explain(Scene("observed", (LOAD, *seen, SENSOR)))
    assert len(made) == 2  # with all effects, and without the load
    assert len(found.effects) == 6
    assert all(report.seconds == report.applications == 0 for report in found.effects[1:])
    assert found.effects[1].change.displacement > 0.0


def test_more_than_five_runs_must_be_asked_for_and_say_their_price(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    def counted(*arguments: object) -> GraspLog:
        made.append(1)
        return run(*arguments)

    monkeypatch.setattr(explaining, "run", counted)
    mechanics = (LOAD, SphereSurface(10.0), ElasticObject(1e7), FiniteLayer(5e-3), FrictionPatch(0.1, (0.0, 0.0), 1e-3))
    scene = Scene("many", (*mechanics, SENSOR), finger=GEL)
    with pytest.raises(ManyRuns, match=r"6, about .* s in all") as refused:
        scene.explain()
    assert len(made) == 1
    assert refused.value.seconds > 0.0
    assert len(scene.explain(all_runs=True).effects) == 6
    assert len(made) == 7


def test_an_effect_that_changes_nothing_may_be_left_out(sheared: Explanation) -> None:
    assert ("leave out", "ElasticObject") in proposed(sheared)
    assert ("leave out", "TangentialLoad") not in proposed(sheared)


def test_a_layer_is_proposed_where_the_gel_is_thin_against_the_contact(sheared: Explanation) -> None:
    assert ("add", "FiniteLayer") in proposed(sheared)
    assert ("add", "FiniteLayer") not in proposed(explained(LOAD))
    assert ("add", "FiniteLayer") not in proposed(explained(LOAD, finger=Finger(thickness=0.1)))


def test_a_layer_wants_coupling_and_so_does_a_compressible_gel() -> None:
    assert ("add", "NormalTangentialCoupling") in proposed(explained(LOAD, FiniteLayer(5e-3), finger=GEL))
    both = explained(LOAD, FiniteLayer(5e-3), NormalTangentialCoupling(), finger=GEL)
    assert proposed(both) == set()
    assert ("add", "NormalTangentialCoupling") in proposed(explained(LOAD, finger=Finger(poisson_ratio=0.3)))


def test_a_contact_beside_the_sensors_centre_wants_its_moment() -> None:
    off = FlatSurface((4e-3, 4e-3), centre=(0.0, 3e-3))
    assert ("add", "Torsion") in proposed(explained(LOAD, off, finger=Finger(radius=np.inf)))
    assert ("add", "Torsion") not in proposed(explained(LOAD))


def test_sliding_wants_friction_that_depends_on_velocity_and_a_small_contact_a_finer_sensor() -> None:
    slide = explained(ObjectMotion((1.0, 2.0), x=(0.0, 4e-3)))
    assert ("add", "VelocityFriction") in proposed(slide)
    coarse = explain(Scene("coarse", (LOAD, SensorSampling((6, 6), 2e-3))))
    assert ("add", "SensorSampling") in proposed(coarse)


def test_an_effect_that_the_scene_cannot_do_without_says_why() -> None:
    patch = FrictionPatch(0.4, (0.0, 0.0), 1.0)
    explanation = explained(TangentialLoad((6.0, 0.0)), patch)  # 60 % of μF_N with the patch, 150 % without
    report = next(r for r in explanation.effects if r.name == "FrictionPatch")
    assert report.change is None
    assert "friction carries" in report.note


def test_the_text_names_every_effect_and_proposal(sheared: Explanation) -> None:
    text = str(sheared)
    for report in sheared.effects:
        assert report.name in text
        assert report.why in text
    for proposal in sheared.proposals:
        assert f"{proposal.action} {proposal.effect}: {proposal.reason} [{proposal.source}]" in text


def test_a_scene_explains_itself_and_its_record_is_frozen() -> None:
    explanation = Scene("press").explain()
    assert explanation.scene == "press"
    assert explanation.effects == ()
    with pytest.raises(dataclasses.FrozenInstanceError):
        explanation.scene = "other"  # type: ignore[misc]


def test_a_scene_without_friction_is_explained_too() -> None:
    explanation = explain(Scene("slippery", (SENSOR,), friction=0.0))
    assert "NormalTangentialCoupling" not in {effect for _, effect in proposed(explanation)}
