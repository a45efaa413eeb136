"""What commands of the slip benchmark print of what was run."""

import pytest

from service.cli import benchmark, main
from service.cli.exit_codes import INPUT_REFUSED
from service.slip_benchmark import folder
from service.slip_benchmark.running import PredictionRun

Capture = pytest.CaptureFixture[str]


def test_predictions_are_counted_by_method_in_the_order_in_which_they_ran(capsys: Capture) -> None:
    ran = [
        PredictionRun("mine", "0000", 1.25, None),
        PredictionRun("filter", "0000", 0.5, None),
        PredictionRun("mine", "0001", 2.0, "no\x1b[2J"),
        PredictionRun("mine", "0002", 2.0, "no\x1b[2J"),
    ]
    benchmark._print_run(ran, 3)
    title, _, _, first, second, *reasons = capsys.readouterr().out.splitlines()
    assert (title, first.split(), second.split()) == (
        "Predictions", ["mine", "1", "of", "3", "5.2"], ["filter", "1", "of", "3", "0.5"]
    )  # fmt: skip
    assert reasons == ["mine, scene 0001 and 1 more: no�[2J"]


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["score", "sealed", "--picture", "x.txt"], 2, "ends in .png or .svg"),
        (["run", "sealed", "--name", "mine"], INPUT_REFUSED, "name is mine; allowed: none without --external"),
    ],
)
def test_what_would_be_in_vain_is_refused_first(
    arguments: list[str], code: int, told: str, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder, "read_whole_benchmark", lambda _: pytest.fail("began"))
    with pytest.raises(SystemExit) as left:
        main(["benchmark", *arguments])
    assert left.value.code == code
    assert told in " ".join(capsys.readouterr().err.replace("│", " ").split())


def test_the_first_twenty_reasons_are_named(capsys: Capture) -> None:
    benchmark._print_run([PredictionRun("mine", f"{k:04d}", 0.0, f"reason {k}") for k in range(25)], 25)
    assert capsys.readouterr().out.splitlines()[4:] == [f"mine, scene {k:04d}: reason {k}" for k in range(20)]
