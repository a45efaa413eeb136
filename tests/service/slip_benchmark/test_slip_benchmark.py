"""The open slip benchmark, on a few scenes of pillars, which are in closed form, and one of a gel."""

import json
import shutil
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service import formats
from service.cli import main
from service.cli.exit_codes import INPUT_REFUSED
from service.jobs import campaign
from service.slip_benchmark import folder as files
from service.slip_benchmark import making, scenes
from service.slip_benchmark.folder import Prediction, Truth, input_path, prediction_path, truth_path
from service.slip_benchmark.kinds import KINDS, faults_of, kinds_named, pairing
from service.slip_benchmark.making import make
from service.slip_benchmark.measures import measure, onsets
from service.slip_benchmark.page import draw, page
from service.slip_benchmark.running import Program, run
from service.slip_benchmark.scenes import SealedScene
from service.slip_benchmark.scoring import score
from slipcore.contact import Finger
from slipcore.contact.effects.object_motion import ObjectMotion
from slipcore.contact.effects.torsion import Torsion
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.errors import InvalidInput
from slipcore.frames import FrictionLaw
from stiction_client import container
from tests.executors import Here

PILLARS = kinds_named(["pillars 3x3"])
PHRASE = "a grey heron"
SHAPE = (4, 1, 2)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("benchmark") / "sealed"
    list(make(Here(), PHRASE, 2, PILLARS, folder))
    return folder


@pytest.fixture
def mine(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "mine"))


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def say(folder: Path, method: str, **changes: Callable[[Truth], Any]) -> None:
    """Let a method predict each scene, each member by the truth."""
    for scene in files.read_manifest(folder).scenes:
        truth = files.read_truth(truth_path(folder, scene.name))
        arrays = {name: np.asarray(change(truth)) for name, change in changes.items()}
        files.write_arrays(prediction_path(folder, method, scene.name), arrays)


def test_a_phrase_gives_the_same_files_and_another_gives_others(made: Path, tmp_path: Path) -> None:
    list(make(Here(), PHRASE, 2, PILLARS, tmp_path / "again"))
    assert contents(tmp_path / "again") == contents(made)
    list(make(Here(), f"{PHRASE}!", 1, PILLARS, tmp_path / "other"))
    first, other = (input_path(folder, "0000").read_bytes() for folder in (made, tmp_path / "other"))
    assert first != other


def test_the_manifest_tells_kinds_faults_and_hashes_but_nothing_to_draw_scenes_with(made: Path) -> None:
    record = json.loads((made / files.MANIFEST).read_text(encoding="utf-8"))
    assert (record["format"], record["version"], record["licence"]) == ("stiction-slip-benchmark", 1, "MIT")
    assert [scene["fault"] for scene in record["scenes"]] == ["no noise", "noise 1 µm"]
    assert PHRASE not in json.dumps(record)
    assert "simulation, not measurement" in (made / files.CARD).read_text(encoding="utf-8")
    drawn, of_the_seal = (SealedScene(phrase, 0).generator(0).random() for phrase in (PHRASE, record["seal"]))
    assert drawn != of_the_seal


def test_an_input_holds_no_truth(made: Path) -> None:
    log = formats.read(input_path(made, "0001"))
    assert (log.truth, log.object_pose, log.normal, log.contact) == (None, None, None, None)
    assert set(log.metadata) == {"benchmark", "scene"}
    truth = files.read_truth(truth_path(made, "0001"))
    assert truth.slip.any()
    np.testing.assert_allclose(np.std(log.displacement - truth.displacement), 1e-6, rtol=0.05)


def test_a_folder_that_was_left_half_made_is_completed_and_what_is_whole_is_kept(mine: Path, made: Path) -> None:
    truth_path(mine, "0000").write_bytes(truth_path(mine, "0000").read_bytes()[:-50])
    kept = input_path(mine, "0001").stat().st_mtime_ns
    (mine / files.CARD).unlink()
    list(make(Here(), PHRASE, 2, PILLARS, mine))
    assert contents(mine) == contents(made)
    assert input_path(mine, "0001").stat().st_mtime_ns == kept
    assert len(list(make(Here(), PHRASE, 1, PILLARS, mine))) == 2  # it keeps what it has


