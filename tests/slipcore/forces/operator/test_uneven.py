"""Gels that are not alike thick everywhere."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.forces import uneven as presses
from slipcore import GraspLog, InvalidInput
from slipcore.forces import ForceStream, Gel, reconstruct
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.response import response_matrices
from slipcore.forces.operator.uneven import UnevenLayer, _frames
from slipcore.frames import FloatArray

PITCH, THICKNESS = 1e-3, 4e-3
LINE = PITCH * (np.arange(7) - 3.0)
REST = np.stack((*np.meshgrid(LINE, LINE, indexing="ij"), np.zeros((7, 7))), axis=-1)
PLACE = REST[..., :2].reshape(-1, 2)
NODES = Nodes.around(PLACE, PITCH**2).places()


def gel(relative: FloatArray, thickness: float = THICKNESS, depth: float = 0.0) -> Gel:
    return Gel(1e6, 0.48, thickness, depth, tuple(map(tuple, relative.tolist())))


def response(of: Gel, position: FloatArray = REST, nodes: FloatArray = NODES) -> FloatArray:
    place = position[..., :2].reshape(-1, 2)
    return response_matrices(of, PITCH, [nodes], place, uneven=UnevenLayer.of(of, position))[0]


@pytest.mark.parametrize(("share", "depth"), [(1.0, 0.0), (0.7, 0.0), (1.3, 1e-3)])
def test_a_map_that_is_alike_everywhere_is_a_layer(share: float, depth: float) -> None:
    alike = response(Gel(1e6, 0.48, share * THICKNESS, depth))
    mapped = response(gel(np.full((7, 7), share), depth=depth))
    assert np.abs(mapped - alike).max() < 1e-6 * np.abs(alike).max()


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_layers_between_the_tabled_ones_are_met(share: float) -> None:
    """By a map whose least and largest thickness differ by four, between markers and nodes that are alike thick."""
    relative = np.full((7, 7), share)
    relative[0, 0], relative[0, -1] = 0.5, 2.0
    uneven = UnevenLayer.of(gel(np.ones((7, 7))), REST)
    assert uneven is not None
    thickness = np.log(THICKNESS * relative.ravel())
    found = response_matrices(
        gel(relative), PITCH, [PLACE], PLACE, uneven=replace(uneven, thickness=thickness, slope=0.0 * uneven.slope)
    )[0]
    alike, middle = response(Gel(1e6, 0.48, share * THICKNESS), nodes=PLACE), slice(14, 35)
    change = found[:, middle, :, middle] - alike[:, middle, :, middle]
    assert np.abs(change).max() < 2e-3 * np.abs(alike).max()


def test_what_moves_what_is_mutual() -> None:
    """Maxwell's and Betti's theorem, also between places that lean differently."""
    rng = np.random.default_rng(3)
    relative = 1.0 + 0.05 * np.sin(REST[..., 0] / PITCH) + 0.1 * REST[..., 1] / PITCH / 3.0
    position = REST + [0.0, 0.0, 1e-4] * rng.standard_normal((7, 7, 1))
    mutual = response(gel(relative), position, PLACE).reshape(147, 147)
    assert np.abs(mutual - mutual.T).max() < 1e-6 * np.abs(mutual).max()


def test_a_gel_that_leans_as_a_whole_is_turned() -> None:
    """Surface and base alike: displacements and tractions are as if the sensor's frame leant."""
    slope = np.array([[0.1, -0.05]])
    leaning = REST + np.array([0.0, 0.0, 1.0]) * (REST[..., :2] @ slope[0])[..., None]
    turn = _frames(slope)[0]
    found, flat = response(gel(np.ones((7, 7))), leaning), response(Gel(1e6, 0.48, THICKNESS))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(turn[:, 2], [0.1, -0.05, 1.0] / np.linalg.norm([0.1, -0.05, 1.0]), atol=1e-12)
    turned = np.einsum("da,ajbk,cb->djck", turn, flat, turn)
    assert np.abs(found - turned).max() < 1e-6 * np.abs(flat).max()


def test_half_of_a_wedge_is_thin() -> None:
    """Where the gel is thinner it gives way less; nodes beyond the lattice are as those at its rim."""
    relative = 1.0 + 0.15 * REST[..., 0] / LINE[-1]
    uneven = UnevenLayer.of(gel(relative), REST)
    assert uneven is not None
    own = response(gel(relative), nodes=PLACE)[2, np.arange(49), 2, np.arange(49)].reshape(7, 7)
    assert (np.diff(own, axis=0) > 0.0).all()
    np.testing.assert_allclose(uneven.slope, [[-0.4 * 0.15 * THICKNESS / LINE[-1], 0.0]] * 49, atol=1e-9)
    far, slope = uneven._at(np.array([[10.0, 0.0]]))
    np.testing.assert_allclose(np.exp(far) / THICKNESS, [1.15], rtol=1e-3)
    np.testing.assert_allclose(slope, uneven.slope[:1], atol=1e-9)


