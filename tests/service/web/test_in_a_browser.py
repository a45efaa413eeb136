import shutil
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from db.database import Database
from db.repositories import access_keys
from service.demo import inputs
from service.domain.access import keys
from service.settings import Settings
from slipcore import GraspLog
from stiction_client.stream import SlipStream
from tests.service.web import chromium
from tests.service.web.chromium import Tab

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed: apt-get install chromium")
ON_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)

CONTROLS = "a[href], button:enabled, input:enabled:not([type=hidden]), select, textarea, summary, [tabindex='0']"
SEE_FOCUS = """(() => {
  const focused = document.activeElement;
  focused.seen = getComputedStyle(focused).outlineStyle !== "none";
})()"""
"""Marks the element that has the focus, where that shows."""

INKED = """(() => {{
  const canvas = document.querySelector(".{}"), pixels = canvas.getContext("2d");
  return pixels.getImageData(0, 0, canvas.width, canvas.height).data.some(part => part > 0);
}})()"""
"""Whether anything is drawn on a canvas."""

DROP = """(() => {
  const held = new DataTransfer();
  held.items.add(new File(["no log at all"], "grasp.npz"));
  document.getElementById("upload").dispatchEvent(new DragEvent("drop", {dataTransfer: held, cancelable: true}));
  document.querySelector("#upload button[type=submit]").click();
})()"""


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with chromium.running(tmp_path_factory.mktemp("browser")) as tab:
        yield tab


@pytest.fixture
def page(tab: Tab, client: httpx.Client) -> Iterator[Tab]:
    """A page that makes no error and asks nobody but the service."""
    tab.errors.clear()
    tab.requests.clear()
    yield tab
    assert tab.errors == []
    assert [url for url in tab.requests if not url.startswith((str(client.base_url), "about:", "blob:", "data:"))] == []


def fits(tab: Tab) -> bool:
    """Whether nothing reaches beyond the right edge: a phone's browser widens its window for what does."""
    return bool(tab.run("document.documentElement.scrollWidth") <= tab.width)


@ON_SQLITE
@pytest.mark.parametrize("width", [1400, 390])
def test_from_an_upload_to_a_grip_force(
    page: Tab, client: httpx.Client, content: bytes, tmp_path: Path, width: int
) -> None:
    base = str(client.base_url).rstrip("/")
    file = tmp_path / "grasp.npz"
    file.write_bytes(content)
    page.resize(width)
    page.go(f"{base}/upload")
    page.run(f"material.value = 'browsed {width}'; document.querySelector('[name=create]').checked = true")
    page.choose("#file", file)
    page.run("document.querySelector('#upload button[type=submit]').click()")
    page.until("location.pathname.startsWith('/logs/')")
    page.until("document.querySelector('.player[data-ready]') !== null")  # the page has renewed itself meanwhile
    assert fits(page)

    page.run("document.querySelector('.map').focus()")
    page.press("Home")
    assert page.run("document.querySelector('.now').textContent").startswith("frame 1 of 82 · ")
    page.press("ArrowRight")
    assert page.run("document.querySelector('.now').textContent").startswith("frame 2 of 82 · ")
    page.press(" ")
    page.until("!document.querySelector('.now').textContent.startsWith('frame 2 of')")  # it plays
    page.press("End")
    assert "stick ratio" in page.run("document.querySelector('.now').textContent")
    assert page.run("document.querySelector('.play').textContent") == "Play"

    page.run("document.querySelector('main a[href^=\"/materials/\"]').click()")
    page.until("document.querySelectorAll('main > .charts svg polyline').length === 2")
    assert fits(page)
    page.run("document.querySelector('main a[href^=\"/plan\"]').click()")
    page.until("location.pathname === '/plan' && document.readyState === 'complete'")
    page.run("tangential_load.value = '1.5'; contact_area.value = '6e-5'; document.querySelector('main form').submit()")
    assert page.until("document.querySelector('.answer')?.textContent").endswith("N of each finger")
    assert page.run("document.querySelectorAll('.chart .point').length") == 1
    assert fits(page)
    for path in ("/", "/jobs", "/sensors", "/sensors/half-space", "/keys", "/audit", "/problems", "/login"):
        page.go(f"{base}{path}")
        assert fits(page), path


@ON_SQLITE
@pytest.mark.parametrize("width", [1400, 390])
def test_samples_are_drawn_and_turned_by_keys_and_buttons(
    page: Tab, client: httpx.Client, fitted: Any, width: int
) -> None:
    page.resize(width)
    page.go(f"{str(client.base_url).rstrip('/')}/materials/{fitted['material']}")
    page.until("document.querySelector('.samples[data-ready]') !== null")
    assert " samples of 1 log · " in page.run("document.querySelector('.samples .now').textContent")
    for canvas in ("space", "places", "times"):
        assert page.run(INKED.format(canvas)), canvas
    before = page.run("document.querySelector('.space').toDataURL()")
    page.run("document.querySelector('.space').focus()")
    page.press("ArrowRight")
    assert page.run("document.querySelector('.space').toDataURL()") != before
    page.press("Home")
    assert page.run("document.querySelector('.space').toDataURL()") == before
    page.run("document.querySelector('[data-view=force]').click()")
    assert page.run("document.querySelector('.space').toDataURL()") != before
    assert fits(page)
    page.run("[...document.querySelector('.charts').children].slice(1).forEach(each => each.remove())")
    assert page.run("document.querySelector('.charts .chart').getBoundingClientRect().width") < 800, "blown up alone"


