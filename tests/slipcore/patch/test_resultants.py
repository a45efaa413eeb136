"""Resultants against closed forms of the limit surface."""

import numpy as np
import pytest

from slipcore.patch.resultants import Resultants, resultants
from tests.slipcore.patch.spans import one_patch

RADIUS, FRICTION = 6e-3, 0.45
UP = np.array([0.0, 0.0, 1.0])


def points(count: int = 120) -> np.ndarray:
    axis = np.linspace(-8e-3, 8e-3, count)
    return np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.zeros((count, count))], axis=-1)


def slipping(motion: tuple[float, float, float], hertz: bool, turned: np.ndarray | None = None) -> Resultants:
    """All of a disk slips with velocity (x, y) and rotation ``motion`` about its middle, in a turned frame."""
    place = points()
    inside = 1.0 - (place[..., 0] ** 2 + place[..., 1] ** 2) / RADIUS**2
    pressure = np.where(inside > 0.0, np.sqrt(np.maximum(inside, 0.0)) if hertz else 1.0, 0.0)
    along = np.stack([motion[0] - motion[2] * place[..., 1], motion[1] + motion[2] * place[..., 0]], axis=-1)
    speed = np.maximum(np.linalg.norm(along, axis=-1), 1e-15)
    force = np.concatenate([FRICTION * (pressure / speed)[..., None] * along, -pressure[..., None]], axis=-1)
    turn = np.eye(3) if turned is None else turned
    normal = np.broadcast_to(UP @ turn.T, force.shape)
    return resultants((force @ turn.T)[None], normal[None], (place @ turn.T)[None], one_patch(pressure[None] > 0.0))


@pytest.mark.parametrize(("hertz", "arm"), [(True, 3.0 * np.pi / 16.0), (False, 2.0 / 3.0)])
def test_a_pivoting_disk_bears_the_moment_of_its_closed_form(hertz: bool, arm: float) -> None:
    felt = slipping((0.0, 0.0, 1.0), hertz)
    assert felt.moment[0] == pytest.approx(FRICTION * felt.normal_force[0] * arm * RADIUS, rel=3e-3)
    assert felt.load_ratio[0] == pytest.approx(FRICTION, rel=1e-3)


@pytest.mark.parametrize("turning", [0.0, 0.1, 0.5, 1.0, 3.0])
@pytest.mark.parametrize("hertz", [True, False])
def test_sliding_and_pivoting_together_show_the_same_friction(turning: float, hertz: bool) -> None:
    """An ellipse for the limit surface would err by 6 % between."""
    felt = slipping((0.6, 0.8, turning / RADIUS), hertz)
    assert felt.load_ratio[0] == pytest.approx(FRICTION, rel=1e-3)


def test_a_tilted_sensor_feels_the_same() -> None:
    level = slipping((1.0, 0.0, 100.0), hertz=True)
    c, s = np.cos(0.4), np.sin(0.4)
    tilted = slipping((1.0, 0.0, 100.0), hertz=True, turned=np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]))
    for name in ("normal_force", "moment", "load_ratio", "element_force"):
        assert getattr(tilted, name) == pytest.approx(getattr(level, name), rel=1e-9)
    assert tilted.tangential_force == pytest.approx(level.tangential_force, rel=1e-9, abs=1e-9 * level.normal_force[0])


def test_half_of_the_load_is_borne_by_half_of_the_friction() -> None:
    place, force = points(), np.zeros((120, 120, 3))
    force[..., 2], force[..., 0] = -1.0, 0.5 * FRICTION
    felt = resultants(
        force[None], np.broadcast_to(UP, force.shape)[None], place[None], one_patch(np.ones((1, 120, 120), bool))
    )
    assert felt.load_ratio[0] == pytest.approx(0.5 * FRICTION, rel=1e-3)


def test_a_single_element_has_a_ratio_of_forces_and_no_moment() -> None:
    force = np.array([0.3, 0.4, -1.0]) * np.ones((1, 1, 1, 3))
    felt = resultants(
        force, np.broadcast_to(UP, force.shape), np.zeros(force.shape), one_patch(np.ones((1, 1, 1), bool))
    )
    assert (felt.load_ratio[0], felt.moment[0]) == (pytest.approx(0.5), 0.0)


def test_normal_forces_are_felt_along_their_own_resultant() -> None:
    """Without friction the mean normal, weighted by what presses, is that of the whole force."""
    normal = np.array([[[0.6, 0.0, 0.8], [0.0, -0.6, 0.8]], [[-0.48, 0.64, 0.6], [0.0, 0.0, 1.0]]])
    force = -np.array([[3.0, 1.0], [2.0, 0.5]])[..., None] * normal
    felt = resultants(force[None], normal[None], np.zeros((1, 2, 2, 3)), one_patch(np.ones((1, 2, 2), bool)))
    assert felt.normal_force[0] == pytest.approx(np.linalg.norm(force.sum(axis=(0, 1))), rel=1e-12)
    np.testing.assert_allclose(felt.tangential_force[0], 0.0, rtol=0, atol=1e-12, err_msg="of 6 N")


def test_where_nothing_presses_nothing_is_known() -> None:
    force = np.array([0.1, 0.0, 0.0]) * np.ones((1, 2, 2, 3))
    felt = resultants(
        force, np.broadcast_to(UP, force.shape), np.zeros(force.shape), one_patch(np.ones((1, 2, 2), bool))
    )
    assert felt.normal_force[0] == 0.0
    assert np.isnan(felt.load_ratio[0])


@pytest.mark.parametrize("load", [(0.0, 0.0), (0.1, 0.0), (0.2, 0.3)])
def test_what_presses_no_more_than_noise_shows_no_ratio(load: tuple[float, float]) -> None:
    """A ratio of 0, known surely, had become a friction of 0."""
    force = np.array([*load, -1.0]) * np.ones((1, 2, 2, 3))
    place = np.zeros(force.shape)
    place[..., :2] = 1e-3 * np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0]), axis=-1)
    spans = one_patch(np.ones((1, 2, 2), bool))
    felt, drowned = (
        resultants(force, np.broadcast_to(UP, force.shape), place, spans, force_noise=n) for n in (0.6, 0.7)
    )
    assert felt.load_ratio[0] == pytest.approx(np.hypot(*load), rel=1e-3)
    assert felt.ratio_noise[0] == pytest.approx(0.3 * np.hypot(1.0, felt.load_ratio[0]), rel=1e-3), "0.6 N √4 of 4 N"
    assert np.isnan([drowned.load_ratio[0], drowned.ratio_noise[0]]).all()


def test_the_noise_of_a_smoothed_moment_is_that_of_the_arms_it_is_summed_over() -> None:
    """Those of what acts are shorter: by them it had been stated half as large."""
    place = np.zeros((400, 7, 7, 3))
    place[..., :2] = 1e-3 * np.stack(np.meshgrid(np.arange(-3.0, 4.0), np.arange(-3.0, 4.0)), axis=-1)
    square = (place[..., 0] ** 2 + place[..., 1] ** 2)[..., None]
    pressing = np.exp(-square / (2.0 * 1.2e-3**2)) / 4.5
    turning = np.stack([-place[..., 1], place[..., 0], 0.0 * place[..., 0]], axis=-1) / np.sqrt(square + 1e-12)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(place.shape)
    force = pressing * (0.5 * turning - UP) + noise
    spans = one_patch(np.ones((400, 7, 7), bool))
    felt = resultants(force, np.broadcast_to(UP, force.shape), place, spans, 0.8e-3, 1e-3)
    assert felt.ratio_noise.mean() == pytest.approx(felt.load_ratio.std(), rel=0.1)
