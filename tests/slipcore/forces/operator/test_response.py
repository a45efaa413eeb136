"""Displacement of markers by traction on nodes."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from slipcore import InvalidInput
from slipcore.contact.elasticity.bonded_layer import LayerBase
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.forces.defaults import NODES as OF_NODES
from slipcore.forces.operator import response
from slipcore.forces.operator.gel import Gel
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.response import response_matrices, response_matrix

PITCH = 0.5e-3
LINE = PITCH * (np.arange(9) - 4.0)
MARKERS = np.stack(np.meshgrid(LINE, LINE, indexing="ij"), axis=-1).reshape(-1, 2)
NODES = Nodes.around(MARKERS, PITCH**2)


def test_nodes_reach_beyond_the_markers_and_share_their_area_among_elements() -> None:
    assert len(NODES) == (9 + 2 * OF_NODES.margin) ** 2
    shares = NODES.over_elements(MARKERS)
    np.testing.assert_allclose(shares.sum(axis=1), PITCH**2, rtol=1e-12)
    between = NODES.over_elements(MARKERS + 0.3 * PITCH)
    np.testing.assert_allclose(between.sum(axis=1), PITCH**2, rtol=1e-12)


@pytest.mark.parametrize("reach", [1.0, 1e305], ids=["millimetres", "past the range of floats"])
def test_too_fine_elements_are_refused(reach: float) -> None:
    with pytest.raises(InvalidInput, match="element_area is 1e-12"):
        Nodes.around(MARKERS * reach, 1e-12)


def test_hertzian_pressure_moves_markers_as_a_sphere_does() -> None:
    errors = []
    for pitch in (PITCH, 0.5 * PITCH):
        nodes = Nodes.around(MARKERS, pitch**2)
        contact = 1.6e-3
        reach = np.hypot(*nodes.places().T) / contact
        pressure = 1e5 * np.sqrt(np.maximum(1.0 - reach**2, 0.0))
        inside = np.hypot(*MARKERS.T) < 0.8 * contact
        moved = response_matrix(Gel(1e6, 0.3), nodes, MARKERS)[2, :, 2] @ pressure
        modulus = 1e6 / (1.0 - 0.3**2)
        exact = np.pi * 1e5 / (4.0 * modulus * contact) * (2.0 * contact**2 - np.sum(MARKERS**2, axis=1))
        errors.append(float(np.abs(moved / exact - 1.0)[inside].max()))
    assert errors[0] < 0.03
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize("depth", [0.0, 1e-3])
def test_a_thick_layer_is_a_half_space(depth: float) -> None:
    thick = response_matrix(Gel(1e6, 0.45, 10.0, depth), NODES, MARKERS)
    free = response_matrix(Gel(1e6, 0.45, marker_depth=depth), NODES, MARKERS)
    np.testing.assert_allclose(thick, free, rtol=0.0, atol=1e-3 * np.abs(free).max())


@pytest.mark.parametrize("thickness", [5e-3, np.inf])
def test_markers_close_to_the_surface_move_as_the_surface(thickness: float) -> None:
    surface = response_matrix(Gel(1e6, 0.45, thickness), NODES, MARKERS[:3])
    errors = [
        np.abs(response_matrix(Gel(1e6, 0.45, thickness, depth), NODES, MARKERS[:3]) - surface).max()
        for depth in (4e-6, 2e-6)
    ]
    assert errors[1] < 0.55 * errors[0] < 0.02 * np.abs(surface).max()


def test_a_stiffer_gel_moves_less_and_coupling_has_its_sign() -> None:
    soft, stiff = (response_matrix(Gel(young, 0.3, 3e-3), NODES, MARKERS) for young in (1e6, 1e7))
    np.testing.assert_allclose(soft, 10.0 * stiff, rtol=0.0, atol=1e-9 * soft.max())
    np.testing.assert_allclose(soft[0, :, 2], -soft[2, :, 0], rtol=0.0, atol=1e-20)


def test_markers_between_nodes_are_met_as_well_as_on_them() -> None:
    gel, shift = Gel(1e6, 0.49, 3e-3, 0.3e-3), np.array([0.31, -0.17]) * PITCH
    smooth = np.exp(-np.sum(NODES.places() ** 2, axis=1) / (2.0 * (2.0 * PITCH) ** 2))
    moved = response_matrix(gel, NODES, MARKERS + shift)[2, :, 2] @ smooth
    back = response_matrix(gel, NODES, MARKERS)[2, :, 2] @ np.exp(
        -np.sum((NODES.places() + shift) ** 2, axis=1) / (2.0 * (2.0 * PITCH) ** 2)
    )
    np.testing.assert_allclose(moved, back, rtol=0.0, atol=2e-3 * np.abs(moved).max())


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ("young_modulus", 0.0),
        ("poisson_ratio", 0.51),
        ("thickness", 0.0),
        ("marker_depth", 2e-3),
        ("thickness", np.nan),
        ("thickness", "2 mm"),
        ("young_modulus", None),
        ("poisson_ratio", np.ones(2)),
        ("relative_thickness", (1.0, 1.0)),
        ("relative_thickness", ((1.0, None), (1.0, 1.0))),
    ],
)
def test_an_impossible_gel_is_refused_by_name(entry: str, value: Any) -> None:
    with pytest.raises(InvalidInput, match=f"{entry} is"):
        Gel(**{"young_modulus": 1e6, "poisson_ratio": 0.49, "thickness": 2e-3} | {entry: value})


def test_a_gel_is_the_same_of_arrays_and_of_numbers_of_any_kind() -> None:
    gel = Gel(10**6, np.float32(0.5), None, marker_depth=0)  # type: ignore[arg-type]
    assert gel == Gel(1e6, 0.5)
    uneven = Gel(1e6, 0.5, 2e-3, relative_thickness=np.array([[1.0, 0.5], [1.0, 2.0]]))  # type: ignore[arg-type]
    assert uneven.relative_thickness == ((1.0, 0.5), (1.0, 2.0))
    assert uneven.thinnest == 1e-3
    assert Gel.from_json(json.loads(json.dumps(uneven.to_json()))) == uneven


def test_a_gel_much_thinner_than_its_markers_are_apart_is_refused_before_it_takes_hours() -> None:
    """Its response takes time with the square of how thin it is; most likely its thickness is not in m."""
    nodes = Nodes.around(np.zeros((1, 2)), 1e-6)
    response_matrix(Gel(1e6, 0.49, 1.001e-4), nodes, np.zeros((1, 2)))
    for gel in (Gel(1e6, 0.49, 2e-6), Gel(1e6, 0.49, 2e-4, relative_thickness=((1.0, 0.4), (1.0, 1.0)))):
        with pytest.raises(InvalidInput, match=r"thickness is .*e-0[56]; allowed: 0.0001 m or more, 0.1 of the dist"):
            response_matrix(gel, nodes, np.zeros((1, 2)))


@pytest.mark.parametrize("away", [(0.0, 0.0), (0.3, -2.0)])
def test_nodes_lie_about_the_markers_wherever_these_are(away: tuple[float, float]) -> None:
    """One on each element of a lattice, and as many rows more on every side."""
    x, y = np.meshgrid(np.arange(7), np.arange(4), indexing="ij")
    position = 1e-3 * np.stack((x.ravel(), y.ravel()), axis=-1) + away
    places = Nodes.around(position, 1e-6).places()
    np.testing.assert_allclose(places.min(axis=0), position.min(axis=0) - 1e-3 * OF_NODES.margin, atol=1e-12)
    np.testing.assert_allclose(places.max(axis=0), position.max(axis=0) + 1e-3 * OF_NODES.margin, atol=1e-12)


def test_offsets_that_are_alike_are_evaluated_once_and_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a lattice as far from its nodes as its neighbours are, most are."""
    gel = Gel(1e6, 0.45, 3e-3)
    lattice = np.stack(np.meshgrid(1e-3 * np.arange(6), 1e-3 * np.arange(5)), axis=-1).reshape(-1, 2)
    nodes = Nodes.around(lattice, 1e-6)
    evaluated = []

    def counted(table: np.ndarray, at: np.ndarray, **options: Any) -> np.ndarray:
        evaluated.append(np.shape(at)[1])
        return map_coordinates(table, at, **options)

    monkeypatch.setattr(response, "map_coordinates", counted)
    whole = response_matrix(gel, nodes, lattice)
    assert set(evaluated) == {(6 + 14 - 1) * (5 + 13 - 1)}  # four rows of nodes beyond the markers on each side
    for k in (0, 17):
        np.testing.assert_allclose(response_matrix(gel, nodes, lattice[[k]])[:, 0], whole[:, k], rtol=1e-6, atol=1e-14)
    (along_normal,) = response_matrices(gel, 1e-3, [nodes.places()], lattice, axes=(2,))
    np.testing.assert_array_equal(along_normal, whole[2:])


