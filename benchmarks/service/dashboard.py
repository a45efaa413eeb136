"""The dashboard of a full database and its player: `python -m benchmarks.service.dashboard [--page docs/dashboard.md]`.

A service takes in three grasps of one material; its rows are then multiplied, with the moments and models that it
stored, to 1,000 materials and 100,000 logs, each with its job, detection, samples, version of a model and entry in the
audit trail. One material has 600 of them. Each page is asked for alone: milliseconds to its answer, and CPU time of the
server, which has one core. Then Debian's Chromium opens the player of a log of 2,000 frames of 20×20 elements:
seconds until it can be used, the first time and again, and, while it is scrubbed as fast as the browser draws, the
time between frames and that which the script takes for one. Writes dashboard.json and dashboard-full.png.
"""

import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from matplotlib.figure import Figure
from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from benchmarks.pages import options, picture_folder, save, table, write
from benchmarks.service.__main__ import grasp, ready
from benchmarks.service.http_load import cpu_seconds, leave_first_core, pin
from db.database import Database
from db.tables import (
    AuditEntryRow,
    Base,
    DetectionRow,
    FrictionModelRow,
    GraspLogRow,
    JobRow,
    MaterialNameRow,
    MaterialRow,
    SampleSummaryRow,
    SensorRow,
)
from service.settings import Settings
from slipcore import GraspLog
from slipcore.contact import RampSchedule, tangential_ramp
from stiction_client import FrictionClient
from tests.service.web import chromium
from tests.service.web.chromium import Tab

MATERIALS, LOGS, SENSORS = 1_000, 100_000, 20
OF_THE_FIRST = 500
"""Logs that the first material has beside its part of the others."""

WITHDRAWN, REFUSED = 53, 37
"""Every so manieth log is withdrawn, and every so manieth has no samples."""

EVERY = timedelta(minutes=5)
"""Between two logs; the newest comes now."""

AT_ONCE = 2_000
"""Rows of each table in one statement."""

ROUNDS = 20
ASKED_MS, ASKED_READY_S, ASKED_FRAMES = 200.0, 2.0, 30.0
SCRUBBED = 300
"""Frames that are shown in each run of the player."""

LONG = RampSchedule(rest=3.0, press=10.0, settle=4.0, shear=40.0, hold=9.65)

FIRST = "multiplied"
"""The material that the service itself takes in."""

LOOKS = ((1400, ""), (1400, "displacement"), (390, "displacement"))
"""Widths of the browser in CSS pixels, and arrows that are drawn in each element."""

Row = dict[str, Any]

WATCH = """new MutationObserver((_, watcher) => {
  if (document.querySelector(".player[data-ready]") === null) return;
  window.readyAfter = performance.now();
  watcher.disconnect();
}).observe(document, {attributes: true, childList: true, subtree: true});"""
"""Notes when the player can be used, in ms since the page was asked for."""

SCRUB = """(async () => {{
  const slider = document.querySelector(".player input"), moments = [], work = [];
  for (let k = 0; k <= {count}; k += 1) {{
    const began = performance.now();
    slider.value = String((k * 7) % (Number(slider.max) + 1));
    slider.dispatchEvent(new Event("input"));
    work.push(performance.now() - began);
    moments.push(await new Promise(requestAnimationFrame));
  }}
  return [moments.slice(1).map((moment, k) => moment - moments[k]), work.slice(1)];
}})()"""
"""Moves the slider once in each frame that the browser draws; ms between these, and ms of the script in each."""


@dataclass(frozen=True, slots=True)
class PageTime:
    """Seconds to the answer of a page, the median and the longest of some, CPU seconds of the server, and its bytes."""

    what: str
    path: str
    median: float
    longest: float
    cpu: float
    size: int


@dataclass(frozen=True, slots=True)
class Player:
    """Seconds until the player can be used, the first time and again; milliseconds between frames while it is scrubbed,
    and of its script in each.
    """

    width: int
    arrows: str
    first: float
    again: float
    between: list[float]
    work: list[float]


@dataclass(frozen=True, slots=True)
class Template:
    """Rows of a log that the service took in, without their own times: what the copies of it are made of."""

    log: Row
    job: Row
    detection: Row
    samples: Row


def multiply(session: Session, materials: int, logs: int) -> None:
    """Make so many materials and logs of the rows of a material and its logs."""
    names = [f"material {k:04}" for k in range(materials)]
    session.execute(insert(MaterialRow), [{"name": name, "description": "multiplied"} for name in names])
    session.execute(insert(SensorRow), [{"name": f"sensor {k:02}"} for k in range(SENSORS)])
    ids = dict(session.execute(select(MaterialRow.name, MaterialRow.id)).tuples().all())
    session.execute(insert(MaterialNameRow), [{"name": name, "material_id": ids[name]} for name in names])
    sensors = session.scalars(select(SensorRow.id).where(SensorRow.name.like("sensor __"))).all()
    copies = Copies(_templates(session), _models(session), [ids[name] for name in names], sensors, logs)
    for first in range(0, logs, AT_ONCE):
        made = [copies.of(number) for number in range(first, min(first + AT_ONCE, logs))]
        for kind in (GraspLogRow, JobRow, DetectionRow, SampleSummaryRow, FrictionModelRow, AuditEntryRow):
            rows = [row for each in made for row in each.get(kind, ())]
            session.execute(insert(kind), rows)


