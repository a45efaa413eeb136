"""The layers that a contact has grown by, against closed forms of a sphere (Cattaneo; Mindlin and Deresiewicz)."""

import numpy as np
import pytest

from slipcore.defaults import CoarseOptions
from slipcore.detection.coarse.layers import (
    NORMAL,
    Layers,
    LayerTuning,
    PressedElements,
    load_layers,
    look_at_layers,
    no_layers,
    spread_of_stiffness,
    sums,
)
from slipcore.detection.forces_only.tuning import Considered, considered
from slipcore.frames import FloatArray

FRICTION, FORCE, RADIUS, SIDE = 0.45, 8.0, 5e-3, 6
OPTIONS = CoarseOptions()
CONSIDERED = considered(OPTIONS, LayerTuning._fields)


def fine_points() -> tuple[FloatArray, FloatArray]:
    """Points [k, 2] m, 20 × 20 to each of 6 × 6 elements over the contact's square, and the element of each."""
    i = np.arange(20 * SIDE)
    x = ((i + 0.5) / len(i) * 2.0 - 1.0) * 1.1 * RADIUS
    points = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    element = (i[:, None] // 20 * SIDE + i // 20).ravel()
    return points, element


POINTS, ELEMENT = fine_points()
PLACE = np.stack([np.bincount(ELEMENT, POINTS[:, axis]) / 400.0 for axis in (0, 1)], axis=-1)


def pressed(force: float) -> FloatArray:
    """Normal forces of elements, N, under a sphere that reached RADIUS at FORCE (Hertz: a³ goes with the force)."""
    reach = RADIUS * np.cbrt(force / FORCE)
    pressure = np.sqrt(np.maximum(reach**2 - (POINTS**2).sum(axis=-1), 0.0))
    total = np.bincount(ELEMENT, pressure)
    return total * force / max(total.sum(), 1e-30)


def pulled(load: float, back: float = 0.0) -> FloatArray:
    """Tangential forces [k, 2] N, of a ``load`` along x that is taken ``back`` again by so much."""
    gone = FRICTION * (pressed(FORCE) - pressed(FORCE - load / FRICTION))
    gone -= 2.0 * FRICTION * (pressed(FORCE) - pressed(FORCE - 0.5 * back / FRICTION))
    return np.stack([gone, np.zeros(len(gone))], axis=-1)


def depth() -> FloatArray:
    """The same everywhere: elements whose forces differ are no springs by themselves."""
    return np.full(len(PLACE), 1e-3)


def follow_layers(layers: Layers, seen: PressedElements, considered: Considered) -> Layers:
    """The layers after a frame."""
    after = Layers(*(array.copy() for array in layers))
    look_at_layers(seen, after, considered)
    return after


def after_press() -> Layers:
    layers = no_layers(len(PLACE), OPTIONS)
    for force in np.linspace(0.2, FORCE, 40):
        layers = follow_layers(
            layers, PressedElements(PLACE, pressed(force), np.zeros((len(PLACE), 2)), depth(), 0.0), CONSIDERED
        )
    return layers


def after_pull(load: float, back: float = 0.0, steps: int = 20) -> Layers:
    layers = after_press()
    ways = [(part * load, 0.0) for part in np.linspace(0.0, 1.0, steps)]
    ways += [(load, part * back) for part in np.linspace(0.0, 1.0, steps)] if back else []
    for pull, taken in ways:
        layers = follow_layers(
            layers, PressedElements(PLACE, pressed(FORCE), pulled(pull, taken), depth(), 0.0), CONSIDERED
        )
    return layers


def true_slip(load: float) -> FloatArray:
    """Share of each element's contact that slips: outside of c = a (1 − F_T/μF_N)^⅓."""
    square = (POINTS**2).sum(axis=-1)
    touching = square < RADIUS**2
    slipping = touching & (square > (RADIUS * np.cbrt(1.0 - load / (FRICTION * FORCE))) ** 2)
    return np.bincount(ELEMENT, slipping) / np.maximum(np.bincount(ELEMENT, touching), 1)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.97])
def test_what_sticks_is_what_the_contact_was_at_a_smaller_load(share: float) -> None:
    traction, now = np.zeros((16, 3)), sums(PLACE, pressed(FORCE), pulled(share * FRICTION * FORCE))
    core = load_layers(traction, FRICTION, 0.02, now, FORCE / 15.5, 15)
    assert core == pytest.approx((1.0 - share) * FORCE, abs=1e-9)
    widths = np.r_[np.full(15, FORCE / 15.5), 0.5 * FORCE / 15.5]
    assert widths @ traction[:, 0] == pytest.approx(share * FRICTION * FORCE)
    assert np.abs(traction).max() <= FRICTION * (1.0 + 1e-12)


def test_a_load_that_turns_back_slips_anew_from_the_rim() -> None:
    """The front of 2 μ (F − F*) = what was taken back (Mindlin and Deresiewicz)."""
    traction, spacing = np.zeros((16, 3)), FORCE / 15.5
    load = 0.8 * FRICTION * FORCE
    for pull in np.linspace(0.0, load, 9):
        load_layers(traction, FRICTION, 0.02, sums(PLACE, pressed(FORCE), pulled(pull)), spacing, 15)
    for back in (0.1 * load, 0.5 * load, load):
        core = load_layers(traction, FRICTION, 0.02, sums(PLACE, pressed(FORCE), pulled(load, back)), spacing, 15)
        assert core == pytest.approx(FORCE - 0.5 * back / FRICTION, abs=0.6 * spacing)


