"""Style and scripts of the pages: what is served under which address."""

import asyncio
import hashlib
from pathlib import Path

import pytest
from starlette.exceptions import HTTPException

from service.web import assets
from service.web.routes.assets import read_asset
from service.web.routes.login import _own_path

STATIC = Path(assets.__file__).parent / "static"


def test_an_address_changes_with_the_content_of_its_file() -> None:
    found = assets.find_asset("style.css")
    assert found is not None
    content = (STATIC / "style.css").read_bytes()
    digest = hashlib.blake2b(content, digest_size=8).hexdigest()
    assert (found.content, found.content_type, found.digest) == (content, "text/css; charset=utf-8", digest)
    assert found.path == assets.path_of("style.css") == f"/assets/{digest}/style.css"


def test_every_file_has_its_type_and_swagger_ui_its_two() -> None:
    assert set(assets.all_assets()) == {path.name for path in STATIC.iterdir()}
    assert {assets.find_asset(name).content_type for name in assets.SWAGGER_UI} == {  # type: ignore[union-attr]
        "text/javascript; charset=utf-8",
        "text/css; charset=utf-8",
    }
    assert assets.find_asset("none.css") is None
    with pytest.raises(LookupError, match=r"there is no file none\.css among the style and scripts"):
        assets.path_of("none.css")


def test_a_file_is_kept_for_ever_and_only_under_its_own_address() -> None:
    found = assets.find_asset("style.css")
    assert found is not None
    answer = asyncio.run(read_asset(found.digest, "style.css"))
    assert (answer.status_code, answer.body) == (200, found.content)
    assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"
    for digest, name in (("0" * 16, "style.css"), (found.digest, "none.css")):
        with pytest.raises(HTTPException, match="there is no such file") as refusal:
            asyncio.run(read_asset(digest, name))
        assert refusal.value.status_code == 404


@pytest.mark.parametrize(
    ("path", "leads_to"),
    [
        ("/", "/"),
        ("/materials/paper?x=1", "/materials/paper?x=1"),
        ("//evil.example", "/"),
        ("/\\evil.example", "/"),
        ("https://evil.example", "/"),
        ("materials", "/"),
        ("", "/"),
        ("/a\nb", "/"),
    ],
)
def test_a_login_leads_on_to_pages_of_this_service_alone(path: str, leads_to: str) -> None:
    assert _own_path(path) == leads_to