def test_a_dome_moves_as_finite_elements_say() -> None:
    """In the mean better by half than by the mean thickness; on the axis, where the gel is flat, too."""
    shape = presses.Shape("dome", 0.07)
    ((_, truth),) = presses.presses(shape)
    log = truth.log
    assert log.force is not None
    place = log.position[..., :2].reshape(-1, 2)
    traction = (log.force[0] * [1.0, 1.0, -1.0]).reshape(-1, 3).T / log.element_area
    true = (log.displacement[0] * [1.0, 1.0, -1.0]).reshape(-1, 3).T
    errors = []
    for described in (presses.BY_MAP, presses.BY_MEAN):
        described_so = presses.gel(shape, log.position, described)
        uneven = UnevenLayer.of(described_so, log.position)
        pitch = float(np.sqrt(log.element_area))
        matrix = response_matrices(described_so, pitch, [place], place, uneven=uneven)[0]
        errors.append(np.linalg.norm(np.einsum("ajbk,bk->aj", matrix, traction) - true) / np.linalg.norm(true))
    assert errors[0] < 0.05
    assert errors[0] < 0.6 * errors[1]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"relative_thickness": ()}, "relative_thickness is 0 rows"),
        ({"relative_thickness": ((1.0, 1.0),)}, "relative_thickness is 1 rows"),
        ({"relative_thickness": ((1.0, 1.0), (1.0,))}, "relative_thickness is 2 rows"),
        ({"relative_thickness": ((1.0, 1.0), (1.0, float("nan")))}, "relative_thickness is nan; allowed: 0.25 to 4"),
        ({"relative_thickness": ((1.0, 1.0), (1.0, 0.2))}, "relative_thickness is 0.2"),
        ({"thickness": np.inf}, "thickness is inf; allowed: finite"),
        ({"marker_depth": 3.5e-3}, "marker_depth is 0.0035; allowed: less than 0.0032 m"),
    ],
)
def test_an_impossible_map_is_refused(change: dict[str, Any], reason: str) -> None:
    with pytest.raises(InvalidInput, match=reason):
        replace(gel(np.array([[1.0, 0.9], [0.8, 1.0]])), **change)


def test_a_map_goes_through_json_and_must_be_of_numbers() -> None:
    uneven = gel(np.array([[1.0, 0.9], [0.8, 1.0]]))
    assert Gel.from_json(uneven.to_json()) == uneven
    assert Gel.from_json(uneven.to_json() | {"relative_thickness": None}) == replace(uneven, relative_thickness=None)
    for wrong in (1.0, [1.0, 2.0], [[1.0, "0.9"], [1.0, 1.0]]):
        with pytest.raises(InvalidInput):
            Gel.from_json(uneven.to_json() | {"relative_thickness": wrong})


@pytest.mark.parametrize(
    ("relative", "reason"),
    [
        (np.ones((7, 6)), r"of shape \[7, 6\]; allowed: \[7, 7\]"),
        (1.0 + 0.7 * REST[..., 0] / LINE[-1], "one that changes it by 0.93 m a m; allowed: one .* at most 0.35"),
    ],
)
def test_a_map_that_does_not_fit_the_lattice_is_refused(relative: FloatArray, reason: str) -> None:
    """Before a stream looks for contacts, too."""
    with pytest.raises(InvalidInput, match=reason):
        UnevenLayer.of(gel(relative), REST)
    with pytest.raises(InvalidInput, match=reason):
        ForceStream(REST, PITCH**2, gel(relative))


def test_a_wedge_s_forces_are_found_by_its_map() -> None:
    """A map in the reconstruction, where the truth is by the same map: the middle of a contact and its resultant."""
    relative = 1.0 + 0.1 * REST[..., 0] / LINE[-1]
    wedge = gel(relative)
    pressure = 5e4 * np.maximum(1.0 - np.sum(NODES**2, axis=1) / (2.2e-3) ** 2, 0.0)
    moved = np.einsum("ajk,k->ja", response(wedge)[:, :, 2], pressure).reshape(7, 7, 3) * [1.0, 1.0, -1.0]
    log = GraspLog(np.arange(3) / 30.0, REST, np.stack([moved] * 3), PITCH**2)
    total = pressure.sum() * PITCH**2
    by_map = reconstruct(log, wedge, noise=1e-7).resultant[0]
    np.testing.assert_allclose(by_map / total, [0.0, 0.0, -1.0], atol=3e-3)
    by_mean = reconstruct(log, Gel(1e6, 0.48, THICKNESS), noise=1e-7).resultant[0]
    assert abs(by_mean[0]) > 3.0 * abs(by_map[0])