@pytest.mark.parametrize("share", [0.4, 0.7, 0.9])
def test_elements_of_which_more_than_half_slips_are_found_without_a_friction_coefficient(share: float) -> None:
    load = share * FRICTION * FORCE
    odds, slips = after_pull(load).odds, true_slip(load)
    clearly = (pressed(FORCE) > 0.01 * FORCE) & (np.abs(slips - 0.5) > 0.15)
    assert clearly.sum() > 12
    np.testing.assert_array_equal(odds[clearly] > 0.0, slips[clearly] > 0.5)


def test_all_slip_under_more_than_friction_can_bear_and_stick_once_that_is_taken_back() -> None:
    touching = pressed(FORCE) > 0.0
    assert (after_pull(FRICTION * FORCE).odds[touching] > 0.0).all()
    assert (after_pull(0.9 * FRICTION * FORCE, 0.2 * FORCE * FRICTION).odds[touching] < 0.0).all()


def test_a_moment_alone_is_borne_around_the_pressure_centre() -> None:
    arm = PLACE[:, ::-1] * [-1.0, 1.0]
    forces = 20.0 * pressed(FORCE)[:, None] * arm
    now = sums(PLACE, pressed(FORCE), forces)
    distance = np.linalg.norm(PLACE, axis=-1)
    assert np.hypot(now.x, now.y) < 1e-12
    moment = 20.0 * (pressed(FORCE) * distance**2).sum()
    assert now.turn == pytest.approx(moment * FORCE / (pressed(FORCE) * distance).sum())


def test_nothing_changes_while_the_load_stays_within_noise() -> None:
    layers, rng = after_pull(0.6 * FRICTION * FORCE), np.random.default_rng(0)
    for _ in range(200):
        sideways = pulled(0.6 * FRICTION * FORCE) + 2e-3 * rng.standard_normal((len(PLACE), 2))
        later = follow_layers(layers, PressedElements(PLACE, pressed(FORCE), sideways, depth(), 2e-3), CONSIDERED)
        for name, before, now in zip(Layers._fields, layers, later, strict=True):
            np.testing.assert_array_equal(before, now, err_msg=name)


def test_what_is_remembered_is_never_written_to() -> None:
    layers = after_press()
    kept = [array.copy() for array in layers]
    follow_layers(layers, PressedElements(PLACE, pressed(FORCE), pulled(1.0), depth(), 0.0), CONSIDERED)
    for before, now in zip(kept, layers, strict=True):
        np.testing.assert_array_equal(before, now)


def test_springs_by_themselves_say_nothing_in_layers() -> None:
    own_depth = pressed(FORCE) / 5e3
    assert spread_of_stiffness(pressed(FORCE), own_depth) < 1e-9
    layers = follow_layers(
        after_press(), PressedElements(PLACE, pressed(FORCE), pulled(3.0), own_depth, 0.0), CONSIDERED
    )
    np.testing.assert_allclose(layers.odds, 0.0, rtol=0.0, atol=1e-9)


def test_of_four_elements_that_bear_the_same_those_beside_them_tell_a_gel_from_springs() -> None:
    forces = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    springs = 1e-3 * forces
    gel = springs + np.array([0.0, 0.0, 0.0, 0.0, 3e-4, 3e-4, 3e-4, 3e-4])
    assert spread_of_stiffness(forces, springs) == 0.0
    assert spread_of_stiffness(forces, gel) == pytest.approx(np.sqrt(1.0 - 4e-6 / (4.0 * 1.09e-6)))


@pytest.mark.parametrize("normal", [0.0, 1e-12, 1e-6, 1.0, 1e4])
def test_one_element_any_force_and_a_contact_that_ends_stay_finite(normal: float) -> None:
    layers, one = no_layers(len(PLACE), OPTIONS), np.zeros(len(PLACE))
    one[7] = normal
    sideways = np.outer(0.5 * one, [1.0, -1.0])
    for pull, noise in ((0.0, 0.0), (1.0, 0.0), (-1.0, 2e-3), (50.0, 0.0)):
        layers = follow_layers(layers, PressedElements(PLACE, one, pull * sideways, depth(), noise), CONSIDERED)
        assert all(np.isfinite(array).all() for array in layers)
    layers = follow_layers(layers, PressedElements(PLACE, 0.0 * one, 0.0 * sideways, depth(), 0.0), CONSIDERED)
    assert not layers.odds.any()
    assert layers.load[NORMAL] == 0.0


def test_a_normal_force_that_falls_and_rises_again_keeps_layers_in_order() -> None:
    layers = after_pull(0.5 * FRICTION * FORCE)
    for force in (*np.linspace(FORCE, 0.6 * FORCE, 9), *np.linspace(0.6 * FORCE, 2.0 * FORCE, 9)):
        layers = follow_layers(
            layers, PressedElements(PLACE, pressed(force), pulled(0.5 * FRICTION * FORCE), depth(), 0.0), CONSIDERED
        )
    reached = int(layers.load[0])
    assert (np.diff(layers.level[: reached + 1].sum(axis=-1)) > 0.0).all()
    assert (layers.odds[pressed(FORCE) > 0.0] < 0.0).all()  # all stick again once the normal force has doubled
