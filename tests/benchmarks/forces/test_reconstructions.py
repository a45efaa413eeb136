"""The presses on which reconstructions are judged, and the figures that judge them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.forces import references as gel_references
from benchmarks.forces.__main__ import (
    MOMENT,
    QUANTITIES,
    STICTION,
    Case,
    Score,
    anywhere_covered,
    anywhere_table,
    cases,
    compared,
    coverage,
    coverage_table,
    covered,
    errors,
    errors_table,
    picture,
    pooled,
    score,
    shown,
    shown_anywhere,
)
from benchmarks.forces.peers import PEERS, export, imported, pseudo_inverse
from benchmarks.forces.presses import Calibration, calibration_table
from benchmarks.forces.saturation import ROUNDED, Detection, cut, detection_table
from benchmarks.forces.scenes import (
    CELL,
    CONTACTS,
    FRICTION,
    LATTICES,
    TANGENTIAL_SHARE,
    Lattice,
    press,
    repeated,
    seen,
)
from slipcore.contact.reference import CattaneoMindlin, HertzContact, half_space
from slipcore.forces import Gel, GelEstimate, reconstruct

FREE = Gel(1e6, 0.5)
LAYER = Gel(1e6, 0.49, 5e-3)
COARSE = LATTICES["10 × 7"]


def test_a_sphere_moves_markers_as_hertz_and_cattaneo_and_mindlin_say() -> None:
    truth = press("sphere", FREE, LATTICES["20 × 20"])
    body = half_space(1e6, 0.5)
    radius = 4.0 * body.contact_modulus * (3.5e-3) ** 3 / (3.0 * 10.0)
    hertz = HertzContact(radius, 10.0, body)
    slid = CattaneoMindlin(hertz, FRICTION, TANGENTIAL_SHARE * FRICTION * 10.0)
    x, y, _ = np.moveaxis(truth.log.position, -1, 0)
    along, across = 0.96 * x + 0.28 * y, 0.96 * y - 0.28 * x
    u, v = np.moveaxis(slid.displacement(along, across), -1, 0)
    moved = truth.log.displacement[-1]
    expected = np.stack((0.96 * u - 0.28 * v, 0.28 * u + 0.96 * v, -hertz.normal_displacement(np.hypot(x, y))), axis=-1)
    np.testing.assert_allclose(moved, expected, rtol=0.0, atol=2e-3 * np.abs(expected).max())


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("lattice", LATTICES)
def test_forces_on_elements_add_up_to_the_load(contact: str, lattice: str) -> None:
    truth = press(contact, LAYER, LATTICES[lattice])
    assert truth.log.force is not None
    np.testing.assert_allclose(truth.log.force.sum(axis=(1, 2)), truth.total, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(truth.total[:, 2], [-5.0, -10.0, -10.0], rtol=1e-12)
    assert (np.hypot(*truth.total[:, :2].T) <= FRICTION * 10.0).all()
    assert (truth.area > 100 * CELL**2).all()


def test_a_contact_that_is_moved_by_a_pitch_moves_what_is_seen_by_one_marker() -> None:
    here, there = (press("ring", LAYER, COARSE, (x, 0.0)).log.displacement for x in (0.0, COARSE.pitch))
    np.testing.assert_allclose(there[:, 1:], here[:, :-1], rtol=0.0, atol=1e-3 * np.abs(here).max())


def test_in_the_plane_depth_is_not_seen_and_noise_is_as_large_as_told() -> None:
    truth = repeated(press("sphere", LAYER, COARSE), 40)
    log = seen(truth.log, 3e-6, False, np.random.default_rng(0))
    assert not log.displacement[..., 2].any()
    noise = (log.displacement - truth.log.displacement)[..., :2]
    assert noise.std() == pytest.approx(3e-6, rel=0.02)


def test_errors_are_relative_and_tell_directions_apart() -> None:
    true = np.zeros((2, 3, 3, 3))
    true[:, 1, 1] = [3.0, 4.0, -10.0]
    found = true.copy()
    found[0, 1, 1] += [0.5, 0.0, 1.0]
    assert errors(found, true) == (pytest.approx(0.5 / np.sqrt(50.0)), pytest.approx(1.0 / np.sqrt(200.0)))
    assert errors(pooled(found, 3.2), pooled(true, 3.2))[1] == pytest.approx(1.0 / np.sqrt(200.0))
    np.testing.assert_array_equal(pooled(true, np.nan), true)


def test_a_case_is_scored_tabled_and_drawn() -> None:
    case = Case("lattice", depth_seen=True, lattice="10 × 7")
    found = score(case, *shown(case, 2))
    assert found.method == STICTION
    assert max(found.resultant) < 0.02
    assert max(found.elements) < 0.15
    assert coverage([found])[0] == "100%"
    assert found.inside["resultant, normal"][1] == 6
    assert "| with z | 5 mm | sphere | 10 × 7 | 0 | 1 |" in errors_table([found])
    assert len(picture([replace(found, case=replace(case, noise=n)) for n in (0.0, 3e-6)]).axes) == 6


def test_a_gel_described_too_stiff_gives_forces_too_large_by_as_much() -> None:
    case = Case("wrong description", depth_seen=True, lattice="10 × 7", noise=0.0)
    truth, log = shown(case, 1)
    right, wrong = (score(each, truth, log) for each in (case, replace(case, wrong="E + 10 %")))
    assert right.resultant[1] < 0.02
    assert wrong.resultant[1] == pytest.approx(0.1, abs=0.02)


def test_peers_are_linear_and_the_pseudo_inverse_meets_what_has_no_noise() -> None:
    truth = press("sphere", LAYER, COARSE)
    assert truth.log.force is not None
    peer = pseudo_inverse(LAYER, COARSE, with_depth=True)
    found = peer.forces(truth.log)
    assert max(errors(found.sum(axis=(1, 2)), truth.total)) < 0.02
    doubled = replace(truth.log, displacement=2.0 * truth.log.displacement)
    np.testing.assert_allclose(peer.forces(doubled), 2.0 * found, rtol=0.0, atol=1e-9)
    assert len(PEERS) == 3


def test_what_another_method_made_comes_back_as_it_was_given(tmp_path: Path) -> None:
    truth = press("sphere", LAYER, COARSE)
    path = tmp_path / "case.npz"
    export(truth.log, truth, LAYER, path)
    with np.load(path) as given:
        np.testing.assert_allclose(given["total_force"], [5.0, 10.0, 10.0])
        assert given["thickness"] == LAYER.thickness
        np.savez(path, force=2.0 * given["displacement"])
    np.testing.assert_array_equal(imported(path, truth.log), 2.0 * truth.log.displacement)
    np.savez(path, force=np.zeros(3))
    with pytest.raises(SystemExit, match="force is of shape"):
        imported(path, truth.log)


def test_peers_are_tried_at_every_noise_with_depth_and_without() -> None:
    assert len({(case.depth_seen, case.noise) for case in compared()}) == 8


def test_a_press_is_found_though_it_is_sheared_later() -> None:
    """A sheared frame's prior lets shear stand for pressure; where the contact is sought, each frame has its own."""
    log = press("sphere", LAYER, Lattice((16, 16), 5), steps=((1.0, 0.0), (1.0, 1.0))).log
    assert log.force is not None
    found = reconstruct(seen(log, 1e-6, False, np.random.default_rng(0)), LAYER, noise=1e-6).force[0, ..., 2]
    true = log.force[0, ..., 2]
    assert np.linalg.norm(found - true) < 0.2 * np.linalg.norm(true)


