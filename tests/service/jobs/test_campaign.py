import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from service import formats
from service.jobs import campaign
from service.jobs.campaign import RequestedAccuracy
from service.processes import spawned
from slipcore.contact import Scene
from slipcore.contact.effects import MeasuredSurface, SensorSampling
from slipcore.errors import InvalidInput
from tests.executors import Here

QUICK = RequestedAccuracy()


def scene(name: str = "A press", friction: float = 0.4, **more: Any) -> Scene:
    noise = {"kind": "MarkerNoise", "scale": 1e-6}
    sampling = {"kind": "SensorSampling", "frame_rate": 3.0, "points": [4, 4]}
    return Scene.from_mapping({"name": name, "friction": friction, "effect": [sampling, noise], **more})


def test_each_scene_is_simulated_with_each_seed(tmp_path: Path) -> None:
    scenes = [scene(), scene("Another: press", friction=0.7)]
    made = list(campaign.run(Here(), scenes, range(2), tmp_path, QUICK))
    assert {outcome.path.name for outcome in made} == {
        "a_press-0.npz", "a_press-1.npz", "another_press-0.npz", "another_press-1.npz",
    }  # fmt: skip
    assert not any(outcome.refused for outcome in made)
    first, second = (formats.read(tmp_path / f"another_press-{seed}.npz") for seed in range(2))
    assert first.truth is not None
    assert first.truth.friction.coefficients[0] == 0.7
    assert not np.array_equal(first.displacement, second.displacement)  # noise of its own


def test_parquet_files_are_one_data_set_of_scenes_and_seeds_with_their_truth(tmp_path: Path) -> None:
    scenes = [scene(), scene("Another: press", friction=0.7)]
    made = list(campaign.run(Here(), scenes, range(2), tmp_path, QUICK, "parquet"))
    found = pq.read_table(tmp_path / "logs").to_pandas()
    assert set(zip(found["scene"], found["seed"], strict=True)) == {
        ("a_press", 0), ("a_press", 1), ("another_press", 0), ("another_press", 1),
    }  # fmt: skip
    for outcome in made:
        alone = formats.read(outcome.path)
        assert alone.truth is not None
        own = found[(found["scene"] == outcome.path.parts[-3].removeprefix("scene=")) & (found["seed"] == outcome.seed)]
        np.testing.assert_array_equal(own["time"], alone.time)
        np.testing.assert_array_equal(own["truth_stick_ratio"], alone.truth.stick_ratio)
        assert (
            np.stack([np.stack([np.stack(row) for row in frame]) for frame in own["force"]]).shape == alone.force.shape
        )
    before = {outcome.path: outcome.path.stat().st_mtime_ns for outcome in made}
    assert {each.path for each in campaign.run(Here(), scenes, range(2), tmp_path, QUICK, "parquet")} == before.keys()
    assert before == {path: path.stat().st_mtime_ns for path in before}


def test_a_format_that_is_none_is_refused_and_nothing_written(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="format is csv; allowed: npz or parquet"):
        list(campaign.run(Here(), [scene()], range(1), tmp_path / "new", QUICK, "csv"))
    assert not (tmp_path / "new").exists()


def test_a_folder_holds_logs_of_one_format(tmp_path: Path) -> None:
    list(campaign.run(Here(), [scene()], range(1), tmp_path, QUICK))
    plan = tmp_path / campaign.PLAN
    told = json.loads(plan.read_text(encoding="utf-8"))
    del told["format"]  # a plan of before
    plan.write_text(json.dumps(told), encoding="utf-8")
    with pytest.raises(InvalidInput, match="parquet; allowed: npz, or another folder"):
        list(campaign.run(Here(), [scene()], range(1), tmp_path, QUICK, "parquet"))
    assert len(list(campaign.run(Here(), [scene()], range(1), tmp_path, QUICK))) == 1


def test_what_is_there_is_not_made_again(tmp_path: Path) -> None:
    list(campaign.run(Here(), [scene()], range(2), tmp_path, QUICK))
    (tmp_path / "a_press-1.npz").unlink()
    again = Here()
    made = list(campaign.run(again, [scene()], range(3), tmp_path, QUICK))
    assert [options["seed"] for options in again.options] == [1, 2]
    assert sorted(outcome.seed for outcome in made) == [0, 1, 2]