def _templates(session: Session) -> list[Template]:
    kinds = (DetectionRow, SampleSummaryRow)
    return [
        Template(
            _row(log),
            _row(session.scalars(select(JobRow).where(JobRow.grasp_log_id == log.id)).one()),
            *(_row(session.get_one(kind, log.id)) for kind in kinds),
        )
        for log in session.scalars(select(GraspLogRow)).all()
    ]


def _models(session: Session) -> list[Row]:
    current = session.scalars(select(FrictionModelRow).where(FrictionModelRow.current)).all()
    return [{name: value for name, value in _row(model).items() if name != "id"} for model in current]


def _row(row: Base) -> Row:
    return {column.key: getattr(row, column.key) for column in row.__table__.columns if column.key != "created_at"}


@dataclass(slots=True)
class Copies:
    """Copies of templates by number; the materials take turns, but the first ones of all are the first material's."""

    templates: Sequence[Template]
    models: Sequence[Row]
    materials: Sequence[int]
    sensors: Sequence[int]
    logs: int
    versions: Counter[int] = field(default_factory=Counter)
    now: datetime = field(default_factory=lambda: datetime.now(UTC))

    def of(self, number: int) -> dict[type[Base], list[Row]]:
        """All rows of one more log, by table."""
        template = self.templates[number % len(self.templates)]
        material = self.materials[0 if number < OF_THE_FIRST else number % len(self.materials)]
        key, at = f"{number:032x}", self.now - (self.logs - number) * EVERY
        is_last = number >= self.logs - len(self.materials)
        is_refused = number % REFUSED == 0 and not is_last
        mine = {"grasp_log_id": key, "created_at": at}
        log = {"id": key, "sha256": f"{number:064x}", "material_id": material, "file_state": "gone", "created_at": at}
        log |= {"sensor_id": self.sensors[number % len(self.sensors)]}
        if number % WITHDRAWN == 0:
            log |= {"withdrawn_at": at, "withdrawn_because": "multiplied"}
        job = {"id": key, "material_id": material, "finished_at": at, **mine}
        job |= {"status": "refused", "reason": "the log has no slip"} if is_refused else {}
        entry = {"at": at, "actor": "anybody", "action": "grasp_log.uploaded", "subject": key, "details": {}}
        rows = {GraspLogRow: [template.log | log], JobRow: [template.job | job], AuditEntryRow: [entry]}
        if not is_refused:
            self.versions[material] += 1
            model = {"material_id": material, "job_id": key, "version": self.versions[material], "created_at": at}
            rows |= {DetectionRow: [template.detection | mine], SampleSummaryRow: [template.samples | mine]}
            rows |= {FrictionModelRow: [each | model | {"current": is_last} for each in self.models]}
        return rows


def fill(folder: Path) -> None:
    """Let a service take a few grasps in, and multiply what it has of them then."""
    with ready(folder) as (url, _, _), FrictionClient(url) as client:
        client.ensure_material(FIRST)
        for seed in range(3):
            client.wait(client.upload(grasp(seed), material=FIRST))
        client.wait(client.fit(FIRST, method="hierarchical"))
    with closing(Database(Settings(data_folder=folder).resolved_database_url)) as database, database.write() as session:
        multiply(session, MATERIALS, LOGS)


def wait_until_idle(process: int) -> None:
    """Until a server that has begun does nothing by itself any more."""
    before = -1.0
    while (now := cpu_seconds(process)) > before + 0.02:
        before = now
        time.sleep(1.0)


def time_pages(url: str, process: int) -> list[PageTime]:
    """Each page alone, after one that is not counted."""
    newest = f"{LOGS - 1:032x}"
    pages = {
        "materials, the first page": "/",
        "materials, the newest first": "/?sort=-created_at",
        "materials, found by name": "/?search=al+09",
        "materials, at 0.05 N": "/?fn=0.05",
        f"a material of {LOGS // MATERIALS} logs": "/materials/material%200500",
        f"a material of {LOGS // MATERIALS + OF_THE_FIRST} logs": "/materials/material%200000",
        "a log": f"/logs/{newest}",
        "jobs": "/jobs",
        "jobs that were refused": "/jobs?status=refused",
        "sensors": "/sensors",
        f"a sensor of {LOGS // SENSORS:,} logs": "/sensors/sensor%2007",
        "grip force": "/plan",
        "upload": "/upload",
        "audit": "/audit",
        "newest logs, by REST": "/v1/grasp-logs",
    }
    with httpx.Client(base_url=url, timeout=60.0) as client:
        return [_time_page(client, process, what, path) for what, path in pages.items()]


