"""What friction and slip by reconstructed forces are judged by."""

import base64
import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.forces import friction as gel_friction
from benchmarks.forces.friction import FRICTION, GRASPS, IN_PLANE, SCATTER, WITH_DEPTH, Outcome
from estimators import Moments, fit
from slipcore import FrictionSamples, GraspLog, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp

AREA = 0.75e-3**2


@pytest.fixture(scope="module")
def ramp() -> GraspLog:
    return tangential_ramp(points=8, pitch=1e-3, schedule=RampSchedule(0.1, 0.3, 0.1, 0.4, 0.1))


def samples(friction: float, rng: np.random.Generator) -> FrictionSamples:
    """Of a grasp whose friction scatters by a hundredth."""
    count = 60
    normal = rng.uniform(0.05, 0.15, count)
    ratio = friction * (1.0 + 0.01 * rng.standard_normal(count))
    element, time = np.arange(count) % 20, np.arange(count) / 30.0
    return FrictionSamples(ratio, rng.uniform(1e-4, 2e-3, count), normal, ratio * normal, time, element,
                           np.ones(count), AREA)  # fmt: skip


def outcome(seed: int, seen: str = WITH_DEPTH) -> Outcome:
    rng = np.random.default_rng(seed)
    friction = FRICTION * (1.0 + SCATTER * rng.standard_normal())
    known = samples(friction, rng)
    intercept, level, moments = gel_friction.by_model(known)
    contact, interval = (friction, (0.97 * friction, 1.03 * friction)) if seen == WITH_DEPTH else (np.nan,) * 2
    return Outcome(
        seen, seen == WITH_DEPTH, 1e-6, seed, friction, len(known), intercept, level, moments, contact,
        interval if seen == WITH_DEPTH else (np.nan, np.nan), (0.95, 0.9 + 0.06 * (seed == 3), 0.99),
    )  # fmt: skip


def test_grasps_scatter_about_the_material_and_are_all_other_ones() -> None:
    scenes, friction = zip(*map(gel_friction.grasp, range(GRASPS)), strict=True)
    assert np.mean(friction) == pytest.approx(FRICTION, rel=1e-12)
    assert np.std(friction) == pytest.approx(SCATTER * FRICTION, rel=0.05)
    assert len({scene.press.force for scene in scenes}) == len({repr(scene) for scene in scenes}) == GRASPS
    assert [scene.friction for scene in scenes] == list(friction)


@pytest.mark.parametrize("seen", [WITH_DEPTH, IN_PLANE])
def test_a_sensor_is_left_its_markers_and_the_gripper(ramp: GraspLog, seen: str) -> None:
    blind = gel_friction.without_forces(ramp, seen, 1e-6, np.random.default_rng(1))
    assert blind.force is blind.normal is blind.object_pose is blind.truth is blind.contact is None
    assert blind.displacement[..., 2].any() == (seen == WITH_DEPTH)
    assert (blind.displacement - ramp.displacement)[..., :2].std() == pytest.approx(1e-6, rel=0.05)
    assert ramp.force is not None
    assert blind.gripper_force is not None
    true = -ramp.force[..., 2].sum(axis=(1, 2))
    factor = blind.gripper_force[true > 0.0] / true[true > 0.0]
    np.testing.assert_allclose(factor, factor[0], rtol=1e-12)
    assert 0.0 < abs(factor[0] - 1.0) < 5.0 * gel_friction.GRIPPER_ERROR
    contact = gel_friction.touching(blind).contact
    assert contact is None if seen == WITH_DEPTH else contact is not None and contact.all()


def test_slip_is_judged_in_true_contact(ramp: GraspLog) -> None:
    assert ramp.truth is not None
    assert 0.5 < gel_friction.f1(ramp, detect_slip(ramp)) <= 1.0


def test_a_model_tells_level_and_intercept_and_keeps_its_moments() -> None:
    known = samples(0.5, np.random.default_rng(2))
    intercept, level, moments = gel_friction.by_model(known)
    assert level == pytest.approx(0.5, rel=0.01)
    assert intercept == pytest.approx(0.5, rel=0.05)
    assert Moments.from_bytes(base64.b64decode(moments)).n == len(known)
    nothing = gel_friction.by_model(known.take(np.zeros(len(known), dtype=bool)))
    assert (np.isnan(nothing[:2]).all(), nothing[2]) == (True, "")


def test_a_grasp_of_another_friction_has_the_moments_of_as_much_larger_ratios() -> None:
    known = samples(0.5, np.random.default_rng(2))
    moments = base64.b64encode(Moments.from_samples(known).to_bytes()).decode()
    found = gel_friction.with_friction(replace(outcome(2), truth=0.5, moments=moments), 0.6)
    ratio = 1.2 * known.friction_coefficient
    expected = Moments.from_samples(replace(known, friction_coefficient=ratio, tangential_force=ratio))
    models = [fit([each], method="hierarchical") for each in (found, expected)]
    np.testing.assert_allclose(models[0].coefficients, models[1].coefficients, rtol=1e-6)
    np.testing.assert_allclose(found.factor.mean, expected.factor.mean, rtol=1e-12)


def test_materials_are_met_within_their_intervals_about_as_often_as_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gel_friction, "MATERIALS", 8)
    found, inside = gel_friction.materials([outcome(seed) for seed in range(40)])
    np.testing.assert_allclose(found.mean(axis=0), FRICTION, rtol=0.03)
    assert (inside.mean(axis=0) > 0.8).all()
    assert gel_friction.materials([outcome(1)])[0].size == 0


def test_what_is_known_is_not_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def outcomes(seen: str, noise: float, seed: int) -> Iterator[Outcome]:
        made.append((seen, noise, seed))
        yield Outcome(seen, True, noise, seed, 0.4, 0, np.nan, np.nan, "", np.nan, (np.nan, np.nan), (0.9, 0.8, 1.0))

    monkeypatch.setattr(gel_friction, "outcomes", outcomes)
    path = tmp_path / "known.jsonl"
    gel_friction.campaign(path, {WITH_DEPTH: 1, IN_PLANE: 1})
    found = gel_friction.campaign(path, {WITH_DEPTH: 3, IN_PLANE: 1})
    assert len(made) == len(set(made)) == len(found) == 2 * (3 + 1)
    assert len(path.read_text().splitlines()) == len(found)
    assert len(gel_friction.campaign(path, {WITH_DEPTH: 2})) == 2 * 2
    assert json.loads(path.read_text().splitlines()[0]).keys() == asdict(found[0]).keys()


def test_tables_and_picture_have_all_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gel_friction, "MATERIALS", 2)
    found = [*map(outcome, range(6)), outcome(7, IN_PLANE)]
    rows = gel_friction.friction_table(found).splitlines()[2:]
    assert [row.split(" | ")[0] for row in rows] == ["| with z", "| in the plane"]
    assert "| known | 6 | 60 |" in rows[0]
    assert rows[0].endswith("| 100% | +0.0 ± 0.0 | 100% |")
    assert rows[1].endswith("| – | – | 0% | – | – |")
    slip = gel_friction.slip_table(found).splitlines()[2]
    assert slip.endswith("| 0.910 | 0.950 | 0.990 | 17% | 0.010 |")
    assert len(gel_friction.picture(found).axes) == 3