@pytest.mark.parametrize("written_as", campaign.FORMATS)
@pytest.mark.parametrize("left", [0, 2, 0.5, 0.999])
def test_a_log_that_was_cut_is_made_again(tmp_path: Path, written_as: str, left: float) -> None:
    """A crash of the system leaves less than was written of a file that has its name."""
    first = campaign.run(Here(), [scene()], range(2), tmp_path, QUICK, written_as)
    cut, whole = sorted(first, key=lambda outcome: outcome.seed)
    content = cut.path.read_bytes()
    cut.path.write_bytes(content[: int(left if left > 1 else left * len(content))])
    again = Here()
    made = list(campaign.run(again, [scene()], range(2), tmp_path, QUICK, written_as))
    assert [options["seed"] for options in again.options] == [0]
    assert not any(outcome.refused for outcome in made)
    assert formats.read(cut.path).truth is not None
    assert {outcome.path for outcome in made} == {cut.path, whole.path}


def test_maps_that_differ_anywhere_are_other_scenes(tmp_path: Path) -> None:
    heights = np.zeros((40, 40))
    scenes = []
    for step in (0.0, 1e-12):
        heights[20, 20] = step
        scenes.append(Scene("A map", (MeasuredSurface(heights.copy(), 1e-3), SensorSampling((4, 4)))))
    list(campaign.run(Here(), scenes[:1], [], tmp_path, QUICK))
    with pytest.raises(InvalidInput, match="another 'A map' than that in"):
        list(campaign.run(Here(), scenes[1:], [], tmp_path, QUICK))


def test_what_is_refused_is_told_and_the_others_go_on(tmp_path: Path) -> None:
    pull = {"kind": "TangentialLoad", "force": [100.0, 0.0]}
    bad = Scene.from_mapping({"name": "Too strong", "effect": [pull]})
    made = {outcome.scene: outcome for outcome in campaign.run(Here(), [bad, scene()], [0], tmp_path, QUICK)}
    assert "tangential load" in str(made["Too strong"].refused)
    assert made["A press"].refused is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a_press-0.npz", "campaign.json"]


def test_what_fails_otherwise_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def die(*_: Any, **__: Any) -> None:
        raise MemoryError("all of it")

    monkeypatch.setattr(campaign, "simulate", die)
    (outcome,) = campaign.run(Here(), [scene()], [0], tmp_path, QUICK)
    assert outcome.refused == "MemoryError: all of it"
    assert not outcome.path.exists()


def test_a_folder_holds_one_campaign(tmp_path: Path) -> None:
    list(campaign.run(Here(), [scene()], [0], tmp_path, QUICK))
    with pytest.raises(InvalidInput, match=r"is accuracy 0\.1; allowed: no accuracy, or another folder"):
        list(campaign.run(Here(), [scene()], [0], tmp_path, RequestedAccuracy(accuracy=0.1)))
    with pytest.raises(InvalidInput, match="another 'A press' than that in"):
        list(campaign.run(Here(), [scene(friction=0.5)], [0], tmp_path, QUICK))
    list(campaign.run(Here(), [scene("More")], [0], tmp_path, QUICK))
    assert (tmp_path / "more-0.npz").exists()


@pytest.mark.parametrize("content", ["", "[1]", '{"scenes": {}}', '{"scenes": 1, "promise": 2}'])
def test_a_plan_that_is_none_is_refused_and_stays(tmp_path: Path, content: str) -> None:
    (tmp_path / "campaign.json").write_text(content, encoding="utf-8")
    with pytest.raises(InvalidInput, match="damaged or of something else"):
        list(campaign.run(Here(), [scene()], [0], tmp_path, QUICK))
    assert (tmp_path / "campaign.json").read_text(encoding="utf-8") == content


def test_a_process_that_dies_is_told_and_its_log_made_the_next_time(tmp_path: Path) -> None:
    with campaign.workers(1) as executor:
        outcomes = campaign.run(executor, [scene()], range(12), tmp_path, QUICK)
        first = next(outcomes)
        spawned.kill(executor)
        made = [first, *outcomes]
    refused = [outcome for outcome in made if outcome.refused]
    assert first.refused is None
    assert "BrokenProcessPool" in {str(outcome.refused).partition(":")[0] for outcome in refused}
    assert len(list(tmp_path.glob("*.npz"))) == 12 - len(refused)
    assert not any(outcome.refused for outcome in campaign.run(Here(), [scene()], range(12), tmp_path, QUICK))


def test_two_scenes_of_one_file_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="'a_press' twice"):
        list(campaign.run(Here(), [scene(), scene("a press")], [0], tmp_path, QUICK))
    assert not list(tmp_path.iterdir())
