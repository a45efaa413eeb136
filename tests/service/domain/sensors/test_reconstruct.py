"""What is said of forces that follow from a gel, and which logs need them."""

from dataclasses import replace

import numpy as np
import pytest

from service.domain.sensors import reconstruct
from service.domain.sensors.reconstruct import at_end_of_range, contradicted, needs_forces, reconstruction_findings
from slipcore import GraspLog
from slipcore.forces import Reconstruction
from slipcore.forces.defaults import RECONSTRUCTION

FRAMES, SHAPE = 4, (4, 2, 3, 3)


def found(**changes: object) -> Reconstruction:
    nothing = np.zeros(SHAPE)
    whole = Reconstruction(
        force=nothing, deviation=nothing, of_changes=nothing[..., 2], alike=nothing, resultant=np.zeros((FRAMES, 3)),
        resultant_deviation=np.zeros((FRAMES, 3)), moment=np.zeros(FRAMES), moment_deviation=np.zeros(FRAMES),
        contact=np.ones(SHAPE[:3], bool), kernel_width=2.5e-3, information=np.array([1.0, 0.5, 0.256]), condition=1.0,
        noise=1e-6, given=np.zeros((FRAMES, 3), bool), contradiction=np.full((FRAMES, 3), np.nan),
        saturated=np.zeros(SHAPE, bool), unnoticed=np.array([0.1, 0.2, 0.34]),
    )  # fmt: skip
    return replace(whole, **changes)  # type: ignore[arg-type]


def log(**more: object) -> GraspLog:
    place = 1e-3 * np.stack(np.meshgrid(np.arange(2.0), np.arange(3.0), [0.0], indexing="ij"), axis=-1)[:, :, 0]
    return GraspLog(np.arange(float(FRAMES)), place, np.zeros(SHAPE), 1e-6, **more)  # type: ignore[arg-type]


def test_a_log_needs_forces_that_has_none_and_is_in_metres() -> None:
    assert needs_forces(log())
    assert not needs_forces(log(force=np.zeros(SHAPE)))
    assert not needs_forces(log(metadata={"scale": "unknown"}))


def test_forces_of_the_sensor_itself_are_none_to_be_told_of() -> None:
    assert reconstruction_findings(log(force=np.zeros(SHAPE)), None) == []
    (told,) = reconstruction_findings(log(force=np.zeros(SHAPE), metadata={"force": "reconstructed"}), None)
    assert (told.name, told.severity) == ("forces not checked", "note")
    assert "zero, frame and range were not checked" in told.evidence


def test_it_is_told_how_well_forces_are_known() -> None:
    (told,) = reconstruction_findings(log(), found())
    assert told.name == "reconstructed forces"
    assert told.evidence == (
        "forces follow from displacement by the sensor's gel, in effect averaged over 2.5 mm; share of the resultant "
        "by the data: x 100%, y 50%, z 26%; a normal force of 0.34 N or less would move no marker beyond noise"
    )


def test_a_resultant_that_was_given_is_told_of_where_its_normal_part_was() -> None:
    for axis, is_told in ((0, False), (1, False), (2, True)):
        given = np.zeros((FRAMES, 3), bool)
        given[1, axis] = True
        (told,) = reconstruction_findings(log(), found(given=given))
        assert ("gel and from the normal force that the gripper reports, in effect" in told.evidence) is is_told


def test_elements_at_the_end_of_the_range_are_counted_once_whichever_frame_and_axis() -> None:
    saturated = np.zeros(SHAPE, bool)
    saturated[1:3, 0, 0, :] = saturated[3, 1, 2, 1] = True
    (told,) = reconstruction_findings(log(), found(saturated=saturated))
    assert told.evidence.endswith("; displacements of 2 elements at the end of the sensor's range count as not seen")


def test_a_force_that_is_contradicted_is_told_with_its_share() -> None:
    contradiction = np.full((FRAMES, 3), np.nan)
    contradiction[:, 2] = [100.0, 0.0, 100.0, 100.0]
    told = reconstruction_findings(log(), found(contradiction=contradiction))
    assert [each.name for each in told] == ["reconstructed forces", "gripper's force contradicted"]
    assert told[1].evidence == "in 75% of the frames that touch the gel's shape implies another force"


def test_a_few_frames_may_contradict_a_gripper() -> None:
    assert contradicted(RECONSTRUCTION.contradicted_share) == []
    (told,) = contradicted(RECONSTRUCTION.contradicted_share + 0.01)
    assert told.severity == "note"
    assert told.name == reconstruct.CONTRADICTED


@pytest.mark.parametrize("elements", [0, 1, 7])
def test_elements_of_a_frame_at_the_end_of_its_range_are_told(elements: int) -> None:
    told = [each.evidence for each in at_end_of_range(elements)]
    assert (
        told
        == [f"displacements of {elements} elements are at the end of the sensor's range and count as not seen"][
            : min(elements, 1)
        ]
    )
