"""What refusals of the simulator say."""

import pytest

from slipcore.contact.errors import OutOfReach, rounded_up


@pytest.mark.parametrize(
    ("value", "two_digits"), [(2.04, 2.1), (0.0101, 0.011), (0.01, 0.01), (99.1, 100.0), (123.0, 130.0), (0.0, 0.0)]
)
def test_what_is_rounded_up_has_two_digits_and_is_no_less(value: float, two_digits: float) -> None:
    assert rounded_up(value) == pytest.approx(two_digits, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "asked", "least", "seconds", "told"),
    [
        ("seconds", 2.0, 2.04, 2.04, "seconds is 2; allowed: 2.1 s or more"),
        ("seconds", 2.0, 130.0, 130.0, "seconds is 2; allowed: 3 min or more"),
        ("seconds", 2.0, 7300.0, 7300.0, "seconds is 2; allowed: 3 h or more"),
        ("accuracy", 0.0201, 0.0204, 5.0, "accuracy is 0.0201; allowed: 0.021 or more, which takes about 5 s"),
    ],
)
def test_what_a_refused_request_is_told_to_ask_for_is_enough(
    name: str, asked: float, least: float, seconds: float, told: str
) -> None:
    assert str(OutOfReach(name, asked, least, seconds)) == told
