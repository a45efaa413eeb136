from datetime import UTC, datetime, timedelta

import pytest

from service import formatting
from service.web.assets import all_assets


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.4, "0.400"),
        (-0.12345, "−0.123"),
        (1234.5, "1230"),
        (181.0, "181"),
        (2.5e-7, "2.50 × 10⁻⁷"),
        (3e9, "3.00 × 10⁹"),
        (0.0, "0"),
        (float("nan"), "–"),
        (None, "–"),
    ],
)
def test_numbers_have_sensible_digits(value: float | None, text: str) -> None:
    assert formatting.number(value) == text


@pytest.mark.parametrize(
    ("value", "text"), [(3.7501, "3.76"), (3.75, "3.75"), (9.999, "10.0"), (0.0, "0"), (1234.0, "1240")]
)
def test_a_force_that_holds_is_rounded_up(value: float, text: str) -> None:
    assert formatting.at_least(value) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (5, "just now"),
        (59, "just now"),
        (60, "1 minute ago"),
        (3599, "59 minutes ago"),
        (3600, "1 hour ago"),
        (7300, "2 hours ago"),
        (86399, "23 hours ago"),
        (86400, "1 day ago"),
        (864000, "10 days ago"),
        (365.25 * 86400 - 1, "365 days ago"),
        (4e7, "1 year ago"),
    ],
)
def test_an_age_is_told_in_its_largest_unit(seconds: float, text: str) -> None:
    now = datetime.now(UTC)
    assert formatting.age(now - timedelta(seconds=seconds), now) == text


@pytest.mark.parametrize(
    ("count", "text"), [(999, "999 bytes"), (1000, "1 kB"), (2_500_000, "2.5 MB"), (1_000_000_000, "1 GB")]
)
def test_bytes_are_counted_in_powers_of_a_thousand(count: int, text: str) -> None:
    assert formatting.size(count) == text


def test_a_range_has_both_its_ends_or_is_none() -> None:
    assert formatting.interval((0.1, None)) == "0.100 … –"
    assert formatting.interval(None) == "–"


def test_style_and_scripts_are_light() -> None:
    assert sum(len(asset.content) for asset in all_assets().values()) <= 150_000
