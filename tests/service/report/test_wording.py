"""Sentences and tables of models that reports and pages share."""

from dataclasses import replace

import numpy as np
import pytest

from service.formatting import number
from service.report.wording import coefficient_table, estimates, findings_heading, friction_facts, record_next
from tests.service.report.test_material import MODEL, PROBE


def test_what_to_record_next_is_told_in_newtons_and_millimetres() -> None:
    assert record_next(PROBE) == (
        "Record next: press with 0.0800 N on an element and let it slip by 0.500 mm at 4.00 mm/s. The expected "
        "friction, known to ± 0.0300, is then known to ± 0.0200."
    )
    assert record_next(replace(PROBE, beyond="0.08 N is more")).endswith("known to ± 0.0200. Mind: 0.08 N is more.")


def test_friction_is_told_at_rest_in_the_middle_of_the_forces_observed() -> None:
    facts, support = friction_facts(MODEL)
    assert [(fact.name, fact.value) for fact in facts[:1]] == [
        ("Friction coefficient μ, at 0.0700 N an element", number(0.45 - 0.02 * 0.07))
    ]
    low, high = (float(MODEL.predict(0.0, 0.07, quantile=level)) for level in (0.05, 0.95))
    assert (facts[1].name, facts[1].value) == ("90 % of new observations", f"{number(low)} … {number(high)}")
    assert support == MODEL.support_at(0.0, 0.07)


def test_each_coefficient_has_its_interval_and_a_mark_where_the_data_do_not_tell_it() -> None:
    cells = estimates(MODEL)
    half = 2.2621571627409915 * 0.02  # t of 9 degrees of freedom
    assert cells[0] == f"0.450 ({number(0.45 - half)} … {number(0.45 + half)})"
    assert [cell.endswith(" †") for cell in cells] == [False, True, True, False]
    low, high = MODEL.scale_interval(0.95)
    assert cells[3] == f"0.0200 ({number(low)} … {number(high)})"


def test_remarks_on_models_stand_once_below_their_table() -> None:
    told = {"unknown_velocity": "motion unknown", "scatter_prior": "by others", "weakening": "a log lowers it"}
    doubtful = replace(MODEL, diagnostics=told)
    table = coefficient_table({"hierarchical": doubtful, "ols": replace(doubtful, n=7), "robust": MODEL})
    assert table.caption == "Estimates and 95 % intervals; a log lowers it; by others; motion unknown"
    assert table.columns == ("method", "β₀ [-]", "β₁ [s/m]", "β₂ [1/N]", "σ [-]", "samples")
    assert [(row[0], row[-1]) for row in table.rows] == [("hierarchical", "200"), ("ols", "7"), ("robust", "200")]
    assert coefficient_table({"ols": MODEL}).caption == "Estimates and 95 % intervals"


@pytest.mark.parametrize("identifiable", [(True, True, True), (False, False, False)])
def test_a_mark_is_of_its_own_coefficient(identifiable: tuple[bool, bool, bool]) -> None:
    cells = estimates(replace(MODEL, identifiable=np.array(identifiable)))
    assert [not cell.endswith("†") for cell in cells[:3]] == list(identifiable)


@pytest.mark.parametrize(
    ("names", "heading"),
    [
        (["rounded"], "What limits its friction"),
        (["rounded", "force pulls"], "What makes its friction doubtful"),
    ],
)
def test_only_a_warning_makes_friction_doubtful(names: list[str], heading: str) -> None:
    assert findings_heading(names) == heading
