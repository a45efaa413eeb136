import itertools
from dataclasses import replace

import numpy as np
import pytest

from slipcore.contact.defaults import REFERENCE
from slipcore.contact.errors import InfeasibleLoad, NotConverged
from slipcore.contact.reference import beam_chain
from slipcore.contact.reference.beam_chain import BeamLattice, drag, follow, layer_beams, push, unloaded
from slipcore.contact.reference.bonded_layer import BondedLayer
from slipcore.errors import InvalidInput

CHAIN = BeamLattice((41, 1), 0.5e-3, 40.0, 300.0)
PATCH = BeamLattice((15, 12), 0.5e-3, 40.0, 300.0)


def pressed(lattice: BeamLattice, total: float, radius: float) -> np.ndarray:
    """Coulomb limits with the shape of a Hertz pressure."""
    limit = np.sqrt(np.maximum(1.0 - (lattice.position**2).sum(-1) / radius**2, 0.0))
    return limit * total / limit.sum()


def sheared(distance: np.ndarray) -> np.ndarray:
    return np.stack([distance, 0 * distance, 0 * distance], axis=-1)


def matrix(lattice: BeamLattice) -> np.ndarray:
    """Stiffness of one component, beam by beam from the energy ½Σ b u² + ½Σ k (u_i − u_j)²."""
    n, m = lattice.shape
    k = lattice.bending * np.eye(n * m)
    for i, j in itertools.product(range(n), range(m)):
        for other in ((i + 1, j), (i, j + 1)):
            if other[0] < n and other[1] < m:
                a, b = i * m + j, other[0] * m + other[1]
                k[a, a] += lattice.coupling
                k[b, b] += lattice.coupling
                k[a, b] -= lattice.coupling
                k[b, a] -= lattice.coupling
    return k


