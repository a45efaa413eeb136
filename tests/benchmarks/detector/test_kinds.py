"""The table of kinds, faults, inputs and methods: nothing is left out of it, and each score stands in its place."""

from itertools import chain

import pytest

from benchmarks.detector import kinds as detector_kinds
from benchmarks.detector.accuracy import INPUTS
from benchmarks.detector.coarse import ARRAYS
from benchmarks.detector.faults import FAULTS, FORCE_FAULTS
from benchmarks.detector.kinds import KINDS, Found, Kind, faults_of, measure, tables
from benchmarks.detector.scenes import Case, phases, scoring
from slipcore.contact import RampSchedule, tangential_ramp


def test_each_scene_that_slips_is_of_one_kind() -> None:
    slipping = [scene.name for scene in scoring() if not scene.name.startswith("press")]
    assert sorted(chain.from_iterable(KINDS.values())) == sorted(slipping)
    assert set(detector_kinds.ARRAYS) <= {array.name for array in ARRAYS}


def test_each_fault_is_looked_at_where_there_is_what_it_changes() -> None:
    assert set(faults_of("motion")) == FAULTS.keys() | FORCE_FAULTS.keys()
    assert set(faults_of("motion")) - set(faults_of("force")) == {"noise of the pose, 3 µm", "noise of the pose, 10 µm"}
    assert set(faults_of("displacement")) == {name for name in FAULTS if not name.startswith("noise of the pose")}


def test_the_paper_stands_beside_the_method_that_fits_the_input() -> None:
    few = Kind("few", [], (0.0, 0.0), "coarse")
    assert few.methods("displacement") == ("filter", "strain_rate")
    assert few.methods("force") == few.methods("motion") == ("coarse", "strain_rate")


def test_each_score_stands_in_its_row_and_column() -> None:
    scores = [
        Found(kind, fault, inputs, method, f1)
        for inputs in INPUTS
        for fault in faults_of(inputs)
        for kind, at_best in (("a", 0.9), ("b", 0.8))
        for method, f1 in (("filter", at_best if fault == "none" else 0.456), ("strain_rate", 0.123))
    ]
    made = tables(scores)
    assert list(made) == [f"kinds, {inputs}" for inputs in INPUTS]
    head, _, none, *others = made["kinds, force"].splitlines()
    assert head == "| fault | a | b |"
    assert none == "| none | .90 / .12 | .80 / .12 |"
    assert len(others) == len(faults_of("force")) - 1
    assert all(row.endswith("| .46 / .12 | .46 / .12 |") for row in others)


def test_each_fault_is_measured_by_both_methods(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(detector_kinds, "faults_of", lambda _: ["none", "sign turned"])
    log = tangential_ramp(points=8, pitch=1.8e-3, schedule=RampSchedule(0.2, 0.4, 0.1, 0.6, 0.1))
    found = list(measure(Kind("ramp", [Case("ramp", log, phases(log))], (1e-6, 2e-3), "filter")))
    assert len(found) == len(INPUTS) * 2 * 2
    by = {(each.inputs, each.fault, each.method): each.f1 for each in found}
    assert by["displacement", "none", "filter"] == by["displacement", "sign turned", "filter"]
    assert by["force", "none", "filter"] > by["force", "none", "strain_rate"]
