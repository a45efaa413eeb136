"""What Foxglove is given, read back by the MCAP library."""

import base64
import json
import re
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation

from service import exports
from service.exports import DetectedLog
from service.exports.foxglove import CELL, TOPICS
from service.exports.scene import COLOURS
from slipcore.slip_state import element_states

FRAME = 60
"""In which elements slip."""

ROOT = Path(__file__).parents[3]


def read(path: Path) -> dict[str, list[Any]]:
    """The messages of each topic."""
    found: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            found.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    return found


@pytest.fixture(scope="module")
def path(recording: DetectedLog, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("foxglove") / "log.mcap"
    exports.write([recording], file, exports.target_of(file))
    return file


@pytest.fixture(scope="module")
def messages(path: Path) -> dict[str, list[Any]]:
    return read(path)


def test_every_topic_has_a_message_a_frame_at_its_time(messages: dict[str, list[Any]], recording: DetectedLog) -> None:
    assert messages.keys() == TOPICS.keys()
    for told in messages.values():
        np.testing.assert_allclose([moment * 1e-9 for moment, _ in told], recording.log.time, atol=1e-9)


def test_the_grid_shows_the_state_of_each_element_where_it_is(
    messages: dict[str, list[Any]], recording: DetectedLog
) -> None:
    states, log = element_states(recording.history.contact, recording.history.slip), recording.log
    for (_, grid), expected in zip(messages["/slip/grid"], states, strict=True):
        cells = np.frombuffer(base64.b64decode(grid["data"]), CELL).reshape(log.grid)
        np.testing.assert_array_equal(cells["state"], expected)
        np.testing.assert_array_equal(cells["red"], COLOURS[expected, 0])
    assert (grid["row_stride"], grid["cell_stride"], grid["column_count"]) == (5 * log.grid[1], 5, log.grid[1])
    assert {2} < {*states.ravel().tolist()}  # some slip, some do not
    turned = Rotation.from_quat([grid["pose"]["orientation"][axis] for axis in "xyzw"])
    corner = np.array([grid["pose"]["position"][axis] for axis in "xyz"])
    for row, column in ((0, 0), (3, 5), (log.grid[0] - 1, log.grid[1] - 1)):
        middle = [(column + 0.5) * grid["cell_size"]["x"], (row + 0.5) * grid["cell_size"]["y"], 0.0]
        at = corner + turned.apply(middle)
        np.testing.assert_allclose(at[:2], log.position[row, column, :2], atol=1e-6)


def test_lines_follow_the_tangential_force_of_elements_in_contact(
    messages: dict[str, list[Any]], recording: DetectedLog
) -> None:
    log, k = recording.log, len(recording.log) // 2
    assert log.force is not None
    (entity,) = messages["/slip/scene"][k][1]["entities"]
    points = np.array([[point[axis] for axis in "xyz"] for point in entity["lines"][0]["points"]]).reshape(-1, 2, 3)
    touching = recording.history.contact[k]
    np.testing.assert_allclose(points[:, 0], log.position[touching], atol=1e-8)
    drawn, force = points[:, 1] - points[:, 0], log.force[k][touching] * [1.0, 1.0, 0.0]
    scale = np.abs(drawn).max() / np.abs(force).max()
    np.testing.assert_allclose(drawn, scale * force, atol=1e-8)
    assert entity["metadata"][0]["value"].endswith("N of tangential force")


def test_patches_stand_with_their_regimes(messages: dict[str, list[Any]], recording: DetectedLog) -> None:
    (patch,) = recording.history.patches
    for k in range(len(patch.pose)):
        (entity,) = messages["/slip/scene"][patch.first + k][1]["entities"]
        words = entity["texts"]
        if np.isfinite(patch.pose[k, :2]).all():
            assert [word["text"] for word in words] == [patch.regime[k]]
            np.testing.assert_allclose(words[0]["pose"]["position"]["x"], patch.pose[k, 0], atol=1e-8)


def test_numbers_over_time_are_those_of_the_history(messages: dict[str, list[Any]], recording: DetectedLog) -> None:
    log, history = recording.log, recording.history
    assert log.force is not None
    told = [state for _, state in messages["/slip/state"]]
    ratio = [np.nan if state["stick_ratio"] is None else state["stick_ratio"] for state in told]
    np.testing.assert_allclose(ratio, history.stick_ratio)
    np.testing.assert_allclose([state["normal_force"] for state in told], np.abs(log.force[..., 2].sum((1, 2))))
    assert [state["elements_in_contact"] for state in told] == history.contact.sum((1, 2)).tolist()


def test_messages_are_as_their_schemas_say(path: Path) -> None:
    import jsonschema  # makes parsers of URLs as it is imported: 2 s of CPU in each process that collects the tests

    with path.open("rb") as file:
        for schema, channel, message in islice(make_reader(file).iter_messages(), 3 * FRAME, 3 * FRAME + 3):
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert schema.name == TOPICS[channel.topic][0]
            told = json.loads(schema.data)
            content = json.loads(message.data)
            jsonschema.validate(content, told)
            assert content.keys() == told["properties"].keys()


@pytest.mark.parametrize("name", ["Grid", "SceneUpdate"])
def test_messages_fit_foxgloves_own_definitions(messages: dict[str, list[Any]], name: str) -> None:
    """Every field is there under its name, and of its type: in the definitions that Foxglove publishes."""
    reason = "foxglove-schemas-protobuf is not installed: pip install foxglove-schemas-protobuf"
    definition = pytest.importorskip(f"foxglove_schemas_protobuf.{name}_pb2", reason=reason)
    from google.protobuf import json_format

    (topic,) = [topic for topic, (schema, _) in TOPICS.items() if schema == f"foxglove.{name}"]
    for _, message in messages[topic][:: len(messages[topic]) // 5]:
        read = json_format.ParseDict(with_protobufs_times(message), getattr(definition, name)())
        told = json_format.MessageToDict(read, always_print_fields_with_no_presence=True)
        assert {json_format_name(field) for field in message} == told.keys()


def json_format_name(field: str) -> str:
    first, *others = field.split("_")
    return first + "".join(map(str.capitalize, others))


def with_protobufs_times(told: Any, of: str = "") -> Any:
    """Times as JSON of Protocol Buffers has them, where Foxglove's JSON has seconds and nanoseconds."""
    if isinstance(told, list):
        return [with_protobufs_times(each) for each in told]
    if not isinstance(told, dict):
        return told
    if told.keys() == {"sec", "nsec"}:
        part = f"{told['nsec']:09d}"
        moment = f"1970-01-01T00:{told['sec'] // 60:02d}:{told['sec'] % 60:02d}.{part}Z"
        return f"{told['sec']}.{part}s" if of == "lifetime" else moment
    return {name: with_protobufs_times(value, name) for name, value in told.items()}


def test_a_log_without_forces_shows_displacement(recording: DetectedLog, tmp_path: Path) -> None:
    bare = DetectedLog(replace(recording.log, force=None, truth=None), recording.history, "bare")
    exports.write([bare], tmp_path / "bare.mcap", "foxglove")
    messages = read(tmp_path / "bare.mcap")
    assert messages["/slip/state"][0][1]["normal_force"] is None
    (entity,) = messages["/slip/scene"][-1][1]["entities"]
    assert entity["metadata"][0]["value"].endswith("m of displacement")


def test_the_layout_that_is_shipped_shows_what_is_written(messages: dict[str, list[Any]]) -> None:
    layout = json.loads((ROOT / "docs/deploy/foxglove-layout.json").read_text(encoding="utf-8"))
    panels = layout["configById"]
    assert panels["3D!map"]["topics"].keys() <= messages.keys()
    for panel in panels.values():
        for path in panel.get("paths", ()):
            topic, _, field = path["value"].rpartition(".")
            assert field in messages[topic][0][1], path["value"]
    placed = re.findall(r'"(?:first|second)": "([^"]+)"', json.dumps(layout["layout"]))
    assert sorted(placed) == sorted(panels)