@pytest.mark.parametrize("lattice", [CHAIN, PATCH, BeamLattice((1, 1), 1e-3, 2.0, 5.0)])
def test_force_and_displacement_are_the_stiffness_and_its_inverse(lattice: BeamLattice) -> None:
    u = np.random.default_rng(3).standard_normal((*lattice.shape, 2))
    expected = (matrix(lattice) @ u.reshape(-1, 2)).reshape(u.shape)
    np.testing.assert_allclose(lattice.force(u), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(lattice.displacement(lattice.force(u)), u, rtol=1e-11, atol=1e-13)


def test_while_all_stick_the_solution_is_the_linear_one() -> None:
    limit = pressed(PATCH, 1e6, 2.4e-3)
    state = drag(PATCH, unloaded(PATCH), np.array([2e-4, -1e-4, 0.05]), limit, tolerance=1e-15)
    touching = (limit > 0.0).ravel()
    assert 0 < touching.sum() < touching.size
    k, u = matrix(PATCH), PATCH.carried(np.array([2e-4, -1e-4, 0.05])).reshape(-1, 2)
    free = -np.linalg.solve(k[np.ix_(~touching, ~touching)], k[np.ix_(~touching, touching)] @ u[touching])
    u[~touching] = free
    np.testing.assert_allclose(state.displacement.reshape(-1, 2), u, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(state.force.reshape(-1, 2)[touching], (k @ u)[touching], rtol=1e-8)
    assert (state.slip == 0.0).all()


def test_a_short_chain_matches_the_one_consistent_set_of_states() -> None:
    lattice, limit = BeamLattice((6, 1), 1e-3, 30.0, 50.0), np.array([[0.2], [0.9], [0.5], [1.5], [0.6], [0.1]]) * 1e-2
    k, distance, found = matrix(lattice), 2.5e-4, []
    for signs in itertools.product((0, -1, 1), repeat=6):  # stuck, or force at the limit along −x or +x
        at_limit = np.array(signs) != 0
        u = np.full(6, distance)
        force = np.array(signs) * limit[:, 0]
        if at_limit.any():
            known = k[np.ix_(at_limit, ~at_limit)] @ u[~at_limit]
            u[at_limit] = np.linalg.solve(k[np.ix_(at_limit, at_limit)], force[at_limit] - known)
        held = k @ u
        lag = (distance - u) * np.sign(held)
        if (np.abs(held) <= limit[:, 0] * (1 + 1e-12)).all() and (lag[at_limit] >= -1e-18).all():
            found.append(u)
    assert len(found) == 1
    state = drag(lattice, unloaded(lattice), np.array([distance, 0.0, 0.0]), limit)
    np.testing.assert_allclose(state.displacement[:, 0, 0], found[0], rtol=1e-8)


def test_every_state_satisfies_equilibrium_limit_and_complementarity() -> None:
    limit = pressed(PATCH, 3.0, 2.8e-3)
    state = drag(PATCH, unloaded(PATCH), np.array([4e-4, 2e-4, 0.05]), limit)
    size = np.hypot(*np.moveaxis(state.force, -1, 0))
    slipping = (state.slip != 0.0).any(-1)
    assert 0 < slipping.sum() < (limit > 0).sum()
    assert (size <= limit + 1e-9 * limit.max()).all()
    np.testing.assert_allclose(size[slipping], limit[slipping], rtol=1e-6)
    dissipated = -(state.slip * state.force).sum(-1)[slipping]
    opposite = np.linalg.norm(state.slip, axis=-1)[slipping] * size[slipping]
    np.testing.assert_allclose(dissipated, opposite, rtol=1e-5)
    np.testing.assert_allclose(state.force[limit == 0.0], 0.0, atol=1e-9 * limit.max())
    assert state.residual <= REFERENCE.beam_tolerance


def test_over_relaxation_keeps_strongly_coupled_beams_cheap() -> None:
    lattice = BeamLattice((20, 20), 0.75e-3, 1.0, 100.0)
    limit = pressed(lattice, 2.0, 5e-3)
    state = drag(lattice, unloaded(lattice), np.array([2e-3, 0.0, 0.0]), limit)
    assert (state.slip != 0.0).any()
    assert state.sweeps < 250  # plain Gauss–Seidel needs 861


def test_case_1_slip_runs_inward_and_each_strain_rate_peaks_when_slip_arrives() -> None:
    distance = np.linspace(0.0, 3.2e-3, 161)
    limit = pressed(CHAIN, 2.0, 8.2e-3)
    history = follow(CHAIN, sheared(distance), np.repeat(limit[None], len(distance), axis=0))
    slipping = history.slip_contact_factor[:, :, 0]
    contact = np.flatnonzero(limit[:, 0] > 0.0)
    onset = np.array([np.argmax(slipping[:, i]) for i in contact])
    half = len(contact) // 2
    assert slipping[-1, contact].all()
    assert (np.diff(onset[: half + 1]) >= 0).all()  # from the edge to the middle
    np.testing.assert_array_equal(onset, onset[::-1])
    rate = np.diff(np.diff(history.displacement[:, :, 0, 0], axis=1), axis=0)  # of the spring between two beams
    for i in contact[2 : half - 2]:
        start = np.argmax(slipping[:, i])
        assert np.abs(rate[: start - 2, i]).max() < 1e-6 * rate[:, i].max()
        assert start - 2 <= np.argmax(rate[:, i]) <= np.argmax(slipping[:, i + 1])


def test_case_2_more_normal_force_sticks_everything_and_delays_the_next_slip() -> None:
    distance = np.concatenate([np.linspace(0, 1e-3, 21), np.full(10, 1e-3), np.linspace(1e-3, 2e-3, 21)])
    total = np.concatenate([np.full(21, 2.0), np.linspace(2.0, 3.0, 10), np.full(21, 3.0)])
    limits = np.stack([pressed(CHAIN, t, 8.2e-3) for t in total])
    history = follow(CHAIN, sheared(distance), limits)
    assert history.slip_contact_factor[20].any()
    assert not history.slip_kinematic[21:31].any()
    assert not history.slip_contact_factor[22:31].any()
    np.testing.assert_allclose(history.displacement[30], history.displacement[20], rtol=1e-9, atol=1e-13)
    assert history.slip_kinematic[-1].any()
    plain = follow(CHAIN, sheared(distance), np.repeat(limits[:1], len(distance), axis=0))
    assert history.slip_contact_factor[-1].sum() < plain.slip_contact_factor[-1].sum()


def test_case_3_a_reversal_sticks_everything_at_once_and_slips_back_after_twice_the_way() -> None:
    distance = np.concatenate([np.linspace(0, 1e-3, 41), np.linspace(1e-3, -1e-3, 81)[1:]])
    limits = np.repeat(pressed(CHAIN, 2.0, 8.2e-3)[None], len(distance), axis=0)
    history = follow(CHAIN, sheared(distance), limits)
    strain = np.diff(history.displacement[:, :20, 0, 0], axis=1)  # the half that slipped first
    assert history.slip_kinematic[40].any()
    assert not history.slip_kinematic[41].any()
    assert (np.diff(strain[40:46], axis=0)[0] <= 1e-12).all()
    first = int(np.argmax(history.slip_kinematic[1:40].any(axis=(1, 2)))) + 1
    again = int(np.argmax(history.slip_kinematic[41:].any(axis=(1, 2)))) + 41
    assert abs((again - 40) - 2 * first) <= 1
    np.testing.assert_allclose(history.force[-1], -history.force[40], atol=1e-8 * limits.max())  # Masing
    assert (np.abs(history.force[60:100, 15:26, 0, 0]) < limits[0, 15:26, 0]).any()


@pytest.mark.parametrize("load", [[1.2, 0.0, 0.0], [0.5, -0.9, 1e-3], [0.0, 0.0, -2e-3]])
def test_a_given_load_is_carried(load: list[float]) -> None:
    limit = pressed(PATCH, 2.0, 2.8e-3)
    state = push(PATCH, unloaded(PATCH), np.array(load), limit)
    np.testing.assert_allclose(PATCH.resultants(state.force), load, atol=1e-8)
    assert (state.slip != 0.0).any()
    further = push(PATCH, state, 1.05 * np.array(load), limit)
    assert np.abs(further.pose).sum() > np.abs(state.pose).sum()


def test_loads_that_friction_cannot_carry_are_refused_by_name() -> None:
    limit = pressed(PATCH, 2.0, 2.8e-3)
    for load in ([2.001, 0.0, 0.0], [0.0, 0.0, 1.0], [0.1, 0.0, 0.0]):
        with pytest.raises(InfeasibleLoad, match="tangential load"):
            push(PATCH, unloaded(PATCH), np.array(load), limit if load[0] != 0.1 else 0 * limit)


def test_without_contact_the_beams_stand_straight() -> None:
    state = drag(CHAIN, unloaded(CHAIN), np.array([1e-3, 0.0, 0.0]), pressed(CHAIN, 2.0, 5e-3))
    free = drag(CHAIN, state, np.array([2e-3, 0.0, 0.0]), np.zeros(CHAIN.shape))
    assert (free.displacement == 0.0).all()
    np.testing.assert_array_equal(free.pose, [2e-3, 0.0, 0.0])


def test_a_long_wave_sees_the_layer_that_the_beams_stand_for() -> None:
    thickness, pitch, n = 2e-3, 0.5e-3, 400
    for nu in (0.0, 0.49):
        beams, layer = layer_beams((n, 1), pitch, thickness, 1e6, nu), BondedLayer(thickness, 1e6, nu)
        k = 3 * np.pi / (n * pitch)
        wave = np.cos(k * (np.arange(n) + 0.5) * pitch)[:, None, None] * np.array([1.0, 0.0])
        compliance = np.linalg.norm(beams.displacement(wave)) / np.linalg.norm(wave) * pitch**2
        exact = 0.5 * (layer.modes(k).longitudinal + layer.modes(k).transverse)
        flat = layer.modes(0.0).transverse
        assert abs(compliance - exact) < 0.05 * abs(flat - exact)


def test_unconverged_beams_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beam_chain, "REFERENCE", replace(REFERENCE, beam_sweeps=2))
    with pytest.raises(NotConverged, match="beam lattice"):
        drag(PATCH, unloaded(PATCH), np.array([1e-3, 0.0, 0.0]), pressed(PATCH, 2.0, 2.8e-3))


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (((0, 1), 1e-3, 1.0, 1.0), "shape"),
        (((2, 1), 0.0, 1.0, 1.0), "pitch"),
        (((2, 1), 1e-3, 0.0, 1.0), "bending"),
        (((2, 1), 1e-3, 1.0, -1.0), "coupling"),
    ],
)
def test_impossible_lattices_are_refused_by_name(
    arguments: tuple[tuple[int, int], float, float, float], name: str
) -> None:
    with pytest.raises(InvalidInput, match=name):
        BeamLattice(*arguments)


@pytest.mark.parametrize("limit", [np.zeros((3, 3)), np.full((41, 1), -1.0), np.full((41, 1), np.nan)])
def test_impossible_limits_are_refused_by_name(limit: np.ndarray) -> None:
    with pytest.raises(InvalidInput, match="limit"):
        drag(CHAIN, unloaded(CHAIN), np.zeros(3), limit)


def test_a_moment_is_carried_up_to_what_friction_holds_about_the_middle() -> None:
    limit = pressed(PATCH, 2.0, 2.8e-3)
    most = float((np.hypot(*np.moveaxis(PATCH.position, -1, 0)) * limit).sum())
    state = push(PATCH, unloaded(PATCH), np.array([0.0, 0.0, 0.99 * most]), limit)
    assert PATCH.resultants(state.force)[2] == pytest.approx(0.99 * most, rel=1e-6, abs=0.0)
    with pytest.raises(InfeasibleLoad):
        push(PATCH, unloaded(PATCH), np.array([0.0, 0.0, 1.01 * most]), limit)
