"""Three properties of every effect: zero strength is absence, order does not matter, a known answer is met."""

import tracemalloc
from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest

from slipcore.contact.effects import (
    EFFECTS,
    CylinderSurface,
    DroppedFrames,
    ElasticObject,
    FiniteLayer,
    FlatSurface,
    ForceNoise,
    FrictionPatch,
    GelDrift,
    LoadPath,
    MarkerNoise,
    MeasuredSurface,
    NormalTangentialCoupling,
    ObjectMotion,
    PressingSpread,
    PressureFriction,
    RandomFriction,
    RingSurface,
    SensorSampling,
    SphereSurface,
    TangentialLoad,
    Torsion,
    VelocityFriction,
    Viscoelasticity,
    WavySurface,
)
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.plan.plan import Effect
from slipcore.contact.scene import Finger, Press, Scene, simulate
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

COARSE = Fidelity(cells=12, tolerance=1e-4)
SENSOR = SensorSampling(points=(6, 6), pitch=1.5e-3, frame_rate=5.0)
LOAD = TangentialLoad((2.0, 0.5))
INFINITE = float("inf")

ZERO: dict[str, Effect | None] = {
    "CylinderSurface": CylinderSurface(0.0),
    "DroppedFrames": DroppedFrames(0.0),
    "ElasticObject": ElasticObject(INFINITE),
    "FiniteLayer": FiniteLayer(INFINITE),
    "FlatSurface": FlatSurface((INFINITE, INFINITE)),
    "ForceNoise": ForceNoise(0.0),
    "FrictionPatch": FrictionPatch(0.0, (0.0, 0.0), 1e-3),
    "GelDrift": GelDrift((0.0, 0.0, 0.0)),
    "LoadPath": LoadPath((0.0, 1.0), force_x=(0.0, 0.0)),
    "MarkerNoise": MarkerNoise(0.0),
    "ObjectMotion": ObjectMotion((0.0, 1.0)),
    "PressureFriction": PressureFriction(0.0, 1e-6),
    "RandomFriction": RandomFriction(0.0, 1e-3),
    "RingSurface": RingSurface(4e-3, INFINITE),
    "SphereSurface": SphereSurface(0.0),
    "TangentialLoad": TangentialLoad((0.0, 0.0)),
    "Torsion": Torsion(0.0),
    "VelocityFriction": VelocityFriction(0.0),
    "Viscoelasticity": Viscoelasticity((0.0,), (1.0,)),
    "WavySurface": WavySurface(0.0, 1e-3),
}
"""Each effect at zero strength; those that have no strength are in ALWAYS."""
ALWAYS = {"MeasuredSurface", "NormalTangentialCoupling", "PressingSpread", "SensorSampling"}

STRONG: tuple[Effect, ...] = (
    CylinderSurface(20.0),
    DroppedFrames(0.3),
    ElasticObject(2e6),
    FiniteLayer(6e-3),
    ForceNoise(1e-3),
    FrictionPatch(-0.1, (1e-3, 0.0), 2e-3),
    GelDrift((1e-6, 0.0, 0.0)),
    LoadPath((1.2, 1.6, 2.0), force_y=(0.0, 0.5, 0.0)),
    MarkerNoise(1e-6),
    PressureFriction(-0.2, 2e-6),
    RandomFriction(0.03, 1e-3),
    SphereSurface(20.0),
    Torsion(2e-3),
    VelocityFriction(0.2),
    Viscoelasticity((0.3,), (0.5,)),
    WavySurface(2e-6, 2e-3),
)


def scene(*effects: Effect) -> Scene:
    return Scene("test", effects, finger=Finger(poisson_ratio=0.4))


def test_waves_are_zero_at_their_crests_and_twice_their_amplitude_deep_between() -> None:
    (height,) = WavySurface(2e-6, 3e-3, angle=0.4).extend(scene().plan()).problem.heights[-1:]
    along = 3e-3 * np.array([0.0, 0.5, 1.0, 1.25])
    depth = height(along * np.cos(0.4), along * np.sin(0.4))
    np.testing.assert_allclose(depth, [0.0, 4e-6, 0.0, 2e-6], rtol=0, atol=1e-18, err_msg="A (1 − cos 2πx/λ)")


