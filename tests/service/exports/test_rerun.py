"""What Rerun is given, read back by its library; pip install rerun-sdk."""

from typing import Any

import numpy as np
import pytest

from service import exports
from service.exports import DetectedLog
from service.exports.scene import arrows
from service.formats.lattice import columns_and_rows
from slipcore.slip_state import element_states

chunk = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed: pip install rerun-sdk")


@pytest.fixture(scope="module")
def reader(recording: DetectedLog, tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("rerun") / "log.rrd"
    exports.write([recording], path, exports.target_of(path))
    return chunk.RrdReader(path)


@pytest.fixture(scope="module")
def columns(reader: Any) -> dict[tuple[str, str], dict[float, Any]]:
    """Values by the entity and the component, by time, s; static ones at NaN."""
    found: dict[tuple[str, str], dict[float, Any]] = {}
    for part in reader.stream():
        batch = part.to_record_batch()
        names = batch.schema.names
        if part.is_static:
            times = [float("nan")] * batch.num_rows
        elif "time" in names:
            times = [each.total_seconds() for each in batch.column("time").to_pylist()]
        else:
            continue
        for name in names:
            if ":" in name:
                told = zip(times, batch.column(name).to_pylist(), strict=True)
                found.setdefault((part.entity_path, name), {}).update(told)
    return found


def values(columns: dict[tuple[str, str], dict[float, Any]], entity: str, component: str) -> list[Any]:
    (found,) = [each for (path, name), each in columns.items() if path == entity and name.endswith(component)]
    return [found[time] for time in sorted(found)]


def test_the_map_shows_the_state_of_each_element(columns: Any, recording: DetectedLog) -> None:
    images = values(columns, "/sensor/map", ":buffer")
    expected = element_states(recording.history.contact, recording.history.slip)
    assert len(images) == len(expected)
    for image, states in zip(images, expected, strict=True):
        np.testing.assert_array_equal(np.frombuffer(bytes(image[0]), np.uint8).reshape(states.shape), states)


def test_numbers_over_time_are_those_of_the_log(columns: Any, recording: DetectedLog) -> None:
    assert recording.log.force is not None
    told = np.ravel(values(columns, "/force/normal", ":scalars"))
    np.testing.assert_allclose(told, np.abs(recording.log.force[..., 2].sum((1, 2))))
    np.testing.assert_allclose(
        np.ravel(values(columns, "/slip/stick_ratio", ":scalars")), recording.history.stick_ratio
    )


def test_arrows_stand_on_elements_in_contact(columns: Any, recording: DetectedLog) -> None:
    for origins, touching in zip(values(columns, "/sensor/arrows", ":origins"), recording.history.contact, strict=True):
        places = np.array(origins or [], float).reshape(-1, 2)
        np.testing.assert_array_equal(places[:, ::-1] - 0.5, np.argwhere(touching))


def test_arrows_are_drawn_on_the_lattice_as_they_are_on_the_sensor(columns: Any, recording: DetectedLog) -> None:
    position, drawn = recording.log.position, arrows(recording)
    for k, (vectors, touching) in enumerate(
        zip(values(columns, "/sensor/arrows", ":vectors"), recording.history.contact, strict=True)
    ):
        begin, end = (columns_and_rows(position, each[k][touching][:, :2]) for each in (drawn.begin, drawn.end))
        told = np.array(vectors or [], float).reshape(-1, 2)
        np.testing.assert_allclose(told, end - begin, rtol=1e-5, atol=1e-6)


def test_patches_are_labelled_with_their_regimes_inside_of_the_contact(columns: Any, recording: DetectedLog) -> None:
    (patch,) = recording.history.patches
    frame = patch.first + len(patch.pose) // 2
    assert values(columns, "/sensor/patches", ":labels")[frame] == [patch.regime[frame - patch.first]]
    ((x, y),) = values(columns, "/sensor/patches", ":positions")[frame]
    rows, columns_of = np.nonzero(recording.history.contact[frame])
    assert rows.min() <= y <= rows.max() + 1
    assert columns_of.min() <= x <= columns_of.max() + 1


def test_a_blueprint_says_how_to_show_it(reader: Any) -> None:
    assert len(list(reader.blueprints())) == 1