def test_a_folder_holds_one_phrase(mine: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"made by stiction \S+ of another phrase"):
        list(make(Here(), "another", 2, PILLARS, mine))
    with pytest.raises(InvalidInput, match="of this phrase for kinds pillars 3x3; allowed: one of the same phrase"):
        list(make(Here(), PHRASE, 2, kinds_named([]), mine))
    with pytest.raises(InvalidInput, match="phrase is ' '"):
        list(make(Here(), " ", 2, PILLARS, tmp_path / "new"))
    with pytest.raises(InvalidInput, match="a new or empty one"):
        list(make(Here(), PHRASE, 2, PILLARS, mine / "inputs"))
    with pytest.raises(InvalidInput, match="a new or empty one"):
        list(make(Here(), PHRASE, 2, PILLARS, mine / files.CARD))


def test_a_folder_may_be_there_if_it_is_empty(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert len(list(make(Here(), PHRASE, 1, PILLARS, tmp_path / "empty"))) == 1


def test_each_kind_has_each_of_its_faults_once_in_a_round() -> None:
    pairs = pairing(tuple(KINDS.values()))
    assert len(pairs) == len({(kind.name, fault.name) for kind, fault in pairs}) == 40
    assert [kind.name for kind, _ in pairs[:4]] == list(KINDS)
    with pytest.raises(InvalidInput, match="kind is markers 9x9"):
        kinds_named(["markers 9x9"])


def test_a_camera_without_depth_tells_nothing_along_z_and_no_forces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scenes, "FIDELITY", Fidelity(cells=8, tolerance=1e-3))
    gel = SealedScene("gel", 5, kinds_named(["markers 10x7"]))
    true, seen = gel.make()
    assert seen.grid in ((10, 7), (7, 10))
    assert seen.force is None
    assert not seen.displacement[..., 2].any()
    assert seen.contact is not None
    assert true.truth is not None
    assert true.truth.contact.any()
    assert not true.truth.contact[:7].any()  # rest
    assert np.ptp(np.diff(true.time)) < 1e-9


@pytest.mark.parametrize("family", dict.fromkeys(family for family, _ in scenes._FAMILIES), ids=lambda f: f.__name__)
def test_loads_begin_after_the_press_and_stay_below_sliding_and_motions_go_beyond(family: Any) -> None:
    body = scenes.DrawnPress(0.5, 8.0, 4e-3, Finger())
    for seed in range(20):
        effects, duration = family(np.random.default_rng(seed), body, 1.0)
        for effect in effects:
            begin = effect.start if isinstance(effect, Torsion) else effect.time[0]
            assert 0.5 < begin < duration
        (path,) = (effect for effect in effects if not isinstance(effect, Torsion))
        if isinstance(path, ObjectMotion):
            turned = 4e-3 * abs(path.yaw[-1]) if path.yaw else 0.0
            assert turned + max(np.hypot(path.x, path.y)) > body.give
        else:
            normal = body.force + np.array(path.normal_force or np.zeros(len(path.time)))
            pulled = np.hypot(path.force_x or 0.0, path.force_y or 0.0)
            assert (normal > 0.0).all()
            assert (pulled <= 0.98 * body.friction * normal).all()


def test_a_fault_changes_what_is_seen_and_not_the_truth() -> None:
    kind = PILLARS[0]
    true, _ = SealedScene(PHRASE, 0, PILLARS).make()
    for fault in faults_of(kind):
        seen = fault.seen(kind, true, np.random.default_rng(1))
        assert len(seen) == round((0.9 if "dropped" in fault.name else 1.0) * len(true))
        assert (seen.observed is not None) == ("lost" in fault.name)


def test_the_truth_itself_is_perfect_and_all_stick_finds_nothing(mine: Path) -> None:
    say(
        mine,
        "truth",
        slip=lambda t: t.slip,
        probability=lambda t: t.slip.astype(float),
        macro_slip=lambda t: t.macro_slip,
        friction=lambda t: t.friction,
        force=lambda t: t.force,
    )
    say(mine, "stick", slip=lambda t: np.zeros_like(t.slip))
    scores = score(mine)
    assert scores.methods == ["truth", "stick"]
    perfect, nothing = (scores.of(method).means for method in scores.methods)
    assert (perfect.f1, perfect.false_slip, perfect.onset_delay, perfect.missed_onsets) == (1.0, 0.0, 0.0, 0.0)
    assert (perfect.stick_ratio_error, perfect.macro_f1, perfect.brier) == (0.0, 1.0, 0.0)
    assert (perfect.friction_error, perfect.force_error) == (0.0, pytest.approx(0.0, abs=1e-12))
    assert (nothing.f1, nothing.false_slip, nothing.missed_onsets) == (0.0, 0.0, 1.0)
    assert np.isnan([nothing.onset_delay, nothing.friction_error, nothing.force_error, nothing.brier]).all()
    assert len(draw(scores).axes) == 2
    assert "simulation" in page(scores).lead