@ON_SQLITE
@pytest.mark.parametrize(("width", "scheme"), [(1400, "light"), (390, "dark")])
def test_nobody_is_kept_out_of_a_page(page: Tab, client: httpx.Client, fitted: Any, width: int, scheme: str) -> None:
    base = str(client.base_url).rstrip("/")
    asked = "material=fitted&tangential_load=1.5&contact_area=6e-5"
    log, material = f"/logs/{fitted['id']}", f"/materials/{fitted['material']}"
    paths = ["/", "/?search=nothing", material, log, "/upload", "/jobs", "/sensors", "/sensors/half-space", "/plan"]
    paths += ["/live", f"/compare?material={fitted['material']}&fn=0.05"]
    paths += [f"/plan?{asked}", "/keys", "/audit", "/problems", "/login", f"{material}/report", f"{log}/report"]
    page.resize(width)
    page.prefer(scheme)
    found = {}
    for path in paths:
        page.go(f"{base}{path}")
        page.run("document.querySelectorAll('details').forEach(each => each.open = true)")
        if path in (log, material):
            page.until("document.querySelector('[data-ready]') !== null")
        if barriers := page.barriers():
            found[path] = barriers
        assert fits(page), path
    page.prefer("light")
    assert found == {}


@ON_SQLITE
@pytest.mark.parametrize("path", ["/", "/logs/{id}", "/materials/{material}", "/upload", "/plan", "/logs/{id}/report"])
def test_the_tab_key_reaches_every_control_and_shows_where_it_is(
    page: Tab, client: httpx.Client, fitted: Any, path: str
) -> None:
    page.resize(1400)
    page.go(f"{str(client.base_url).rstrip('/')}{path.format(**fitted)}")
    page.run("document.querySelectorAll('details').forEach(each => each.open = true)")
    if path in ("/logs/{id}", "/materials/{material}"):
        page.until("document.querySelector('[data-ready]') !== null")
    controls = page.run(f"document.querySelectorAll({CONTROLS!r}).length")
    assert controls
    for _ in range(2 * controls):  # a browser may also stop at what scrolls
        page.press("Tab")
        page.run(SEE_FOCUS)
    assert page.run(f"[...document.querySelectorAll({CONTROLS!r})].filter(e => !e.seen).map(e => e.outerHTML)") == []


@ON_SQLITE
def test_a_field_without_a_label_is_found(page: Tab, client: httpx.Client) -> None:
    page.go(f"{str(client.base_url).rstrip('/')}/upload")
    page.run("document.querySelectorAll('label').forEach(each => each.remove())")
    barriers = page.barriers()
    assert [each for each in barriers if each.startswith("label (critical): <input")]


@ON_SQLITE
@pytest.mark.parametrize(("width", "scheme"), [(1400, "light"), (390, "dark")])
def test_a_live_stream_is_watched_until_it_is_a_log(
    page: Tab, client: httpx.Client, ramp: GraspLog, material: str, width: int, scheme: str
) -> None:
    assert ramp.force is not None
    base = str(client.base_url).rstrip("/")
    page.resize(width)
    page.prefer(scheme)
    with SlipStream(base, ramp.position, ramp.element_area, sensor="left finger", material=material, keep=True) as live:
        page.go(f"{base}/live")
        page.run(f"document.querySelector('a[href=\"/live/{live.session}\"]').click()")
        page.until("document.querySelector('.player') !== null && document.readyState === 'complete'")
        watchers = "fetch('/live').then(a => a.text()).then(t => />1<\\/td>\\s*<\\/tr>/.test(t))"
        page.until(watchers)
        for k, time in enumerate(ramp.time):
            live.step(time, ramp.displacement[k], ramp.force[k], command=1.25)
        page.until("document.querySelector('.player').dataset.frame >= 0")  # how many are shown is a matter of time
        told = page.run("document.querySelector('.player').innerText")
        assert "1.25 N" in told
        assert fits(page)
        assert page.barriers() == []
        stored = live.finish(store=True)
    assert stored is not None
    assert page.until("document.querySelector('.connection a')?.pathname") == f"/logs/{stored['id']}"
    assert page.run("document.querySelector('.connection').textContent") == "The stream has ended. Its grasp log"
    page.prefer("light")


@ON_SQLITE
def test_the_api_is_described_without_a_network(page: Tab, client: httpx.Client) -> None:
    base = str(client.base_url).rstrip("/")
    page.go(f"{base}/docs")
    page.until("document.querySelectorAll('.opblock').length > 20")
    page.call("Page.navigate", url=f"{base}/redoc")
    assert page.until("location.pathname === '/docs'")
    loaded = page.run("performance.getEntriesByType('resource').map(each => new URL(each.name).origin).join(' ')")
    assert set(loaded.split()) == {base}


