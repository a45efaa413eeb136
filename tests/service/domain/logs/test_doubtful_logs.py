import numpy as np
import pytest

from estimators import Cost, Domain, FrictionModel
from service.domain.logs.doubtful_logs import (
    with_doubts,
    with_others_calibrations,
    with_others_gels,
    with_reconstructed,
    with_unchecked,
)
from stiction_client.support import notes

MODEL = FrictionModel(
    method="ols",
    coefficients=np.array([0.4, 0.0, 0.0]),
    covariance=np.zeros((3, 3)),
    scale=0.02,
    n=100,
    degrees_of_freedom=10.0,
    scatter_degrees_of_freedom=97.0,
    domain=Domain((0.0, 0.01), (0.01, 0.1)),
    identifiable=np.ones(3, bool),
    element_area=1e-6,
    cost=Cost(0.0),
    diagnostics={"rank": 3.0},
)


@pytest.mark.parametrize(
    ("findings", "told"),
    [
        ([["saturation"]], "1 of 1 log is doubtful (saturation)"),
        ([["saturation", "no rest"], []], "1 of 2 logs is doubtful (saturation)"),
        (
            [["saturation"], ["contact travels", "saturation"], []],
            "2 of 3 logs are doubtful (contact travels, saturation)",
        ),
    ],
)
def test_findings_against_friction_are_counted_and_named(findings: list[list[str]], told: str) -> None:
    doubted = with_doubts(MODEL, findings)
    assert doubted.diagnostics == {"rank": 3.0, "doubtful_logs": told}
    assert doubted.support == "implausible"


def test_findings_that_less_was_seen_speak_not_against_friction() -> None:
    assert with_doubts(MODEL, [["no rest", "slow frames", "repeated frames", "no displacement"], []]) is MODEL
    assert MODEL.support == "supported"


def test_logs_that_others_calibrations_correct_are_counted() -> None:
    (note,) = notes(with_others_calibrations(MODEL, [["another's calibration", "no rest"], []]).diagnostics)
    assert note.startswith("1 of 2 logs is corrected by a sensor's calibration that another key stored")
    assert with_others_calibrations(MODEL, [["no rest"], []]) is MODEL


def test_logs_whose_forces_follow_from_anothers_gel_are_counted() -> None:
    (note,) = notes(with_others_gels(MODEL, [["another's gel"], ["no rest"], ["another's gel"]]).diagnostics)
    assert note == "2 of 3 logs have forces by a sensor's gel that another key described"
    assert with_others_gels(MODEL, [["no rest"]]) is MODEL


@pytest.mark.parametrize(
    ("checked", "told"),
    [([False], "1 of 1 log was"), ([False, True], "1 of 2 logs was"), ([False, False, True], "2 of 3 logs were")],
)
def test_logs_that_were_not_checked_are_counted(checked: list[bool], told: str) -> None:
    (note,) = notes(with_unchecked(MODEL, checked).diagnostics)
    assert note == f"{told} stored before logs were checked as now: what is sent again is looked at"
    assert with_unchecked(MODEL, [True, True]) is MODEL


def test_logs_whose_forces_no_sensor_measured_are_counted() -> None:
    """By the sensor's gel, and by what the log itself says of them."""
    found = [["reconstructed forces", "no rest"], ["no rest"], ["forces not checked"]]
    (note,) = notes(with_reconstructed(MODEL, found).diagnostics)
    told = "forces reconstructed from displacement, as sure as the description of the sensor's gel"
    assert note == f"2 of 3 logs have {told}"
    assert with_reconstructed(MODEL, [["no rest"]]) is MODEL