@pytest.mark.parametrize("side", [1, 2, 3])
def test_few_nodes_near_their_markers_move_them_as_they_do_among_others(side: int) -> None:
    """Closer than where finer cells end, as heights of 2 × 2 or 3 × 3 elements are taken to points."""
    gel, pitch, many = Gel(1e6, 0.49, 5e-3), 1e-3, 8
    line = pitch * np.arange(many)
    place = np.stack([each.ravel() for each in np.meshgrid(line, line)], axis=-1)
    few = (place < (side - 0.5) * pitch).all(axis=1)
    (found,) = response_matrices(gel, pitch, [place[few]], place[few])
    (among,) = response_matrices(gel, pitch, [place], place)
    assert found.shape == (3, side**2, 3, side**2)
    np.testing.assert_allclose(found, among[:, few][..., few], rtol=1e-3, atol=1e-3 * np.abs(among).max())


def test_logs_of_one_sensor_tabulate_its_gel_once_and_another_gel_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    tabulated: list[Gel] = []
    hats = response.hat_responses

    def counted(gel: Gel, *given: Any) -> Any:
        tabulated.append(gel)
        return hats(gel, *given)

    monkeypatch.setattr(response, "hat_responses", counted)
    response._splines.cache_clear()
    soft, hard = Gel(1e6, 0.49, 5e-3), Gel(2e6, 0.49, 5e-3)
    first, again = (response_matrix(soft, NODES, MARKERS) for _ in range(2))
    of_hard = response_matrix(hard, NODES, MARKERS)
    assert tabulated == [soft, soft, hard, hard], "far and near"
    np.testing.assert_array_equal(first, again)
    np.testing.assert_allclose(of_hard, 0.5 * first, rtol=1e-9, atol=1e-20)
    moved = response_matrix(soft, NODES, MARKERS + 0.3 * PITCH)
    assert np.abs(moved - first).max() > 0.01 * np.abs(first).max()


def test_a_table_in_steps_holds_every_so_manieth_offset_and_y_is_x_turned() -> None:
    gel = Gel(1e6, 0.45, 3e-3)
    whole, steps = (response.hat_responses(gel, PITCH, 6, 12, step) for step in (1, 3))
    for component, table in whole.items():
        np.testing.assert_allclose(steps[component], table[::3, ::3], rtol=1e-12, atol=1e-24)
    bodies = (HalfSpace.from_young(1e6, 0.45), LayerBase(3e-3, 1e6, 0.45))
    operator = ElasticOperator(bodies, Grid((9, 9), (PITCH, PITCH)))
    found = response.cell_responses(gel, operator.grid)
    for component in ("yy", "zy"):
        np.testing.assert_allclose(found[component], operator.influence(component), rtol=1e-9, atol=1e-20)
