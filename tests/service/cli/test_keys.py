import json
from pathlib import Path

import pytest
from sqlalchemy import URL

from db.blobs import BlobStore
from db.database import Database
from db.repositories import access_keys
from service import cli
from service.cli.exit_codes import INPUT_REFUSED
from service.domain.access.keys import is_key

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Capture):  # type: ignore[no-untyped-def]
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))

    def command(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ended:
            cli.main(["keys", *arguments])
        shown = capsys.readouterr()
        return int(ended.value.code or 0), shown.out + shown.err

    return command


def test_a_key_is_shown_once_listed_and_revoked(run, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    code, text = run("create", "gripper 7", "--scope", "upload")
    assert code == 0
    code, listed = run("list", "--json")
    (shown,) = json.loads(listed)["keys"]
    assert (shown["name"], shown["scope"], shown["revoked_at"]) == ("gripper 7", "upload", None)
    assert text.strip() not in listed
    assert text.strip().encode() not in (tmp_path / "stiction.sqlite3").read_bytes()
    assert run("revoke", shown["id"]) == (0, f"key {shown['id']} (gripper 7) is revoked\n")
    revoked = json.loads(run("list", "--json")[1])["keys"][0]["revoked_at"]
    assert revoked is not None
    run("revoke", shown["id"])
    assert json.loads(run("list", "--json")[1])["keys"][0]["revoked_at"] == revoked
    url = URL.create("sqlite", database=str(tmp_path / "stiction.sqlite3")).render_as_string()
    database = Database(url)
    with database.read() as session:
        assert not is_key(text.strip(), access_keys.get(session, shown["id"]))
    database.close()


def test_keys_of_another_database_than_that_of_the_files_are_left_alone(  # type: ignore[no-untyped-def]
    run, tmp_path: Path
) -> None:
    run("create", "robot", "--database-url", copy := f"sqlite:///{tmp_path}/copy.sqlite3")
    (shown,) = json.loads(run("list", "--json", "--database-url", copy)[1])["keys"]
    BlobStore(tmp_path).write_store_id("0" * 32)
    for command in (("create", "x"), ("list",), ("revoke", shown["id"])):
        code, told = run(*command, "--database-url", copy)
        assert (code, "0" * 32 in told, "Traceback" in told) == (INPUT_REFUSED, True, False)
    assert run("create", "x")[0] == INPUT_REFUSED  # in a database that would be new
    assert not (tmp_path / "stiction.sqlite3").exists()


def test_a_program_gets_the_key_as_json_and_read_is_the_least(run) -> None:  # type: ignore[no-untyped-def]
    made = json.loads(run("create", "planner", "--json")[1])
    assert made["scope"] == "read"
    assert made["key"].startswith(f"stiction_{made['id']}_")
    assert "planner" in run("list")[1]


@pytest.mark.parametrize(
    ("arguments", "code", "word"),
    [
        (("revoke", "0123456789ab"), 3, "no database "),
        (("create", "x", "--scope", "root"), 2, "root"),
        (("create", ""), 2, "1 to 100 printable characters"),
        (("create", "a\nb"), 2, "1 to 100 printable characters"),
    ],
)
def test_what_cannot_be_is_refused(run, arguments: tuple[str, ...], code: int, word: str) -> None:  # type: ignore[no-untyped-def]
    ended, shown = run(*arguments)
    assert ended == code
    assert word in " ".join(shown.split())


def test_a_key_that_is_not_there_is_named(run) -> None:  # type: ignore[no-untyped-def]
    run("create", "other")
    ended, shown = run("revoke", "0123456789ab")
    assert (ended, " ".join(shown.split())) == (3, "stiction: no access key '0123456789ab' is stored")


def test_what_is_no_text_is_refused_by_name(run) -> None:  # type: ignore[no-untyped-def]
    run("create", "gripper 7", "--scope", "upload")
    code, text = run("revoke", "\udcff")
    assert code == INPUT_REFUSED
    assert text.endswith("stiction: argument '\\udcff' is not UTF-8; allowed: UTF-8, but in names of files\n")


@pytest.mark.parametrize("told", [("gripper ",), (" gripper",), ("gripper", "--group", "lab ")])
def test_names_have_no_spaces_at_their_ends_that_nobody_sees(run, told: tuple[str, ...]) -> None:  # type: ignore[no-untyped-def]
    code, shown = run("create", *told)
    assert code == 2
    assert "no space at the ends" in " ".join(shown.replace("│", " ").split())