def test_a_punch_is_as_wide_as_it_is_and_its_rim_is_known_less_well() -> None:
    truth = press("flat punch", LAYER, Lattice((14, 14), 5), steps=((1.0, 0.0), (1.0, 1.0)))
    found = reconstruct(seen(truth.log, 1e-6, True, np.random.default_rng(0)), LAYER, noise=1e-6)
    area = found.contact[0].sum() * truth.log.element_area
    assert area < 1.35 * truth.area[0]
    assert truth.log.force is not None
    inside = np.abs(found.force - truth.log.force) < 1.96 * found.deviation
    assert inside[found.contact].mean() > 0.85


def test_a_learnt_gel_is_tabled_with_its_errors_and_what_its_intervals_hold() -> None:
    true = Gel(1e6, 0.49, 5e-3)
    estimates = (
        GelEstimate("young_modulus", "Pa", 1.02e6, 0.99e6, 1.05e6, 1.0),
        GelEstimate("poisson_ratio", "-", 0.48, 0.47, 0.5, 0.9),
        GelEstimate("thickness", "m", 5.5e-3, 5.2e-3, 5.8e-3, 0.9),
    )
    forces = {"true": (0.01, 0.02), "wrong": (0.1, 0.2), "learnt": (0.03, 0.04)}
    layer = Calibration("with z", "5 mm", 1e-6, None, true, [estimates], forces, 20.0)
    thick = replace(layer, gel="half-space", true=replace(true, thickness=np.inf), given=0.49)
    first, second = calibration_table([layer, thick]).splitlines()[2:]
    assert first == (
        "| with z | 5 mm | 1 | +2 (± 3) | -0.01 (± 0.015) | +10 (± 6) % | 2 of 3 | 1 / 2 | 10 / 20 | 3 / 4 | 20 |"
    )
    assert "| given | at least 5.2 mm | 2 of 3 |" in second


