"""Which format a name asks for, and who writes it."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from service import formats
from service.formats import writing
from slipcore import GraspLog, InvalidInput
from stiction_client import container


@pytest.mark.parametrize(
    ("name", "kind"), [("a.npz", "npz"), ("a.b.PARQUET", "parquet"), ("a.mcap", "mcap"), ("npz.Mcap", "mcap")]
)
def test_a_name_s_ending_says_its_format_in_any_case(name: str, kind: str) -> None:
    assert writing.format_of(Path("there", name)) == kind


@pytest.mark.parametrize("name", ["a.txt", "npz", ".mcap", "a.npz.gz"])
def test_another_ending_is_refused_with_those_that_are_written(name: str) -> None:
    told = f"output is {name}; allowed: a name that ends in .npz, .parquet, .mcap"
    with pytest.raises(InvalidInput, match=told):
        writing.format_of(Path("there", name))


def test_each_format_is_written_by_its_own_module(
    log: GraspLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, Path]] = []

    def module(name: str) -> SimpleNamespace:
        return SimpleNamespace(write=lambda _, path: asked.append((name, path)))

    monkeypatch.setattr(formats, "module_of", module)
    writing.write(log, tmp_path / "a", "mcap")
    writing.write(log, tmp_path / "b", "npz")
    assert asked == [("mcap", tmp_path / "a")]
    assert (tmp_path / "b").read_bytes() == container.encode(log)
