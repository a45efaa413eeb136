from dataclasses import replace

import numpy as np
import pytest

from service.formatting import number
from service.report.material import material_report
from service.report.page import render
from service.report.pictures import friction_sections, marginals
from service.report.wording import coefficient_table
from slipcore.samples import FrictionSamples
from stiction_client.model import Cost, FrictionModel
from stiction_client.records import Detection, Finding, GraspLogReceipt, Job, Material, NextGrasp, Withdrawal
from stiction_client.support import Domain

MODEL = FrictionModel(
    material="<b>paper</b>",
    method="hierarchical",
    version=3,
    coefficients=np.array([0.45, 0.1, -0.02]),
    covariance=np.diag([4e-4, 1.0, 4.0]),
    scale=0.02,
    n=200,
    degrees_of_freedom=9.0,
    scatter_degrees_of_freedom=30.0,
    domain=Domain((1e-4, 1e-3), (0.02, 0.12)),
    identifiable=np.array([True, False, False]),
    element_area=5.6e-7,
    cost=Cost(0.01),
)
PROBE = NextGrasp("paper", "hierarchical", 3, 0.08, 5e-4, 4e-3, 0.0, 1.0, 0.03, 0.02, 0.4, "supported", "")


@pytest.fixture
def material() -> Material:
    return Material("<b>paper</b>", "80 g/m²", "2026-01-01T00:00:00+00:00", 3, {"hierarchical": MODEL}, "hierarchical")


def test_a_material_is_told_with_its_model_and_what_to_record_next(material: Material) -> None:
    report = material_report(material, [], PROBE)
    assert {fact.value for fact in report.facts} >= {"0.449", "3", "hierarchical version 3, of 200 samples"}
    probe = "Record next: press with 0.0800 N on an element and let it slip by 0.500 mm at 4.00 mm/s."
    assert report.steps[0].startswith(probe)
    page = render(report)
    assert "<b>paper</b>" not in page
    assert "80 g/m²" in page
    (model,) = (section for section in report.sections if section.heading == "Model")
    assert model.tables[0].rows[0][1:3] == ["0.450 (0.405 … 0.495)", "0.100 (−2.16 … 2.36) †"]


def test_a_material_without_a_model_says_what_is_missing(material: Material) -> None:
    report = material_report(replace(material, models={}, recommended=None), [], None)
    assert "no model of its friction yet" in report.lead
    assert list(report.pictures) == []


JOB = Job("1", "ingest", "done", None, None, {}, "a", "paper", 3, "2026-01-01T00:00:00+00:00", None)
SEEN = Detection("filter", 1e-6, 0.25, 40, 2, {}, 321, 0.1, (Finding("slow frames", "seen", "faster"),))
LOG = GraspLogReceipt("a", "b", 9, "npz", "paper", "left", 82, 2.75, (8, 8), "2026-01-02T03:04:05.678+00:00", JOB, SEEN)


def test_each_log_is_a_row_with_what_became_of_it(material: Material) -> None:
    withdrawn = replace(LOG, detection=None, withdrawal=Withdrawal("2026-01-03", "wrong", None))
    twice = replace(SEEN, findings=(*(SEEN.findings or ()), Finding("zero drift", "seen", "tare")))
    report = material_report(material, [LOG, withdrawn, replace(LOG, detection=twice)], None)
    (grasps,) = (section for section in report.sections if section.heading == "Grasps")
    (table,) = grasps.tables
    assert table.caption == "The newest 3 of 3 logs"
    told = ["2026-01-02 03:04:05", "left", "82", "2.75 s"]
    assert table.rows[0] == [*told, "done", "321", "0.250", "slow frames"]
    assert table.rows[1] == [*told, "withdrawn", "", "", ""]
    assert table.rows[2][-1] == "slow frames, zero drift"
    assert all(len(row) == len(table.columns) for row in table.rows)