def test_logs_that_are_cut_are_counted_beside_those_that_are_not() -> None:
    found = [Detection("20 × 20", "any", 0.0, 1.0, 0, 4), Detection("20 × 20", "z", 0.0, 0.5, 3, 4)]
    blank = [Detection(lattice, "any", step, 1.0, 0, 4) for lattice in LATTICES for step in ROUNDED]
    row = detection_table([*blank, *found]).splitlines()[2]
    assert row == "| 20 × 20 | z | – | 0% | – | – | – | – | 75% | – |"
    field = np.array([-3.0, 1.0, 2.0]).reshape(1, 1, 3, 1) * np.ones(3)
    seen_field, is_cut = cut(field, slice(2, 3), 0.5, 0.2)
    np.testing.assert_allclose(seen_field[0, 0, :, 2], [-1.6, 1.0, 1.6], rtol=1e-12)  # 1.5 is half between two steps
    assert is_cut.sum() == 2


def test_intervals_are_counted_over_contacts_and_apart_by_noise() -> None:
    cases = list(covered())
    assert len({(case.depth_seen, case.gel, case.lattice, case.noise) for case in cases}) * 2 == len(cases)
    held = dict.fromkeys((*QUANTITIES, MOMENT), (3, 4))
    own = [Score(case, STICTION, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), inside=held) for case in cases[:3]]
    first, second = coverage_table(own).splitlines()[2:]
    assert first == "| with z | half-space | 20 × 20 | 0 | 75% | 75% | 75% | 75% | 75% | 8 |"
    assert second.endswith("| 4 |")
    wide = [replace(each, squares=dict.fromkeys(QUANTITIES, (1e-4, 4e-4))) for each in own]
    row = anywhere_table(wide).splitlines()[2]
    assert row == f"| 20 × 20 | 0 | sphere |{' 75% | 1 / 2 |' * 4} 4 |"


def test_each_press_of_the_coverage_is_another_of_the_same_force() -> None:
    case = next(case for case in anywhere_covered() if case.contact == "ring" and case.lattice == "10 × 7")
    presses = [shown_anywhere(case, k)[0] for k in (1, 2, 1)]
    np.testing.assert_array_equal(presses[0].total, presses[2].total)
    np.testing.assert_allclose([each.total[1:, 2] for each in presses], -10.0, rtol=1e-9)
    assert abs(presses[0].area[1] / presses[1].area[1] - 1.0) > 0.05
    one, other = (each.total[2, :2] for each in presses[:2])
    assert abs(one[0] * other[1] - one[1] * other[0]) > 0.1 * np.hypot(*one) * np.hypot(*other)


def test_an_independent_scene_is_read_with_the_load_that_it_was_made_with() -> None:
    log, total = gel_references.read("cond1_layer5c")
    np.testing.assert_allclose(total[-1], [3.975, 0.0, -10.0], rtol=0.0, atol=0.03)
    assert log.displacement[-1, ..., 2].min() < -2e-4  # pressed in, z outward
    assert "| cond1 | with z | 1 | 10 | 20 | 50% | 100% | 0% | 4 |" in gel_references.references_table(
        [gel_references.Reference("cond1", "with z", 1e-6, (0.1, 0.2), (2, 4, 0), 4)]
    )


def test_criteria_are_tried_on_the_same_presses_and_named_in_their_rows() -> None:
    tried = list(cases("criterion"))
    by_press = {(case.depth_seen, case.noise): {other.criterion for other in tried if other.noise == case.noise}
                for case in tried}  # fmt: skip
    assert len(by_press) == 4
    assert all(names == {"evidence", "gcv", "discrepancy"} for names in by_press.values())
    smooth = replace(tried[0], lattice="10 × 7", criterion="discrepancy")
    truth, log = shown(smooth, 1)
    scores = [score(each, truth, log) for each in (replace(smooth, criterion="evidence"), smooth)]
    assert scores[1].elements[0] > 1.02 * scores[0].elements[0]
    assert "5 mm, by discrepancy | sphere" in errors_table(scores)