def truth_of(slip: list[list[int]]) -> Truth:
    """Two elements over four frames of a second, both in contact throughout."""
    mask, none = np.array(slip, bool).T.reshape(SHAPE), np.zeros(SHAPE, bool)
    field = np.ones((*SHAPE, 3))
    return Truth(
        np.arange(4.0), ~none, mask, mask, none[:, 0, 0], np.ones(4), np.ones(4), field, field, np.zeros((4, 3)),
        np.array([0.5, 0.0, 0.0, 0.0]), np.array(0.5),
    )  # fmt: skip


def test_scores_are_as_reckoned_by_hand() -> None:
    truth = truth_of([[0, 0, 1, 1], [0, 1, 1, 1]])
    said = np.array([[0, 0, 0, 1], [1, 1, 1, 1]], bool).T.reshape(SHAPE)
    found = measure(truth, Prediction(said, np.full(SHAPE, 0.5), None, 0.4, np.zeros((*SHAPE, 3))), None)
    assert found.f1 == pytest.approx(2 * 4 / (5 + 5))
    assert found.false_slip == pytest.approx(1 / 3)
    assert (found.onset_delay, found.missed_onsets) == (0.0, 0.0)  # one a frame late, one a frame early
    assert found.stick_ratio_error == pytest.approx(np.sqrt((0.5**2 + 0.5**2) / 4))
    assert found.macro_f1 == pytest.approx(2 * 1 / (2 + 1))
    assert (found.friction_error, found.force_error, found.brier) == (pytest.approx(0.2), 1.0, 0.25)
    unseen = np.ones(SHAPE, bool)
    unseen[..., 1] = False
    assert measure(truth, Prediction(said), unseen).f1 == pytest.approx(2 * 1 / 3)


@pytest.mark.parametrize(
    ("true", "said", "delay", "missed"),
    [
        ([0, 1, 1, 0], [0, 0, 1, 0], [1.0], 0.0),
        ([0, 0, 1, 1], [0, 1, 1, 1], [-1.0], 0.0),
        ([0, 0, 1, 1], [1, 1, 1, 1], [-2.0], 0.0),
        ([0, 1, 0, 1], [0, 1, 0, 0], [0.0], 0.5),
        ([0, 1, 0, 0], [0, 0, 1, 1], [], 1.0),
        ([1, 1, 1, 1], [1, 1, 1, 1], [], np.nan),
    ],
)
def test_an_onset_is_found_in_its_own_slip_or_missed(
    true: list[int], said: list[int], delay: list[float], missed: float
) -> None:
    masks = [np.array(each, bool).reshape(4, 1, 1) for each in (true, said)]
    found, share = onsets(np.arange(4.0), *masks, np.ones((4, 1, 1), bool))
    np.testing.assert_array_equal(found, delay)
    np.testing.assert_equal(share, missed)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"slip": np.zeros((2, 3, 3), bool)}, r"slip is bool of shape \[2, 3, 3\]; allowed: bool of shape"),
        ({"slip": np.zeros((7, 3, 3))}, "slip is float64 of shape"),
        ({"probability": np.zeros((7, 3, 3))}, "members is without slip"),
        ({"slip": np.zeros((7, 3, 3), bool), "mu": np.array(0.4)}, "with the unknown mu"),
        ({"slip": np.zeros((7, 3, 3), bool), "friction": np.array(np.nan)}, "friction is not finite"),
        ({"slip": np.zeros((7, 3, 3), bool), "probability": np.full((7, 3, 3), 2.0)}, "probability is 2 to 2"),
    ],
)
def test_a_prediction_of_the_wrong_shape_is_named(arrays: dict[str, Any], message: str, tmp_path: Path) -> None:
    files.write_arrays(tmp_path / "said.npz", arrays)
    with pytest.raises(InvalidInput, match=message):
        files.read_prediction(tmp_path / "said.npz", (7, 3, 3))