def identical(a: GraspLog, b: GraspLog) -> None:
    for name in ("time", "displacement", "force", "object_pose", "position"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    for entry in fields(a.truth):
        got, expected = getattr(a.truth, entry.name), getattr(b.truth, entry.name)
        assert got == expected if entry.name == "friction" else np.array_equal(got, expected, equal_nan=True)


@pytest.fixture(scope="module")
def plain() -> GraspLog:
    return simulate(scene(LOAD, SENSOR), fidelity=COARSE)


def test_every_effect_is_held_to_the_three_properties() -> None:
    assert set(ZERO) | ALWAYS == set(EFFECTS)


@pytest.mark.parametrize("name", ZERO)
def test_zero_strength_equals_absence_to_the_last_bit(name: str, plain: GraspLog) -> None:
    effect = ZERO[name]
    assert effect is not None
    log = simulate(scene(effect, LOAD, SENSOR), fidelity=COARSE)
    identical(log, plain)
    assert log.metadata["applications"] == plain.metadata["applications"]


CELLS = 32
FIELD = 8 * CELLS**2
"""Bytes of one field on the grid; what measures the coverage of tests takes a fifth of that."""


def allocated(*effects: Effect) -> int:
    """Bytes at most that solving two steps takes."""
    plan = scene(*effects, LOAD, SENSOR).plan()
    grid = Grid.square(CELLS, 11e-3)
    tracemalloc.start()
    solver = QuasiStatic(plan.problem, grid, 1e-3)
    kept = list(solver.run([plan.load(0.0, 1.0), plan.load(1.0, 1.5)]))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(kept) == 2
    return peak


@pytest.mark.parametrize("name", ZERO)
def test_an_absent_effect_adds_nothing_to_the_plan_and_allocates_nothing(name: str) -> None:
    effect = ZERO[name]
    assert effect is not None
    plan, without = scene(effect, LOAD, SENSOR).plan(), scene(LOAD, SENSOR).plan()
    assert len(plan.histories) == len(without.histories)
    assert plan.observations == without.observations
    for entry in fields(plan.problem):
        part, other = getattr(plan.problem, entry.name), getattr(without.problem, entry.name)
        assert len(part) == len(other) if isinstance(part, tuple) else part == other
    # what is not yet freed, and what threads of other tests allocate, comes and goes: each try has its own comparison
    assert any(allocated(effect) <= allocated() + FIELD // 2 for _ in range(8))


def test_the_counts_tell_an_effect_that_costs_from_one_that_does_not(plain: GraspLog) -> None:
    allocated()
    assert allocated(Viscoelasticity((0.3,), (0.5,))) > allocated() + FIELD // 2
    coupled = simulate(scene(NormalTangentialCoupling(), LOAD, SENSOR), fidelity=COARSE)
    assert int(coupled.metadata["applications"]) > int(plain.metadata["applications"])


def test_order_does_not_matter_to_the_last_bit() -> None:
    effects = (*STRONG, LOAD, SENSOR)
    log = simulate(scene(*effects), fidelity=COARSE)
    identical(simulate(scene(*effects[::-1]), fidelity=COARSE), log)


@pytest.mark.parametrize(
    "pair",
    [
        (ObjectMotion((0.0, 1.0), x=(0.0, 1e-4)), TangentialLoad((1.0, 0.0))),
        (ObjectMotion((0.0, 1.0), yaw=(0.0, 1e-2)), Torsion(1e-3)),
        (SensorSampling(), SensorSampling((10, 10))),
        (FiniteLayer(5e-3), FiniteLayer(6e-3)),
    ],
)
def test_pairs_that_exclude_each_other_are_refused_in_any_order(pair: tuple[Effect, Effect]) -> None:
    for effects in (pair, pair[::-1]):
        with pytest.raises(InvalidInput):
            scene(*effects)


@pytest.mark.parametrize("effect", STRONG, ids=lambda effect: type(effect).__name__)
def test_each_effect_shows(effect: Effect, plain: GraspLog) -> None:
    log = simulate(scene(effect, LOAD, SENSOR), fidelity=COARSE)
    same_time = len(log) == len(plain)
    assert not same_time or not (
        np.array_equal(log.displacement, plain.displacement) and np.array_equal(log.force, plain.force)
    )


@pytest.mark.parametrize("effect", [MarkerNoise(1e-6), ForceNoise(1e-3), GelDrift((1e-6, 0.0, 0.0))], ids=str)
def test_observation_never_touches_the_mechanics(effect: Effect, plain: GraspLog) -> None:
    log = simulate(scene(effect, LOAD, SENSOR), fidelity=COARSE)
    np.testing.assert_array_equal(log.object_pose, plain.object_pose)
    np.testing.assert_array_equal(log.truth.slip_kinematic, plain.truth.slip_kinematic)
    np.testing.assert_array_equal(log.truth.stick_ratio, plain.truth.stick_ratio)


# Known answers


def test_loads_reach_the_finger(plain: GraspLog) -> None:
    total = plain.force.sum(axis=(1, 2))
    np.testing.assert_allclose(total[-1], [2.0, 0.5, -10.0], rtol=1e-9, atol=1e-9)
    twisted = simulate(scene(Torsion(3e-3), SENSOR), fidelity=COARSE)
    x, y = twisted.position[..., 0], twisted.position[..., 1]
    # elements hold no moment of their own: the sum over them misses that within each
    moment = (x * twisted.force[-1, ..., 1] - y * twisted.force[-1, ..., 0]).sum()
    assert moment == pytest.approx(3e-3, rel=0.05)
    assert twisted.object_pose[-1, 2] > 0.0


def test_a_load_path_is_met_at_its_corners_and_repeats() -> None:
    path = LoadPath((1.0, 1.5, 2.0), force_x=(0.0, 2.0, 0.0), cycles=2)
    log = simulate(Scene("loop", (path, SENSOR), duration=3.0), fidelity=COARSE)
    along_x = log.force[..., 0].sum(axis=(1, 2))
    np.testing.assert_allclose(along_x, np.interp(log.time, [0, 1, 1.5, 2, 2.5, 3], [0, 0, 2, 0, 2, 0]), atol=1e-9)


def test_a_moved_object_is_where_it_was_moved() -> None:
    log = simulate(scene(ObjectMotion((1.0, 2.0), x=(0.0, 2e-4), yaw=(0.0, 0.01)), SENSOR), fidelity=COARSE)
    np.testing.assert_allclose(log.object_pose[-1, [0, 2]], [2e-4, 0.01], rtol=1e-12)
    assert log.force[-1, ..., 0].sum() > 0.0
    assert log.force[-1, ..., 1].sum() == pytest.approx(0.0, abs=1e-9)


def test_an_object_as_soft_as_the_finger_doubles_the_compliance() -> None:
    soft = simulate(Scene("soft", (ElasticObject(1e6, 0.49), LOAD, SENSOR)), fidelity=COARSE)
    twice = simulate(Scene("twice", (LOAD, SENSOR), finger=Finger(young_modulus=0.5e6)), fidelity=COARSE)
    np.testing.assert_allclose(soft.object_pose, twice.object_pose, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(2.0 * soft.displacement, twice.displacement, rtol=0.0, atol=1e-8)
    np.testing.assert_array_equal(soft.truth.slip_contact_factor, twice.truth.slip_contact_factor)


def test_a_stiff_object_is_a_rigid_one(plain: GraspLog) -> None:
    stiff = simulate(scene(ElasticObject(1e15), LOAD, SENSOR), fidelity=COARSE)
    np.testing.assert_allclose(stiff.displacement, plain.displacement, rtol=0.0, atol=1e-9)


def test_a_sphere_on_the_finger_is_a_more_curved_finger() -> None:
    on_sphere = simulate(Scene("sphere", (SphereSurface(1.0 / 15e-3), LOAD, SENSOR)), fidelity=COARSE)
    curved = simulate(Scene("curved", (LOAD, SENSOR), finger=Finger(radius=7.5e-3)), fidelity=COARSE)
    np.testing.assert_allclose(on_sphere.displacement, curved.displacement, rtol=0.0, atol=1e-9)


def test_two_crossed_cylinders_are_a_sphere() -> None:
    crossed = simulate(
        Scene("crossed", (CylinderSurface(30.0), CylinderSurface(30.0, np.pi / 2), SENSOR)), fidelity=COARSE
    )
    sphere = simulate(Scene("sphere", (SphereSurface(30.0), SENSOR)), fidelity=COARSE)
    np.testing.assert_allclose(crossed.displacement, sphere.displacement, rtol=0.0, atol=1e-10)


def test_waves_much_longer_than_the_contact_are_a_cylinder() -> None:
    wavelength, curvature = 0.5, 30.0
    amplitude = curvature * (wavelength / (2 * np.pi)) ** 2
    wavy = simulate(scene(WavySurface(amplitude, wavelength, np.pi / 2), SENSOR), fidelity=COARSE)
    cylinder = simulate(scene(CylinderSurface(curvature), SENSOR), fidelity=COARSE)
    np.testing.assert_allclose(wavy.displacement, cylinder.displacement, rtol=0.0, atol=1e-7)


def test_a_layer_of_a_kilometre_is_a_half_space_and_a_thin_one_is_stiffer(plain: GraspLog) -> None:
    thick = simulate(scene(FiniteLayer(1e3), LOAD, SENSOR), fidelity=COARSE)
    np.testing.assert_allclose(thick.displacement, plain.displacement, rtol=0.0, atol=1e-8)
    thin = simulate(scene(FiniteLayer(3e-3), LOAD, SENSOR), fidelity=COARSE)
    assert thin.object_pose[-1, 0] < 0.75 * plain.object_pose[-1, 0]


def test_a_measured_map_of_a_sphere_is_a_sphere() -> None:
    at = (np.arange(81) - 40) * 0.25e-3
    x, y = np.meshgrid(at, at)
    heights = tuple(tuple(row) for row in ((x**2 + y**2) * 15.0).tolist())
    measured = simulate(scene(MeasuredSurface(heights, 0.25e-3), SENSOR), fidelity=COARSE)
    sphere = simulate(scene(SphereSurface(30.0), SENSOR), fidelity=COARSE)
    error = np.abs(measured.displacement - sphere.displacement).max()
    assert error < 0.02 * np.abs(sphere.displacement).max()  # of bilinear interpolation


def test_a_ring_leaves_its_middle_free_and_a_face_ends_at_its_edges() -> None:
    flat = Finger(radius=INFINITE)
    ring = simulate(Scene("ring", (RingSurface(4e-3, 2e-3), SENSOR), finger=flat), fidelity=COARSE)
    assert not ring.truth.contact[-1, 2:4, 2:4].any()
    assert ring.truth.contact[-1].any()
    face = simulate(Scene("face", (FlatSurface((4e-3, 6e-3)), SENSOR), finger=flat), fidelity=COARSE)
    x, y = face.position[..., 0], face.position[..., 1]
    np.testing.assert_array_equal(face.truth.contact[-1], (abs(x) <= 2e-3) & (abs(y) <= 3e-3))


def test_friction_changes_with_place_pressure_and_velocity_as_asked() -> None:
    slide = ObjectMotion((1.0, 2.0), x=(0.0, 3e-3))
    law = (FrictionPatch(0.1, (0.0, 0.0), 1.0), PressureFriction(-0.3, 2.25e-6), VelocityFriction(20.0))
    log = simulate(scene(slide, *law, SENSOR), fidelity=COARSE)
    assert log.truth.friction.coefficients == (0.4, 20.0, -0.3)
    tangential, normal = np.hypot(*np.moveaxis(log.force[-1, ..., :2], -1, 0)), -log.force[-1, ..., 2]
    # all slides at about 3 mm/s; an element's friction is the mean of its cells', weighted by pressure
    pressure = normal / log.element_area
    expected = 0.5 + 20.0 * 3e-3 - 0.3 * 2.25e-6 * pressure
    middle = np.s_[2:4, 2:4]
    np.testing.assert_allclose((tangential / normal)[middle], expected[middle], rtol=0.03)


def test_random_friction_has_its_scale_its_length_and_the_same_field_on_any_grid() -> None:
    field = scene(RandomFriction(0.05, 1e-3)).plan(seed=3).problem.friction_fields[0]
    x, y = np.meshgrid(np.linspace(0.0, 0.1, 200), np.linspace(0.0, 0.1, 200))
    values = field(x, y)
    assert values.std() == pytest.approx(0.05, rel=0.05)  # 10,000 patches of one correlation length
    shifted = field(x + 1e-3, y)
    assert (values * shifted).mean() / values.var() == pytest.approx(np.exp(-0.5), abs=0.08)
    np.testing.assert_allclose(field(x[:2, :2], y[:2, :2]), values[:2, :2], rtol=0.0, atol=1e-12)
    other = scene(RandomFriction(0.05, 1e-3)).plan(seed=4).problem.friction_fields[0]
    assert abs(np.corrcoef(values.ravel(), other(x, y).ravel())[0, 1]) < 0.1


def test_creep_goes_on_under_a_constant_load() -> None:
    log = simulate(scene(Viscoelasticity((1.0,), (0.3,)), SENSOR), fidelity=COARSE)
    depth = -log.displacement[..., 2].min(axis=(1, 2))
    assert depth[-1] > 1.05 * depth[5]
    assert (np.diff(depth[5:]) > 0.0).all()


def test_spread_is_the_coupling_without_its_way_back() -> None:
    plain = simulate(scene(SENSOR), fidelity=COARSE)
    spread = simulate(scene(PressingSpread(), SENSOR), fidelity=COARSE)
    coupled = simulate(scene(NormalTangentialCoupling(), SENSOR), fidelity=COARSE)
    rounding = 1e-5 * np.abs(plain.force).max()  # the solver's: where pressing spreads there are more load steps
    np.testing.assert_allclose(spread.force[..., 2], plain.force[..., 2], rtol=0.0, atol=rounding)
    assert np.abs(spread.displacement[-1, ..., :2]).max() > 1e-7
    assert np.abs(coupled.force[-1, ..., 2] - plain.force[-1, ..., 2]).max() > 0.0
    difference = np.abs(coupled.displacement - spread.displacement).max()
    assert difference < 0.05 * np.abs(spread.displacement).max()


def test_noise_has_its_scale_and_its_own_generator(plain: GraspLog) -> None:
    noisy = simulate(scene(MarkerNoise(2e-6), LOAD, SENSOR), fidelity=COARSE, seed=1)
    noise = noisy.displacement - plain.displacement
    assert noise.std() == pytest.approx(2e-6, rel=4.0 / np.sqrt(2 * noise.size))
    both = simulate(scene(MarkerNoise(2e-6), ForceNoise(1e-3), LOAD, SENSOR), fidelity=COARSE, seed=1)
    np.testing.assert_array_equal(both.displacement, noisy.displacement)
    other = simulate(scene(MarkerNoise(2e-6), LOAD, SENSOR), fidelity=COARSE, seed=2)
    assert not np.array_equal(other.displacement, noisy.displacement)


def test_drift_grows_in_time(plain: GraspLog) -> None:
    log = simulate(scene(GelDrift((1e-6, -2e-6, 0.0)), LOAD, SENSOR), fidelity=COARSE)
    np.testing.assert_allclose(
        (log.displacement - plain.displacement)[-1, 0, 0], [2e-6, -4e-6, 0.0], rtol=1e-9, atol=1e-18
    )


def test_a_dropped_frame_hands_its_slip_on(plain: GraspLog) -> None:
    log = simulate(scene(DroppedFrames(0.6), LOAD, SENSOR), fidelity=COARSE, seed=5)
    assert 2 <= len(log) < len(plain)
    kept = np.flatnonzero(np.isin(plain.time, log.time))
    for k, (before, now) in enumerate(pairwise(kept), start=1):
        expected = plain.truth.slip_kinematic[before + 1 : now + 1].any(axis=0)
        np.testing.assert_array_equal(log.truth.slip_kinematic[k], expected)
    np.testing.assert_array_equal(log.displacement, plain.displacement[kept])


@pytest.mark.parametrize(
    "make",
    [
        lambda: ElasticObject(0.0),
        lambda: FiniteLayer(0.0),
        lambda: FlatSurface((0.0, 1.0)),
        lambda: RingSurface(0.0, 1.0),
        lambda: WavySurface(1e-6, 0.0),
        lambda: MeasuredSurface(((0.0,),), 1e-3),
        lambda: MeasuredSurface(((0.0, np.nan), (0.0, 0.0)), 1e-3),
        lambda: RandomFriction(-0.1, 1e-3),
        lambda: RandomFriction(0.1, 0.0),
        lambda: PressureFriction(0.1, 0.0),
        lambda: FrictionPatch(0.1, (0.0, 0.0), 0.0),
        lambda: Viscoelasticity((1.0,), ()),
        lambda: SensorSampling((1, 5)),
        lambda: MarkerNoise(-1.0),
        lambda: ForceNoise(np.nan),
        lambda: DroppedFrames(1.0),
        lambda: scene(TangentialLoad((1.0, 0.0), duration=0.0)),
        lambda: scene(LoadPath((0.0, 0.0), force_x=(0.0, 1.0))),
        lambda: scene(LoadPath((0.0, 1.0), force_x=(1.0,))),
        lambda: LoadPath((0.0, 1.0)),
        lambda: LoadPath((0.0, 1.0), force_x=(0.0, 1.0), cycles=0),
        lambda: ObjectMotion((0.0, 1.0), x=(0.0, 1e-3), cycles=-1),
        lambda: ObjectMotion((0.0, 1.0), yaw=(0.0,)),
        lambda: Scene("endless", duration=np.inf),
        lambda: Scene("none", press=Press(-1.0)),
    ],
)
def test_impossible_effects_are_refused(make) -> None:
    with pytest.raises(InvalidInput):
        make()


@pytest.mark.parametrize("force", [(0.0, 0.0), (1.0, 0.0), (0.0, -1.0), (1.0, 1.0)])
def test_a_load_along_either_axis_is_there(force: tuple[float, float]) -> None:
    load = TangentialLoad(force)
    assert load.absent == (force == (0.0, 0.0))
    assert len(load.extend(Scene("alone").plan()).histories) == len(Scene("alone").plan().histories) + sum(
        map(bool, force)
    )
