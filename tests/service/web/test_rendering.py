import re
from typing import Any

import pytest

from service.web.assets import all_assets

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


def test_every_page_may_load_only_what_is_ours(browser: Any) -> None:
    for path in ("/", "/login", "/nothing", "/problems", "/docs"):
        answer = browser.get(path)
        policy = answer.headers["content-security-policy"]
        assert "unsafe" not in policy
        assert "http" not in policy
        assert answer.headers["referrer-policy"] == "same-origin"  # else a form would tell no origin
        assert answer.headers["cache-control"] == "no-store"
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert not re.search(r"<style|\sstyle=|<script>|\son\w+=|(src|href)=.(https?:)?//", answer.text)


def test_a_file_may_be_kept_for_ever_under_the_hash_of_its_content(browser: Any) -> None:
    for asset in all_assets().values():
        answer = browser.get(asset.path)
        assert (answer.status_code, answer.content) == (200, asset.content)
        assert "immutable" in answer.headers["cache-control"]
    assert browser.get("/assets/0000000000000000/style.css").status_code == 404


def test_an_unknown_page_is_a_page_for_browsers_only(browser: Any) -> None:
    assert "No such route" in browser.get("/nothing").text
    assert browser.get("/nothing", headers={"accept": "application/json"}).json()["type"] == "/problems/unknown-route"
    assert browser.get("/v1/nothing").headers["content-type"] == "application/problem+json"
