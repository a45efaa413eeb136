"""The scoring page and the data card of a benchmark whose scores are made up."""

from dataclasses import replace

import numpy as np
import pytest

from service.slip_benchmark.card import data_card
from service.slip_benchmark.folder import Manifest, SceneEntry
from service.slip_benchmark.kinds import faults_of, kinds_named
from service.slip_benchmark.measures import Measures
from service.slip_benchmark.page import COLUMNS, cells, draw, f1_by_fault, f1_by_kind, overall, page
from service.slip_benchmark.scoring import SceneScore, Scores

LATTICE, CAMERA = "lattice 20x20", "markers 10x7"
ENTRY = SceneEntry("0000", LATTICE, "no noise", 0.0, 0.0, 90, (20, 20), "a", "b")
SCENES = (
    ENTRY,
    replace(ENTRY, name="0001", kind=CAMERA),
    replace(ENTRY, name="0002", fault="noise 1 µm"),
)
MANIFEST = Manifest("5ea1", (LATTICE, CAMERA), "MIT", "stiction 9", SCENES)


@pytest.fixture
def scores() -> Scores:
    """Two methods: the second is better, fails on one scene and has a wrong prediction on another."""
    worse = [SceneScore("worse", scene, Measures(f1=f1, onset_delay=0.0305)) for scene, f1 in zip(
        SCENES, (0.5, 0.25, 0.0), strict=True
    )]  # fmt: skip
    better = [
        SceneScore("better", SCENES[0], Measures(f1=0.9, onset_delay=-0.0125, brier=0.125)),
        SceneScore("better", SCENES[1], None, missing="too slow"),
        SceneScore("better", SCENES[2], None, wrong="it has no slip"),
    ]
    return Scores(MANIFEST, (*worse, *better))


def test_methods_stand_by_their_f1_and_means_are_of_what_was_scored(scores: Scores) -> None:
    assert scores.methods == ["better", "worse"]
    assert [cells(scores.of(name))[:2] for name in scores.methods] == [["1 of 3", "0.900"], ["3 of 3", "0.250"]]
    assert scores.of("worse", LATTICE).means.f1 == 0.25
    assert scores.of("worse", fault="no noise").means.f1 == 0.375
    assert [score.scene.name for score in scores.wrong] == ["0002"]


def test_methods_with_the_same_f1_stand_by_name_and_one_without_any_is_last(scores: Scores) -> None:
    each = [SceneScore(name, ENTRY, Measures(f1=f1)) for name, f1 in (("c", np.nan), ("b", 0.5), ("a", 0.5))]
    assert replace(scores, each=tuple(each)).methods == ["a", "b", "c"]


def test_a_row_has_a_cell_for_each_column_and_delays_in_ms_with_their_sign(scores: Scores) -> None:
    better, worse = (dict(zip(COLUMNS, row, strict=True)) for row in overall(scores))
    assert (better["method"], better["onset delay [ms]"], worse["onset delay [ms]"]) == ("better", "-12", "+30")
    assert (better["Brier"], worse["Brier"], better["force"]) == ("0.125", "–", "–")


def test_tables_by_kind_and_fault_hold_what_a_kind_met(scores: Scores) -> None:
    assert f1_by_kind(scores) == [["better", "0.900", "–"], ["worse", "0.250", "0.250"]]
    assert f1_by_fault(scores, LATTICE) == (
        ["method", "no noise", "noise 1 µm"], [["better", "0.900", "–"], ["worse", "0.500", "0.000"]]
    )  # fmt: skip
    assert f1_by_fault(scores, CAMERA)[0] == ["method", "no noise"]


def test_the_page_tells_the_best_and_what_is_to_be_mended(scores: Scores) -> None:
    report = page(scores)
    facts = {fact.name: fact.value for fact in report.facts}
    assert (facts["Scenes"], facts["Methods"], facts["Best F1"]) == ("3", "2", "0.900 by better")
    assert facts["Seal (SHA-256 of the phrase)"] == "5ea1"
    assert report.steps == ["Mend 1 predictions that cannot be scored: they are listed below."]
    *_, gaps = report.sections
    assert [list(row) for row in gaps.tables[0].rows] == [
        ["better", "0001", "too slow"], ["better", "0002", "it has no slip"]
    ]  # fmt: skip
    assert not gaps.folded
    assert [section.folded for section in report.sections[1:-1]] == [True, True]


def test_what_is_only_missing_is_folded_and_nothing_is_to_be_done(scores: Scores) -> None:
    report = page(replace(scores, each=scores.each[:-1]))
    assert (report.steps, report.sections[-1].folded) == ([], True)
    assert len(page(replace(scores, each=scores.each[:3])).sections) == 3


def test_the_picture_has_a_panel_for_each_kind_with_the_f1_of_each_method(scores: Scores) -> None:
    figure = draw(scores)
    assert [axes.get_title() for axes in figure.axes] == [LATTICE, CAMERA]
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    np.testing.assert_array_equal(lines["worse"], [0.5, 0.0])
    np.testing.assert_array_equal(lines["better"], [0.9, np.nan])
    assert len({line.get_marker() for line in figure.axes[0].lines}) == 2
    low, high = figure.axes[0].get_ylim()
    assert low < 0.0
    assert high > 1.0
    assert figure.get_size_inches()[1] == pytest.approx(3.4)


def test_a_panel_without_a_kind_is_empty(scores: Scores) -> None:
    figure = draw(replace(scores, manifest=replace(MANIFEST, kinds=(LATTICE,))))
    assert [axes.axison for axes in figure.axes] == [True, False]


def test_the_card_counts_scenes_by_kind_and_by_fault_those_of_none_too() -> None:
    card = data_card(MANIFEST)
    assert "3 grasps were simulated" in card
    assert "made by stiction 9. Licence: MIT" in card
    assert "the phrase: `5ea1`" in card
    lattice, camera = (line for line in card.splitlines() if line.startswith(("| lattice", "| markers")))
    assert lattice.split(" | ")[1:] == ["2", kinds_named([LATTICE])[0].says, "20 × 20", "30 |"]
    assert camera.split(" | ")[1::2] == ["1", "10 × 7"]
    assert "no noise (2), noise 1 µm (1), noise 3 µm (0)" in card
    for name in MANIFEST.kinds:
        assert all(f"{fault.name} (" in card for fault in faults_of(kinds_named([name])[0]))
