import pickle

import pytest

from db.errors import AlreadyExists, DatabaseError, DriverMissing, NotFound, SchemaMismatch, StorageUnavailable


@pytest.mark.parametrize(
    "error",
    [
        NotFound("material", "x"),
        AlreadyExists("material", "x"),
        DriverMissing("postgresql://h/d", "psycopg"),
        StorageUnavailable("full"),
        SchemaMismatch("old"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_survive_the_way_between_processes(error: DatabaseError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)


def test_errors_name_the_thing() -> None:
    assert str(NotFound("material", "paper")) == "no material 'paper' is stored"
    assert str(AlreadyExists("material", "paper")) == "material 'paper' is stored already"