@pytest.mark.parametrize(
    ("members", "told"),
    [
        ("slip=slip[1:]", r"slip is bool of shape"),
        ("slip=slip.astype(float)", "slip is float64 of shape"),
        ("slip=slip, probability=slip + 2.0", "probability is 2 to 2; allowed: 0 to 1"),
        ("probability=slip + 0.0", "members is without slip"),
    ],
)
def test_what_a_program_wrote_is_read_as_it_will_be_scored(members: str, told: str, mine: Path, tmp_path: Path) -> None:
    script = tmp_path / "detector.py"
    script.write_text(
        "import sys, numpy as np\nslip = np.zeros(np.load(sys.argv[1])['displacement'].shape[:3], bool)\n"
        f"np.savez(sys.argv[2], {members})\n",
        encoding="utf-8",
    )
    ran = list(run(Here(), mine, [], Program("mine", f"{sys.executable} {script}", 30.0)))
    assert all(told in str(each.refused) for each in ran)
    refused = json.loads((mine / "results/mine/run.json").read_text(encoding="utf-8"))["refused"]
    assert list(refused) == ["0000", "0001"]
    assert len(score(mine).wrong) == 2  # the files stay, to be looked at


@pytest.mark.parametrize("bound", [0.0, 1.0])
def test_a_probability_may_be_as_small_and_as_large_as_they_come(bound: float, tmp_path: Path) -> None:
    arrays = {"slip": np.zeros((7, 3, 3), bool), "probability": np.full((7, 3, 3), bound)}
    files.write_arrays(tmp_path / "said.npz", arrays)
    said = files.read_prediction(tmp_path / "said.npz", (7, 3, 3))
    assert said.probability is not None
    np.testing.assert_array_equal(said.probability, bound)
    assert (said.friction, said.force, said.macro_slip) == (None, None, None)


def test_a_truth_of_another_version_is_refused_by_the_member_that_it_lacks(mine: Path) -> None:
    path = truth_path(mine, "0000")
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive if name != "friction_law"}
    files.write_arrays(path, arrays)
    with pytest.raises(InvalidInput, match="is without friction_law; allowed: a truth file of this version"):
        files.read_truth(path)


@pytest.mark.parametrize("left", [0, 100, -50])
def test_a_file_is_whole_only_with_all_that_was_written(mine: Path, left: int) -> None:
    path = truth_path(mine, "0000")
    assert files.is_whole(path)
    assert not files.is_whole(path.parent)
    path.write_bytes(path.read_bytes()[:left])
    assert not files.is_whole(path)


def test_the_acting_friction_is_the_law_at_the_force_weighted_mean_of_what_slips() -> None:
    force = np.zeros((1, 1, 3, 3))
    force[..., 2] = [[[-1.0, -3.0, 5.0]]]  # the last one is pulled: it bears no friction
    law = FrictionLaw((0.5, -0.8, -0.04))
    both, none = np.ones((1, 1, 3), bool), np.zeros((1, 1, 3), bool)
    mean = (1.0 + 9.0) / 4.0
    assert making._acting(law, force, both) == pytest.approx(0.5 - 0.04 * mean)
    assert making._acting(law, force, none) == pytest.approx(0.5 - 0.04 * mean)
    assert making._acting(law, force, both & [True, False, True]) == pytest.approx(0.46)


def test_sensors_have_no_noise_of_forces_where_their_markers_have_none(made: Path) -> None:
    noise = [(entry.marker_noise, entry.force_noise) for entry in files.read_manifest(made).scenes]
    assert noise == [(0.0, 0.0), (1e-6, 1e-2)]


def test_results_are_those_of_the_last_run_each_method_once(mine: Path) -> None:
    (stale := mine / files.RESULTS / "force_ratio" / "9999.npz").parent.mkdir(parents=True)
    stale.touch()
    ran = list(run(Here(), mine, ["force_ratio", "force_ratio"], None))
    assert sorted((each.method, each.scene) for each in ran) == [("force_ratio", scene) for scene in ("0000", "0001")]
    assert not stale.exists()
    told = json.loads((mine / "results/force_ratio/run.json").read_text(encoding="utf-8"))
    assert told["seconds"] == pytest.approx(sum(each.seconds for each in ran))
    assert (told["method"], told["by"], told["refused"]) == ("force_ratio", f"stiction {version('stiction')}", {})


def test_the_end_of_what_a_failed_program_said_is_kept(made: Path, tmp_path: Path) -> None:
    (script := tmp_path / "loud.sh").write_text('printf "%0400d" 7 >&2; exit 3', encoding="utf-8")
    with pytest.raises(InvalidInput, match=f"it said: {'0' * 299}7; allowed: code 0"):
        Program("loud", f"sh {script}", 5.0).predict(input_path(made, "0000"), tmp_path / "said.npz")
    with pytest.raises(InvalidInput, match="ended by code 1; it said: nothing"):
        Program("mute", "false", 5.0).predict(input_path(made, "0000"), tmp_path / "said.npz")


