import pytest

from slipcore import METHODS, FilterOptions, InvalidInput, SampleOptions, describe_options
from slipcore.defaults import METHOD_NAMES, choose_options
from slipcore.options import Options

KINDS = [SampleOptions, *(method.options for method in METHODS.values())]


@pytest.mark.parametrize("kind", KINDS)
def test_ends_of_the_range_are_allowed_and_what_lies_beyond_is_refused(kind: type[Options]) -> None:
    for name, option in describe_options(kind).items():
        whole = isinstance(getattr(kind(), name), int)
        for value in (option.low, option.high):
            assert getattr(choose_options(kind, {name: int(value) if whole else value}), name) == value
        with pytest.raises(InvalidInput, match=name):
            choose_options(kind, {name: int(option.high) + 1 if whole else option.high * 1.001})


def test_the_names_of_the_methods_are_those_of_the_table() -> None:
    assert tuple(METHODS) == METHOD_NAMES


@pytest.mark.parametrize("name", ["onset_time", "following_least", "rim_clear"])
def test_a_former_option_is_ignored_with_a_warning(name: str) -> None:
    with pytest.warns(DeprecationWarning, match=f"option {name} has no effect"):
        assert choose_options(FilterOptions, {name: 0.5, "creep": 1e-6}) == FilterOptions(creep=1e-6)
