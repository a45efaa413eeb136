"""How many fields an object of a body may have."""

import pytest
from starlette.exceptions import HTTPException

from service.http import bodies


def test_an_object_has_as_many_fields_as_may_be_each_once() -> None:
    pairs = [(str(number), number) for number in range(bodies.MOST_FIELDS)]
    assert bodies._few_fields(pairs) == dict(pairs)
    for wrong, told in (
        ([*pairs, ("more", 1)], f"an object of the body has more than {bodies.MOST_FIELDS} fields"),
        ([("a", 1), ("b", 2), ("a", 1)], "an object of the body has the field 'a' more than once"),
    ):
        with pytest.raises(HTTPException) as refusal:
            bodies._few_fields(wrong)
        assert (refusal.value.status_code, refusal.value.detail) == (400, told)