@ON_SQLITE
@pytest.mark.parametrize(("width", "scheme"), [(1400, "light"), (390, "dark")])
def test_nobody_is_kept_out_of_the_api_and_of_a_page_that_is_not_there(
    tab: Tab, client: httpx.Client, width: int, scheme: str
) -> None:
    base = str(client.base_url).rstrip("/")
    tab.resize(width)
    tab.prefer(scheme)
    tab.go(f"{base}/docs")
    tab.until("document.querySelectorAll('.opblock').length > 20")
    assert tab.run("document.documentElement.matches('.dark-mode')") == (scheme == "dark")
    assert [each for each in tab.barriers() if not each.startswith("heading-order (moderate)")] == []
    assert fits(tab)
    for path in ("/nothing", "/live/ended", "/materials/unknown"):
        tab.go(f"{base}{path}")
        assert tab.run("document.querySelector('.problem') !== null"), path
        assert tab.barriers() == []
        assert fits(tab), path
    tab.prefer("light")


@ON_SQLITE
def test_a_bad_file_that_is_dropped_is_refused_above_the_form(tab: Tab, client: httpx.Client) -> None:
    tab.go(f"{str(client.base_url).rstrip('/')}/upload")
    tab.run("sensor.value = 'kept'")
    tab.run(DROP)
    told = tab.until("document.querySelector('#result .problem')?.innerText")
    assert "The format is not supported" in told
    assert tab.run("[location.pathname, sensor.value].join()") == "/upload,kept"
    assert tab.run("document.querySelector('#upload details').open")


@ON_SQLITE
def test_what_somebody_typed_runs_nothing(page: Tab, client: httpx.Client, material: str) -> None:
    typed = f"<img src=x onerror=document.title='run'>, \u202eשלום, {'🧤' * 50}"
    client.patch(f"/v1/materials/{material}", json={"description": typed}).raise_for_status()
    page.go(f"{str(client.base_url).rstrip('/')}/materials/{material.replace(' ', '%20')}")
    assert typed in page.run("document.querySelector('main').textContent")
    assert page.run("document.title").startswith(material)


def test_a_key_logs_in_loads_simulated_grasps_and_logs_out(
    tab: Tab, serving: Any, tmp_path: Path, sqlite_template: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inputs, "FRICTION", {"rubber": 0.8})
    monkeypatch.setattr(inputs, "NORMAL_FORCES", (4.0,))
    settings = Settings(data_folder=tmp_path, access="keys", workers=0)
    shutil.copyfile(sqlite_template, tmp_path / sqlite_template.name)
    key_id, text = keys.new_key()
    with closing(Database(settings.resolved_database_url)) as database, database.write() as session:
        access_keys.add(session, key_id, "robot", "upload", keys.digest(text))
    with serving(settings) as client:
        base = str(client.base_url).rstrip("/")
        tab.call("Page.navigate", url=f"{base}/jobs")
        tab.until("location.pathname === '/login' && document.readyState === 'complete'")
        assert tab.barriers() == []
        tab.run(f"key.value = '{text}'; document.querySelector('main form').submit()")
        tab.until("location.pathname === '/jobs' && document.readyState === 'complete'")
        assert tab.run("document.cookie") == ""  # no script reads it
        tab.resize(390)
        tab.go(f"{base}/")
        assert "Nothing is stored here yet" in tab.run("document.body.innerText")
        assert fits(tab)
        assert tab.barriers() == []
        tab.run("document.querySelector('[action=\"/practice\"] button').click()")
        tab.until("location.pathname === '/jobs' && document.readyState === 'complete'")
        assert "simulated rubber" in tab.run("document.querySelector('main').innerText")
        assert fits(tab)
        tab.run("document.querySelector('.session button').click()")
        tab.until("location.pathname === '/login' && document.readyState === 'complete'")
        tab.call("Page.navigate", url=f"{base}/jobs")
        tab.until("location.pathname === '/login' && location.search.includes('jobs')")


@ON_SQLITE
@pytest.mark.parametrize("width", [1400, 390])
def test_a_long_name_without_a_space_widens_no_page(
    page: Tab, client: httpx.Client, content: bytes, upload: Any, wait: Any, width: int
) -> None:
    name, base = f"{width}".ljust(100, "W"), str(client.base_url).rstrip("/")
    client.post("/v1/materials", json={"name": name}).raise_for_status()
    accepted = upload(client, content, material=name)
    wait(client, accepted.json()["job"]["id"])
    log = client.get(accepted.headers["location"]).json()
    page.resize(width)
    paths = ("/", "/jobs", f"/materials/{name}", f"/logs/{log['id']}", f"/sensors/{log['sensor']}", "/audit")
    for path in (*paths, f"/compare?material={name}", f"/plan?material={name}&tangential_load=1&contact_area=6e-5"):
        page.go(f"{base}{path}")
        assert fits(page), path