def test_models_that_disagree_are_told_before_what_to_record_but_for_outdated_ones(material: Material) -> None:
    other = replace(MODEL, method="ols", coefficients=np.array([0.9, 0.1, -0.02]))
    report = material_report(replace(material, models={"ols": other, **material.models}), [], PROBE)
    assert report.steps[0].startswith("methods disagree by more than their intervals allow: ols expects ")
    assert [step[:11] for step in report.steps[1:]] == ["Record next", "Ask how har"]
    (model,) = (section for section in report.sections if section.heading == "Model")
    assert [row[0] for row in model.tables[0].rows] == ["hierarchical", "ols"]  # the recommended one first
    outdated = replace(other, outdated=True)
    steps = material_report(replace(material, models={"ols": outdated, **material.models}), [], None).steps
    assert [step[:11] for step in steps] == ["Ask how har"]


def test_a_material_says_of_which_force_its_friction_is_and_what_a_new_observation_may_be(material: Material) -> None:
    facts = {fact.name: fact.value for fact in material_report(material, [], None).facts}
    assert facts["Friction coefficient μ, at 0.0700 N an element"] == "0.449"
    low, high = (MODEL.predict(0.0, 0.07, quantile=level) for level in (0.05, 0.95))
    assert facts["90 % of new observations"] == f"{low:.3f} … {high:.3f}"


def test_remarks_of_models_are_told_once_in_the_caption() -> None:
    noted = replace(MODEL, diagnostics={"unknown_velocity": "v is unknown", "scatter_prior": "scatter of others"})
    table = coefficient_table({"a": noted, "b": noted, "c": MODEL})
    assert table.caption == "Estimates and 95 % intervals; scatter of others; v is unknown"
    assert [row[-1] for row in table.rows] == ["200"] * 3
    assert table.rows[0][4] == f"0.0200 ({' … '.join(number(end) for end in MODEL.scale_interval(0.95))})"


def test_the_picture_of_the_marginals_has_the_intervals_of_the_table() -> None:
    axes = marginals(MODEL).axes
    drawn = [sorted(line.get_xdata()[0] for line in each.lines) for each in axes]
    np.testing.assert_allclose(drawn[:3], MODEL.interval(0.95), rtol=1e-12)
    np.testing.assert_allclose(drawn[3], MODEL.scale_interval(0.95), rtol=1e-12)


def test_no_section_reaches_below_zero_though_the_band_does() -> None:
    wide = replace(MODEL, scale=0.6)
    assert [axes.get_ylim()[0] >= 0.0 for axes in friction_sections(wide).axes] == [True, True]


@pytest.mark.parametrize("freedom", [30.0, np.inf])
def test_each_marginal_density_is_highest_within_its_interval(freedom: float) -> None:
    model = replace(MODEL, scatter_degrees_of_freedom=freedom)
    assert len(marginals(model).axes) == 4
    low, high = model.scale_interval(0.95)
    assert low <= model.scale <= high
    assert (low == high) == np.isinf(freedom)


def test_the_sections_say_what_is_drawn_in_them() -> None:
    (left, right) = friction_sections(MODEL).axes
    assert left.get_legend() is not None
    assert {text.get_text() for text in left.get_legend().get_texts()} == {"fitted", "90 % of new observations"}
    assert right.get_legend() is None


def test_samples_that_agree_fill_an_axis_that_is_narrow_about_them() -> None:
    friction = np.full(20, 0.1)
    samples = FrictionSamples(
        friction,
        np.full(20, 5e-4),
        np.full(20, 0.05),
        0.05 * friction,
        np.arange(20.0),
        np.arange(20),
        np.ones(20),
        1e-6,
    )
    low, high = friction_sections(MODEL, samples).axes[0].get_ylim()
    assert 0.09 < low < 0.1 < high < 0.11
    low, high = friction_sections(replace(MODEL, scale=1e-4, covariance=1e-8 * MODEL.covariance)).axes[0].get_ylim()
    assert 1.2 * 0.02 * 0.1 < high - low < 1.5 * 0.02 * 0.1  # what the line does over the forces, its band, and margins