def test_scoring_says_how_far_it_is(mine: Path) -> None:
    say(mine, "stick", slip=lambda t: np.zeros_like(t.slip))
    told: list[tuple[float, str]] = []
    score(mine, lambda part, what: told.append((part, what)))
    assert told == [(0.5, "1 of 2 scenes scored"), (1.0, "2 of 2 scenes scored")]


def test_a_detector_is_run_on_the_inputs_alone_and_one_without_forces_is_told_of(mine: Path) -> None:
    shutil.rmtree(mine / "truth")
    truth = mine / "truth"
    truth.mkdir()
    for name in ("0000", "0001"):
        (truth / f"{name}.npz").write_bytes(b"none of its business")
    log = replace(formats.read(input_path(mine, "0001")), force=None)
    container.write(log, input_path(mine, "0001"))
    refused = {each.scene: each.refused for each in run(Here(), mine, ["force_ratio"], None)}
    assert refused["0000"] is None
    assert refused["0001"] == "force is missing; allowed: a sensor with forces, for detector force_ratio"
    assert not prediction_path(mine, "force_ratio", "0001").exists()
    told = json.loads((mine / "results/force_ratio/run.json").read_text(encoding="utf-8"))
    assert list(told["refused"]) == ["0001"]
    with np.load(prediction_path(mine, "force_ratio", "0000")) as said:
        assert set(said) == {"slip", "probability", "macro_slip", "friction"}


def test_a_program_predicts_or_its_failure_is_told(mine: Path, tmp_path: Path) -> None:
    script = tmp_path / "detector.sh"
    script.write_text('test -d "$(dirname "$1")/../truth" && exit 9\ncp "$1" "$2"\n', encoding="utf-8")
    copied, failed, silent, slow = (
        list(run(Here(), mine, [], Program(name, command, 0.1)))
        for name, command in (
            ("copies", f"sh {script}"),
            ("fails", "sh -c 'echo broken >&2; exit 3'"),
            ("silent", "true"),
            ("slow", "sh -c 'sleep 30'"),
        )
    )
    assert all("members is with the unknown" in str(each.refused) for each in copied)
    assert "fails is ended by code 3; it said: broken" in str(failed[0].refused)
    assert "without a prediction" in str(silent[0].refused)
    assert "not done after 0.1 s" in str(slow[0].refused)
    scores = score(mine)
    assert len(scores.wrong) == 2
    assert "prediction of copies for scene 0000: members is with the unknown" in str(scores.wrong[0].wrong)
    gaps = {each.method: each.missing for each in scores.each if each.missing}
    assert gaps["slow"] == str(slow[1].refused)


