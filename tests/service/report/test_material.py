from dataclasses import replace

import numpy as np
import pytest

from service.report.material import material_report
from service.report.page import render
from service.report.pictures import friction_sections, marginals
from slipcore.samples import FrictionSamples
from stiction_client.model import Cost, FrictionModel
from stiction_client.records import Material, NextGrasp
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