def _time_page(client: httpx.Client, process: int, what: str, path: str) -> PageTime:
    size = len(client.get(path).raise_for_status().content)
    before, taken = cpu_seconds(process), []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        client.get(path)
        taken.append(time.perf_counter() - begin)
    cpu = (cpu_seconds(process) - before) / ROUNDS
    return PageTime(what, path, float(np.median(taken)), max(taken), cpu, size)


def try_player(tab: Tab, url: str, log: str, width: int, arrows: str) -> Player:
    """Open the player of a log twice, and scrub it with arrows of this kind."""
    tab.resize(width)
    tab.call("Network.clearBrowserCache")
    first, again = (_ready_after(tab, f"{url}/logs/{log}") for _ in range(2))
    tab.run(f"arrows.value = '{arrows}'; arrows.dispatchEvent(new Event('change'))")
    between, work = tab.run(SCRUB.format(count=SCRUBBED))
    return Player(width, arrows, first, again, between, work)


def _ready_after(tab: Tab, page: str) -> float:
    tab.go("about:blank")
    tab.go(page)
    return 1e-3 * float(tab.until("window.readyAfter"))


def measure() -> tuple[list[PageTime], list[Player]]:
    """Fill a database, ask for each page, and open the player of a long log; without Chromium, none."""
    with tempfile.TemporaryDirectory() as folder:
        fill(Path(folder))
        with ready(Path(folder)) as (url, _, process):
            pin(process)
            wait_until_idle(process)
            pages = time_pages(url, process)
            if chromium.PROGRAM is None:
                return pages, []
            with FrictionClient(url) as client, tempfile.TemporaryDirectory() as profile:
                found = client.upload(long_log(), material=FIRST)
                client.wait(found)
                with chromium.running(Path(profile)) as tab:
                    tab.call("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
                    return pages, [try_player(tab, url, found.id, *look) for look in LOOKS]


def long_log() -> GraspLog:
    """2,000 frames of 20×20 elements with forces."""
    log = tangential_ramp(points=20, schedule=LONG, marker_noise=1e-6, force_noise=2e-3)
    assert len(log) == 2000, len(log)
    return replace(log, normal=None, truth=None)


def draw(pages: list[PageTime], players: list[Player]) -> Figure:
    """Milliseconds of each page, and between the frames of the player."""
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    place = np.arange(len(pages))[::-1]
    left.barh(place, [1e3 * page.longest for page in pages], color="C0", alpha=0.35, label=f"longest of {ROUNDS}")
    left.barh(place, [1e3 * page.median for page in pages], color="C0", label="median")
    left.axvline(ASKED_MS, color="C3", linestyle="--", label="asked of the first page")
    left.set_yticks(place, [page.what for page in pages], fontsize=8)
    left.set(xlabel="to the answer, ms", title=f"{MATERIALS:,} materials, {LOGS:,} logs")
    left.legend(fontsize=8)
    for player in players:
        shares = np.linspace(0.0, 100.0, len(player.work))
        right.plot(np.sort(player.work), shares, label=_look(player))
    right.axvline(1e3 / ASKED_FRAMES, color="C3", linestyle="--", label=f"asked: {ASKED_FRAMES:g} frames/s")
    right.set(xlabel="of the script for a frame, ms", ylabel="of the frames, %", title="2,000 frames of 20×20")
    right.set_xlim(0.0)
    right.legend(fontsize=8)
    return figure


def _look(player: Player) -> str:
    return f"{player.width} px" + (f", arrows of {player.arrows}" if player.arrows else "")


def tables(pages: list[PageTime], players: list[Player]) -> dict[str, str]:
    """The same as Markdown."""
    columns = ("page", "median, ms", f"longest of {ROUNDS}, ms", "CPU of the server, ms", "kB")
    rows = [(p.what, *(1e3 * t for t in (p.median, p.longest, p.cpu)), round(p.size / 1e3)) for p in pages]
    looks = ("player", "ready the first time, s", "again, s", "frames/s", "of 100 frames the 99th, ms", "script, ms")
    runs = [
        (_look(p), p.first, p.again, 1e3 / np.mean(p.between), np.percentile(p.between, 99), np.median(p.work))
        for p in players
    ]
    return {"pages of a full database": table(columns, rows), "player": table(looks, runs)}


def main() -> None:
    """Measure, print, write."""
    arguments = options(__doc__).parse_args()
    pictures = picture_folder(arguments)
    leave_first_core()
    pages, players = measure()
    made = tables(pages, players)
    print("\n\n".join(made.values()))
    save(draw(pages, players), pictures / "dashboard-full.png")
    numbers = {"pages": [asdict(page) for page in pages], "players": [asdict(player) for player in players]}
    write(numbers, made, arguments, "dashboard.json")


if __name__ == "__main__":
    main()