@pytest.mark.parametrize(
    ("name", "command", "message"),
    [
        ("a/b", "true", "name is 'a/b'"),
        ("a" * 62, "true", "name is 'a"),
        ("filter", "true", "no detector of this"),
        ("x", "no-such-program", "is there"),
        ("x", "", "external is ''; allowed: a command whose program is there"),
        ("x", "sh 'unended", r"allowed: a command \(No closing quotation\)"),
    ],
)
def test_a_program_that_cannot_be_run_is_refused(made: Path, name: str, command: str, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        list(run(Here(), made, [], Program(name, command, 1.0)))


def test_a_scene_that_was_changed_is_not_scored(mine: Path) -> None:
    say(mine, "stick", slip=lambda t: np.zeros_like(t.slip))
    shutil.copyfile(truth_path(mine, "0000"), truth_path(mine, "0001"))
    with pytest.raises(InvalidInput, match=r"0001\.npz is not the file of the manifest"):
        score(mine)


def test_a_scene_that_leads_out_of_the_folder_is_refused(mine: Path) -> None:
    path = mine / files.MANIFEST
    path.write_text(path.read_text(encoding="utf-8").replace('"0001"', '"../0001"'), encoding="utf-8")
    with pytest.raises(InvalidInput, match=r"a scene called '\.\./0001'"):
        score(mine)


def test_what_is_no_whole_benchmark_is_refused(mine: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"without manifest\.json"):
        score(tmp_path / "none")
    with pytest.raises(InvalidInput, match=r"results in .* is none"):
        score(mine)
    with pytest.raises(InvalidInput, match="detector is guess"):
        list(run(Here(), mine, ["guess"], None))
    input_path(mine, "0001").unlink()
    with pytest.raises(InvalidInput, match=r"without 1 of 2 scenes \(0001\)"):
        list(run(Here(), mine, ["filter"], None))
    (mine / files.MANIFEST).write_text('{"format": "stiction-slip-benchmark", "version": 2}', encoding="utf-8")
    with pytest.raises(InvalidInput, match="damaged or of something else"):
        score(mine)


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """A command of the benchmark in this process: (exit code, standard output, standard error)."""

    @contextmanager
    def here(*_: object) -> Iterator[Executor]:
        yield Here()

    monkeypatch.setattr(campaign, "workers", here)

    def run_command(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ending:
            main(["benchmark", *(str(argument) for argument in arguments)])
        out, err = capsys.readouterr()
        return int(ending.value.code or 0), out, err

    return run_command


def test_from_a_phrase_to_a_page(command: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    folder = tmp_path / "sealed"
    code, out, _ = command("make", "--phrase", "p", "--scenes", 1, "--kind", "pillars 3x3", "--out", folder, "--json")
    assert (code, json.loads(out)["scenes"]) == (0, 1)
    adapter = Path(__file__).parents[3] / "examples" / "slip_benchmark_adapter.py"
    external = f"{sys.executable} {adapter}"
    code, out, _ = command("run", folder, "--detector", "filter", "--external", external, "--name", "mine")
    assert code == 0
    assert "1 of 1" in out
    code, out, _ = command("score", folder)
    assert code == 0
    assert "gross slip F1" in out
    assert "simulation" in out
    told = json.loads((folder / "score.json").read_text(encoding="utf-8"))
    assert set(told["methods"]) == {"filter", "mine"}
    assert told["methods"]["filter"]["kinds"]["pillars 3x3"]["faults"]["no noise"]["scored"] == 1
    text = (folder / "score.html").read_text(encoding="utf-8")
    assert "<svg" in text
    assert "no noise" in text


def test_the_page_shows_the_adapter_that_runs() -> None:
    root = Path(__file__).parents[3]
    shown = (root / "docs" / "slip-benchmark.md").read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    assert (root / "examples" / "slip_benchmark_adapter.py").read_text(encoding="utf-8").endswith(shown)


def test_each_kind_and_fault_is_on_the_page() -> None:
    page_text = (Path(__file__).parents[3] / "docs" / "slip-benchmark.md").read_text(encoding="utf-8")
    assert [name for name in KINDS if f"| `{name}` |" not in page_text] == []
    names = {fault.name for kind in KINDS.values() for fault in faults_of(kind) if not fault.name.startswith("noise ")}
    assert [name for name in names if f"| {name} |" not in page_text] == []


def test_what_cannot_be_scored_ends_the_command_with_what_is_wrong(
    command: Callable[..., tuple[int, str, str]], mine: Path
) -> None:
    say(mine, "short", slip=lambda t: t.slip[:-1])
    code, _, err = command("score", mine, "--json")
    assert code == INPUT_REFUSED
    assert "prediction of short for scene 0001: slip is bool of shape" in err
    code, _, err = command("run", mine, "--external", "false", "--name", "mine", "--json")
    assert code == INPUT_REFUSED
    (script := mine / "junk.sh").write_text('echo junk > "$2"\n', encoding="utf-8")
    code, out, _ = command("run", mine, "--external", f"sh {script}", "--name", "mine")
    assert code == INPUT_REFUSED
    assert "0 of 2" in out
    assert "mine, scene 0000" in out
    code, _, err = command("score", mine / "nowhere")
    assert code == INPUT_REFUSED
    assert "stiction benchmark make" in err


def test_what_slides_stays_there_or_comes_back_on_its_way() -> None:
    """By up to 130 %, and in half of the scenes at all."""
    body = scenes.DrawnPress(0.5, 8.0, 4e-3, Finger())
    shares = []
    for seed in range(40):
        (motion,), end = scenes._slide(np.random.default_rng(seed), body, 0.0)
        x, y = np.array(motion.x), np.array(motion.y)
        far = np.hypot(x[1], y[1])
        assert far >= 1.1 * body.give
        assert end == pytest.approx(motion.time[-1] + 0.1)
        assert x[1] * y[2] == pytest.approx(y[1] * x[2], abs=1e-12)  # along one line
        shares.append((x[1] * x[2] + y[1] * y[2]) / far**2)
    back = np.array([share for share in shares if share < 0.999])
    assert ((back >= -0.3) & (back <= 0.6)).all()
    assert 10 <= len(back) <= 30
    assert max(shares) == pytest.approx(1.0)
