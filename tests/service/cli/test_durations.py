"""Ages and moments as people type them."""

from datetime import UTC, datetime, timedelta

import pytest
import typer

from service.cli.durations import duration, in_words, moment_to_come

NOW = datetime(2026, 11, 26, 12, tzinfo=UTC)


@pytest.mark.parametrize(
    ("text", "length"),
    [
        ("12h", timedelta(hours=12)),
        ("90d", timedelta(days=90)),
        ("0d", timedelta(0)),
        ("36500d", timedelta(days=36500)),
        ("876000h", timedelta(days=36500)),
    ],
)
def test_hours_and_days_are_read_up_to_a_century(text: str, length: timedelta) -> None:
    assert duration("grace", text) == length


@pytest.mark.parametrize(
    "text", ["36501d", "876001h", "1000000h", "12", "h", "-1d", "1.5d", "12m", "٣d", " 1d", "1d\n"]
)
def test_what_is_no_age_is_refused_with_its_option(text: str) -> None:
    with pytest.raises(typer.BadParameter) as refusal:
        duration("grace", text)
    assert str(refusal.value) == f"grace is {text}; allowed: hours or days such as 12h or 90d, at most 36500d"


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("12h", NOW + timedelta(hours=12)),
        ("2d", NOW + timedelta(days=2)),
        ("2026-11-27", datetime(2026, 11, 27, tzinfo=UTC)),
        ("2026-11-26T12:00:01", NOW + timedelta(seconds=1)),
        ("2026-11-26T13:30:00+01:00", NOW + timedelta(minutes=30)),
    ],
)
def test_a_moment_to_come_is_an_age_from_now_a_date_or_a_moment_in_utc(text: str, moment: datetime) -> None:
    found = moment_to_come("expires", text, NOW)
    assert (found, found.tzinfo) == (moment, UTC)


@pytest.mark.parametrize("text", ["2026-11-26T12:00:00", "2026-11-26T13:00:00+01:00", "2026-11-26", "0h"])
def test_now_is_past(text: str) -> None:
    with pytest.raises(typer.BadParameter, match=r"which is past; allowed: a moment to come"):
        moment_to_come("expires", text, NOW)


@pytest.mark.parametrize("text", ["soon", "2026-13-01", ""])
def test_what_is_no_moment_is_refused_with_what_is(text: str) -> None:
    with pytest.raises(typer.BadParameter, match=f"expires is {text}; allowed: such as 90d, 12h or 2027-01-31"):
        moment_to_come("expires", text, NOW)


@pytest.mark.parametrize(
    ("length", "words"),
    [
        (timedelta(days=7), "7 days"),
        (timedelta(days=1.5), "36 h"),
        (timedelta(hours=12), "12 h"),
        (timedelta(days=2), "2 days"),
        (timedelta(0), "0 h"),
    ],
)
def test_a_length_of_time_is_told_in_days_or_hours(length: timedelta, words: str) -> None:
    assert in_words(length) == words
