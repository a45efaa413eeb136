import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from threading import Thread
from typing import Any

import pytest
from sqlalchemy import select, update

import estimators
import slipcore
from db.blobs import BlobStore
from db.database import Database
from db.errors import NotFound
from db.paging import Window
from db.records import AuditFilter, Claim, Job, NewGraspLog
from db.repositories import (
    audit,
    detections,
    friction_models,
    grasp_logs,
    jobs,
    materials,
    materials_of_logs,
    owners,
    runners,
)
from db.tables import JobRow, MaterialRow, SampleSummaryRow
from service.domain.access.principal import Principal
from service.domain.errors import DomainError, InvalidValue, NoModel, NotOwner
from service.domain.materials import curate
from service.domain.planning.look_up import Friction, FrictionQuery, look_up
from service.domain.resources.context import Context
from service.jobs import fit_material, pipeline
from service.settings import Settings
from slipcore import Finding
from tests.service.grasps import another_grasp
from tests.service.remembered import remembering

ANYWHERE = FrictionQuery(0.0, 0.1, None)


class Shop:
    """The stores, and a worker that does jobs at once when it is told to."""

    def __init__(self, database: Database, blobs: BlobStore, contents: list[bytes]) -> None:
        self.database, self.blobs, self.contents = database, blobs, contents
        runner: Any = self
        self.context = Context(Settings(), database, blobs, runner)
        with database.write() as session:
            self.runner_id = runners.add(session, "host:1")

    def wake(self) -> None:
        """The work is done when the test says so."""

    def claim(self) -> Claim | None:
        with self.database.write() as session:
            return jobs.claim(session, self.runner_id)

    def work(self) -> list[Job]:
        done = []
        while claim := self.claim():
            pipeline.run_job(self.database, self.blobs, claim)
            with self.database.read() as session:
                done.append(jobs.get(session, claim.job_id))
        return done

    def ingest(self, material: str, number: int) -> str:
        """A log of the material, with its models fitted."""
        log_id = self.store(material, number)
        assert {(job.status, job.reason) for job in self.work()} == {("done", None)}
        return log_id

    def fit(self, material: str, method: str) -> None:
        """A model of the material by one method more."""
        with self.database.write() as session:
            jobs.add(session, "fit", method, material_id=materials.find_id(session, material))
        assert [job.status for job in self.work()] == ["done"]

    def store(self, material: str, number: int) -> str:
        """A log of the material whose ingest waits."""
        content = self.contents[number]
        with self.database.write() as session:
            try:
                material_id = materials.find_id(session, material)
            except NotFound:
                material_id = materials.create(session, material, "").id
            log = NewGraspLog(self.blobs.put(content), len(content), "npz", "filter", material_id, "s", 82, 2.7, (8, 8))
            log_id = grasp_logs.add(session, log)
            jobs.add(session, "ingest", "auto", material_id=material_id, grasp_log_id=log_id)
        return log_id

    def friction(self, material: str, method: str = "ols") -> Friction:
        return look_up(self.context.models.read(self.database, material, method), ANYWHERE)

    def model(self, material: str, method: str = "ols") -> tuple[int, int, bool]:
        """Version, samples, and whether it is outdated."""
        with self.database.read() as session:
            (found,) = [each for each in materials.get(session, material).models if each.model.method == method]
        return found.version, found.model.n, found.outdated


@pytest.fixture(scope="module", autouse=True)
def numerics_done_once() -> Iterator[None]:
    """Of the three logs that all jobs here are about."""
    functions = ((slipcore, name) for name in ("detect_slip", "collect_friction", "check_log"))
    with remembering(*functions, (estimators, "fit")):
        yield


@pytest.fixture
def shop(database: Database, blobs: BlobStore, content: bytes) -> Shop:
    return Shop(database, blobs, [another_grasp(content, number) for number in range(3)])


def test_only_what_differs_is_changed_and_recorded(database: Database, blobs: BlobStore) -> None:
    context, window = Shop(database, blobs, []).context, Window("id")
    with database.write() as session:
        materials.create(session, "paper", "white")
    for name, description in ((None, None), ("paper", "white"), ("paper", "grey"), ("card", "grey")):
        changed = curate.change(context, "paper", name, description)
        assert (changed.name, changed.description) == (name or "paper", description or "white")
    with database.read() as session:
        told = [entry.details for entry in audit.list_all(session, window, AuditFilter(action="material.changed"))]
    assert told == [{"name": None, "description": "grey"}, {"name": "card", "description": None}]


def test_after_an_upload_cheap_models_are_fitted_again_and_costly_ones_are_outdated(shop: Shop) -> None:
    shop.ingest("paper", 0)
    one = shop.model("paper")[1]
    with shop.database.write() as session:
        for method in ("conjugate", "robust"):
            jobs.add(session, "fit", method, material_id=materials.find_id(session, "paper"))
    shop.work()
    shop.ingest("paper", 1)
    assert shop.model("paper", "ols") == (2, 2 * one, False)
    assert shop.model("paper", "conjugate") == (2, 2 * one, False)
    assert shop.model("paper", "robust") == (1, one, True)
    assert "outdated" in str(shop.friction("paper", "robust").warning)


def test_models_are_outdated_as_soon_as_a_merge_brings_other_logs(shop: Shop) -> None:
    shop.ingest("paper", 0)
    shop.ingest("papre", 1)
    one = shop.model("paper")[1]
    curate.merge(shop.context, "paper", "papre")
    assert shop.model("paper") == (1, one, True)
    shop.work()
    assert shop.model("paper") == (2, 2 * one, False)


def test_a_withdrawn_log_leaves_every_fit_and_comes_back(shop: Shop) -> None:
    good, bad = shop.ingest("paper", 0), shop.ingest("paper", 1)
    shop.fit("paper", "conjugate")
    both = shop.model("paper", "conjugate")[1]
    log, queued = curate.withdraw(shop.context, bad, "wet")
    assert log.withdrawal is not None
    assert log.withdrawal.because == "wet"
    assert [(job.kind, job.method) for job in queued] == [
        ("fit", each) for each in ("conjugate", "hierarchical", "ols")
    ]
    assert shop.model("paper", "conjugate") == (1, both, True)
    assert "outdated" in str(shop.friction("paper").warning)
    assert [job.status for job in shop.work()] == ["done"] * 3
    assert shop.model("paper", "conjugate") == (2, both // 2, False)
    assert shop.model("paper", "ols") == (3, both // 2, False)
    assert "outdated" not in str(shop.friction("paper").warning)

    again, queued = curate.withdraw(shop.context, bad, "wet, and dropped")
    assert again.withdrawal is not None
    assert (again.withdrawal.at, again.withdrawal.because) == (log.withdrawal.at, "wet, and dropped")
    assert queued == []
    back, queued = curate.restore(shop.context, bad)
    assert back.withdrawal is None
    assert len(queued) == len(shop.work()) == 3
    assert shop.model("paper", "ols") == (4, both, False)
    assert curate.restore(shop.context, good)[1] == []


def test_a_fit_that_is_queued_already_is_named_and_not_queued_again(shop: Shop) -> None:
    shop.ingest("paper", 0)
    log = shop.ingest("paper", 1)
    first = [job.id for job in curate.withdraw(shop.context, log, "wet")[1]]
    assert first
    for _ in range(3):
        assert [job.id for job in curate.restore(shop.context, log)[1]] == first
        assert [job.id for job in curate.withdraw(shop.context, log, "wet")[1]] == first
    assert [job.status for job in shop.work()] == ["done"] * len(first)
    begun = [job.id for job in curate.restore(shop.context, log)[1]]
    assert not {*begun} & {*first}  # those are done


@pytest.mark.parametrize("withdrawn_at", ["once it is stored", "while it is detected"])
def test_a_log_that_is_withdrawn_before_its_samples_are_stored_outdates_no_model(
    shop: Shop, monkeypatch: pytest.MonkeyPatch, withdrawn_at: str
) -> None:
    shop.ingest("paper", 0)
    with shop.database.write() as session:
        jobs.add(session, "fit", "robust", material_id=materials.find_id(session, "paper"))
    shop.work()
    before, detect = shop.model("paper", "robust"), slipcore.detect_slip
    log_id = shop.store("paper", 1)

    def withdraw() -> None:
        assert curate.withdraw(shop.context, log_id, "wrong finger")[1] == []

    def withdraw_and_detect(*given: Any, **options: Any) -> Any:
        withdraw()
        return detect(*given, **options)

    if withdrawn_at == "once it is stored":
        withdraw()
        assert shop.model("paper", "robust") == before
    else:
        monkeypatch.setattr(slipcore, "detect_slip", withdraw_and_detect)
    shop.work()
    assert shop.model("paper", "robust") == before
    assert [job.method for job in curate.restore(shop.context, log_id)[1]] == ["hierarchical", "ols", "robust"]


def test_a_surface_that_changed_is_marked_on_its_models_and_recorded_once(
    shop: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    def marked(models: list[Any], logs: list[Any], *_prior: object) -> list[Any]:
        assert len(logs) == len(seen)
        return [replace(model, diagnostics={**model.diagnostics, "surface_change": "lower"}) for model in models]

    seen = [shop.ingest("paper", 0)]
    assert shop.friction("paper").support != "stale"
    monkeypatch.setattr(fit_material, "with_change", marked)
    for number in (1, 2):
        seen.append("")
        shop.ingest("paper", number)
    assert shop.friction("paper").advice.startswith("lower: clean the surface")
    with shop.database.read() as session:
        found = audit.list_all(session, Window("id"), AuditFilter(action="material.surface_changed"))
    assert [(entry.subject, entry.details["change"]) for entry in found] == [("paper", "lower")]


def test_a_doubtful_log_makes_friction_implausible_until_it_is_withdrawn(
    shop: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    doubt = Finding("contact travels", "rolling", "hold it")
    monkeypatch.setattr(slipcore, "check_log", lambda *_: [doubt])
    doubtful = shop.ingest("paper", 1)
    monkeypatch.setattr(slipcore, "check_log", lambda *_: [Finding("no rest", "touch", "begin before it")])
    shop.ingest("paper", 2)
    told = shop.friction("paper")
    assert told.support == "implausible"
    assert told.advice.startswith("1 of 2 logs is doubtful (contact travels): mend")
    curate.withdraw(shop.context, doubtful, "rolled")
    shop.work()
    assert shop.friction("paper").support != "implausible"


def test_an_epoch_begins_with_a_log_and_those_before_stay_as_history(shop: Shop) -> None:
    before, first, last = (shop.ingest("paper", number) for number in range(3))
    all_samples = shop.model("paper")[1]
    material, withdrawn, queued = curate.begin_epoch(shop.context, "paper", "coated", first)
    assert (withdrawn, material.withdrawn_grasp_logs, material.grasp_logs) == (1, 1, 3)
    assert [job.method for job in queued] == ["hierarchical", "ols"]
    assert "outdated" in str(shop.friction("paper").warning)
    assert [job.status for job in shop.work()] == ["done"] * 2
    assert shop.model("paper") == (4, all_samples // 3 * 2, False)
    with shop.database.read() as session:
        told = {log_id: grasp_logs.get(session, log_id).withdrawal for log_id in (before, first, last)}
        (entry,) = audit.list_all(session, Window("id"), AuditFilter(action="material.epoch_begun"))
    assert [each and each.because for each in told.values()] == ["coated", None, None]
    assert (entry.subject, entry.details["withdrawn"], entry.details["first_grasp_log"]) == ("paper", 1, first)

    assert curate.begin_epoch(shop.context, "paper", "coated", first)[1:] == (0, [])  # again: nothing is left to do
    curate.restore(shop.context, before)  # each log can come back
    shop.work()
    assert shop.model("paper")[1] == all_samples


def test_an_epoch_from_now_on_has_a_model_with_its_first_log(shop: Shop) -> None:
    shop.ingest("paper", 0)
    waiting = shop.store("paper", 1)
    material, withdrawn, queued = curate.begin_epoch(shop.context, "paper", "another lot", None)
    assert (withdrawn, material.models, queued) == (2, (), [])
    (done,) = shop.work()
    assert (done.status, done.reason) == ("refused", "no grasp log of this material has friction samples yet")
    with pytest.raises(NoModel):
        shop.friction("paper")
    shop.ingest("paper", 2)
    version, samples, outdated = shop.model("paper")
    with shop.database.read() as session:
        withdrawal = grasp_logs.get(session, waiting).withdrawal
    assert (version, outdated) == (2, False)
    assert samples > 0
    assert withdrawal is not None


def test_an_epoch_begins_with_a_log_of_its_material(shop: Shop) -> None:
    shop.ingest("paper", 0)
    foreign = shop.ingest("felt", 1)
    with pytest.raises(InvalidValue, match=r"first_grasp_log is .*; allowed: a log of paper, or null"):
        curate.begin_epoch(shop.context, "paper", "coated", foreign)
    with shop.database.read() as session:
        assert materials.get(session, "paper").withdrawn_grasp_logs == 0


def test_a_material_without_its_only_log_has_no_model(shop: Shop) -> None:
    log = shop.ingest("paper", 0)
    assert curate.withdraw(shop.context, log, "wrong material")[1] == []
    with pytest.raises(NoModel, match="has no model fitted by 'ols'"):
        shop.friction("paper")
    curate.restore(shop.context, log)
    shop.work()
    assert shop.model("paper")[0] == 2


def test_a_fit_under_way_does_not_bring_a_withdrawn_log_back(shop: Shop, monkeypatch: pytest.MonkeyPatch) -> None:
    shop.ingest("paper", 0)
    bad, fit = shop.ingest("paper", 1), fit_material._fit
    both, withdrawn = shop.model("paper")[1], []

    def withdraw_meanwhile(*given: Any) -> Any:
        model = fit(*given)
        if not withdrawn:
            withdrawn.append(curate.withdraw(shop.context, bad, "late"))
        return model

    with shop.database.write() as session:
        jobs.add(session, "fit", "ols", material_id=materials.find_id(session, "paper"))
    claim = shop.claim()
    assert claim is not None
    monkeypatch.setattr(fit_material, "_fit", withdraw_meanwhile)
    pipeline.run_job(shop.database, shop.blobs, claim)
    assert shop.model("paper") == (3, both // 2, False)


def test_a_fit_under_way_is_of_what_its_material_is_merged_into_though_its_logs_are_copies(
    shop: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("paper", "papre"):
        shop.ingest(name, 0)
    with shop.database.write() as session:
        source = materials.find_id(session, "papre")
        job_id = jobs.add(session, "fit", "conjugate", material_id=source)
    claim, fit, merged = shop.claim(), fit_material._fit, list[object]()
    assert claim is not None

    def merge_meanwhile(*given: Any) -> Any:
        if not merged:
            merged.append(curate.merge(shop.context, "paper", "papre"))
        return fit(*given)

    monkeypatch.setattr(fit_material, "_fit", merge_meanwhile)
    pipeline.run_job(shop.database, shop.blobs, claim)
    assert shop.model("paper", "conjugate")[0] == 1
    with shop.database.read() as session:
        assert jobs.get(session, job_id).status == "done"
        assert friction_models.current_methods(session, [source]) == []


def test_a_merged_material_is_fitted_over_all_its_logs(shop: Shop) -> None:
    shop.ingest("paper", 0)
    shop.ingest("papre", 1)
    shop.fit("papre", "conjugate")
    each = shop.model("paper")[1]
    merged, queued = curate.merge(shop.context, "paper", "papre")
    assert (merged.name, merged.aliases, merged.grasp_logs) == ("paper", ("papre",), 2)
    assert [job.method for job in queued] == ["conjugate", "hierarchical", "ols"]
    assert [job.status for job in shop.work()] == ["done"] * 3
    assert shop.model("papre") == shop.model("paper") == (2, 2 * each, False)
    assert shop.friction("papre", "conjugate").material == "paper"
    with pytest.raises(InvalidValue, match="source is papre; allowed: another material"):
        curate.merge(shop.context, "paper", "papre")


def of_each(shop: Shop, *log_ids: str) -> list[int | None]:
    """The keys of the logs' materials."""
    with shop.database.read() as session:
        return [materials_of_logs.get(session, log_id) for log_id in log_ids]


def cancelled(shop: Shop) -> str:
    """Before anything was found, and its file is deleted as an old upload."""
    log_id = shop.store("paper", 1)
    with shop.database.write() as session:
        log = grasp_logs.get(session, log_id)
        jobs.cancel(session, log.job.id, "nobody wants it")
    shop.blobs.remove([log.sha256])
    return log_id


def waiting(shop: Shop) -> str:
    """Its job comes after the merge."""
    return shop.store("paper", 1)


@pytest.mark.parametrize("without_samples", [cancelled, waiting])
def test_a_log_of_both_counts_once_whichever_of_its_jobs_found_samples(
    shop: Shop, without_samples: Callable[[Shop], str]
) -> None:
    shop.ingest("paper", 0)
    found = shop.ingest("papre", 1)
    each = shop.model("paper")[1]
    own = without_samples(shop)
    paper, papre = before = of_each(shop, own, found)
    with shop.database.read() as session:
        content = grasp_logs.get(session, own).sha256
    curate.merge(shop.context, "paper", "papre")
    assert {job.status for job in shop.work()} == {"done"}
    assert shop.model("paper")[1:] == (2 * each, False)
    assert of_each(shop, own, found) == ([papre, paper] if without_samples is cancelled else before)
    with shop.database.read() as session:
        assert grasp_logs.get(session, own).sha256 == content
        assert friction_models.current_methods(session, [papre]) == []


def test_a_log_counts_whose_job_comes_after_the_merge_where_that_of_its_copy_has_ended(shop: Shop) -> None:
    shop.ingest("paper", 0)
    each = shop.model("paper")[1]
    cancelled(shop)
    later = shop.store("papre", 1)
    curate.merge(shop.context, "paper", "papre")
    assert {job.status for job in shop.work()} == {"done"}
    assert shop.model("paper")[1:] == (2 * each, False)
    with shop.database.read() as session:
        assert materials_of_logs.get(session, later) == materials.find_id(session, "paper")


def test_the_samples_of_a_log_that_is_looked_at_again_come_from_that_look(shop: Shop) -> None:
    """Its copy has those of the time before, by an older description of the sensor, say."""
    shop.ingest("paper", 0)
    each = shop.model("paper")[1]
    own, copy = shop.ingest("paper", 1), shop.ingest("papre", 1)
    with shop.database.write() as session:
        detections.remove(session, own)
        jobs.requeue(session, grasp_logs.get(session, own).job.id)
    before = of_each(shop, own, copy)
    curate.merge(shop.context, "paper", "papre")
    assert {job.status for job in shop.work()} == {"done"}
    assert shop.model("paper")[1:] == (2 * each, False)
    assert of_each(shop, own, copy) == before


def cancel_job(shop: Shop, log_id: str) -> None:
    with shop.database.write() as session:
        jobs.cancel(session, grasp_logs.get(session, log_id).job.id, "nobody wants it")


@pytest.mark.parametrize("is_cancelled_first", [True, False])
def test_a_log_whose_job_is_cancelled_after_a_merge_leaves_its_place_to_its_copy(
    shop: Shop, is_cancelled_first: bool
) -> None:
    shop.ingest("paper", 0)
    each = shop.model("paper")[1]
    own, copy = shop.store("paper", 1), shop.store("papre", 1)
    before = of_each(shop, own, copy)
    curate.merge(shop.context, "paper", "papre")
    if not is_cancelled_first:
        under_way = shop.claim()
        assert {job.status for job in shop.work()} == {"done"}
        assert shop.model("paper")[1] == each
        assert under_way is not None
    cancel_job(shop, own)
    shop.work()
    if not is_cancelled_first:
        assert shop.model("paper")[2]  # says that it lacks them
        shop.fit("paper", "ols")
    assert shop.model("paper")[1:] == (2 * each, False)
    assert of_each(shop, copy, own) == before


@pytest.mark.parametrize("which", [0, 1], ids=["the material's own", "the copy"])
def test_of_two_copies_with_other_samples_the_one_that_was_looked_at_later_counts(shop: Shop, which: int) -> None:
    """Their sensor was described anew between the two."""
    order = [("paper", 1), ("papre", 1)]
    found = {name: shop.ingest(name, number) for name, number in (order[::-1] if which == 0 else order)}
    own, copy = found["paper"], found["papre"]
    first = SampleSummaryRow.grasp_log_id == (copy if which == 0 else own)
    with shop.database.write() as session:
        session.execute(update(SampleSummaryRow).where(first).values(samples_blob="0" * 64))
    before = of_each(shop, own, copy)
    curate.merge(shop.context, "paper", "papre")
    assert of_each(shop, own, copy) == (before if which == 0 else before[::-1])


def test_a_log_whose_last_look_found_nothing_takes_no_earlier_samples_of_its_copy(shop: Shop) -> None:
    shop.ingest("paper", 0)
    each = shop.model("paper")[1]
    copy, own = shop.ingest("papre", 1), shop.ingest("paper", 1)
    before = of_each(shop, own, copy)
    with shop.database.write() as session:
        detections.remove(session, own)
        session.execute(update(JobRow).where(JobRow.grasp_log_id == own).values(status="refused", reason="no slip"))
    curate.merge(shop.context, "paper", "papre")
    assert {job.status for job in shop.work()} == {"done"}
    assert shop.model("paper")[1:] == (each, False)
    assert of_each(shop, own, copy) == before


def test_a_job_that_is_done_again_is_of_the_material_that_its_log_was_merged_into(shop: Shop) -> None:
    shop.ingest("papre", 0)
    each = shop.model("papre")[1]
    with shop.database.write() as session:
        materials.create(session, "paper", "")
    log_id = cancelled(shop)
    curate.merge(shop.context, "papre", "paper")
    shop.work()
    with shop.database.write() as session:
        jobs.requeue(session, grasp_logs.get(session, log_id).job.id)
    shop.blobs.put(shop.contents[1])
    assert {(job.status, job.material) for job in shop.work()} == {("done", "papre")}
    assert shop.model("papre")[1:] == (2 * each, False)


def test_a_log_that_is_looked_at_again_gives_its_material_its_next_models(shop: Shop) -> None:
    log_id = shop.ingest("paper", 0)
    version, samples, _ = shop.model("paper")
    with shop.database.write() as session:
        detections.remove(session, log_id)
        jobs.requeue(session, grasp_logs.get(session, log_id).job.id)
    assert {each.status for each in shop.work()} == {"done"}
    assert shop.model("paper") == (version + 1, samples, False)
    with shop.database.read() as session:
        versions = friction_models.versions(session, materials.find_id(session, "paper"), "ols")
        assert [each.version for each in versions] == [version + 1, version]
        assert sorted(job.kind for job in jobs.list_all(session, Window("created_at"))) == ["fit", "ingest"]


def test_a_copy_that_a_merge_left_behind_is_changed_by_the_owners_of_what_it_is_now(shop: Shop) -> None:
    counting, left_behind = (shop.ingest(name, 0) for name in ("paper", "papre"))
    with shop.database.write() as session:
        of_both = [materials.find_id(session, name) for name in ("paper", "papre")]
        for material_id, owner in zip(of_both, ("group:new", "group:old"), strict=True):
            owners.add(session, material_id, owner)
    curate.merge(shop.context, "paper", "papre")
    shop.work()
    before = shop.model("paper")
    old, new = (Principal(group=name, is_admin=False) for name in ("old", "new"))
    with pytest.raises(NotOwner):
        curate.withdraw(shop.context, left_behind, "mine", old)
    log, queued = curate.withdraw(shop.context, left_behind, "wet", new)
    assert (log.withdrawal is not None, queued) == (True, [])
    assert curate.counts_instead(shop.context, left_behind) == counting
    assert curate.counts_instead(shop.context, counting) is None
    assert curate.restore(shop.context, left_behind, new)[1] == []
    assert shop.model("paper") == before
    with shop.database.read() as session:
        assert friction_models.current_methods(session, [of_both[1]]) == []
    curate.withdraw(shop.context, counting, "wet", new)
    assert curate.counts_instead(shop.context, left_behind) is None


def test_two_merges_against_each_other_leave_one_material(shop: Shop) -> None:
    shop.ingest("a", 0)
    shop.ingest("b", 1)
    ends: list[object] = []

    def merge(target: str, source: str) -> None:
        with closing(Database(shop.database.url)) as own:
            try:
                ends.append(curate.merge(Context(Settings(), own, shop.blobs, shop.context.jobs), target, source))
            except (DomainError, NotFound) as refused:
                ends.append(refused)

    threads = [Thread(target=merge, args=names) for names in (("a", "b"), ("b", "a"))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sum(isinstance(end, tuple) for end in ends) == 1
    with shop.database.read() as session:
        (left,) = materials.list_all(session)
    assert left.grasp_logs == 2
    assert materials_of(shop) == {left.id}


def ingest_the_next(shop: Shop, _log_id: str) -> None:
    claim = shop.claim()
    assert claim is not None
    pipeline.run_job(shop.database, shop.blobs, claim)


def withdraw_it(shop: Shop, log_id: str) -> None:
    curate.withdraw(shop.context, log_id, "wet")


def restore_it(shop: Shop, log_id: str) -> None:
    curate.restore(shop.context, log_id)


def cancel_the_next(shop: Shop, _log_id: str) -> None:
    with shop.database.write() as session:
        (waits,) = jobs.list_all(session, Window("created_at"), "queued")
        jobs.cancel(session, waits.id, "nobody wants it")


def fail_the_next(shop: Shop, _log_id: str) -> None:
    claim = shop.claim()
    assert claim is not None
    with shop.database.write() as session:
        jobs.finish(session, claim, "failed", reason="torn")


@pytest.mark.parametrize("change", [withdraw_it, restore_it, ingest_the_next, cancel_the_next, fail_the_next])
def test_who_changes_a_log_waits_for_a_merge_with_nothing_locked(
    shop: Shop, change: Callable[[Shop, str], None]
) -> None:
    shop.ingest("a", 0)
    log_id = shop.ingest("b", 1)
    if change is restore_it:
        curate.withdraw(shop.context, log_id, "wet")
        shop.work()
    if change in (ingest_the_next, cancel_the_next, fail_the_next):
        shop.store("b", 2)
    ends: list[BaseException | None] = []

    def to_its_end() -> None:
        try:
            change(shop, log_id)
        except Exception as failed:
            ends.append(failed)
        else:
            ends.append(None)

    thread = Thread(target=to_its_end)
    with shop.database.write() as session:
        target, source = (materials.find_id(session, name) for name in ("a", "b"))
        session.execute(select(MaterialRow.id).where(MaterialRow.id.in_((target, source))).with_for_update())
        thread.start()
        thread.join(timeout=0.3)  # it is at the material now, which is ours
        assert thread.is_alive()
        materials.merge(session, target, source)
    thread.join()
    assert ends == [None]
    shop.work()
    counted = 1 if change is withdraw_it else 3 if change is ingest_the_next else 2
    with shop.database.read() as session:
        assert len(detections.samples_of_material(session, target)) == counted


@pytest.mark.parametrize("end", [cancel_the_next, fail_the_next])
def test_who_ends_a_job_waits_for_a_merge_of_what_its_material_was_merged_into(
    shop: Shop, end: Callable[[Shop, str], None]
) -> None:
    for number, name in enumerate(("a", "b")):
        log_id = shop.ingest(name, number)
    with shop.database.write() as session:
        materials.create(session, "c", "")
        jobs.requeue(session, grasp_logs.get(session, log_id).job.id)  # so it ends with samples that it found before
    ends: list[BaseException | None] = []

    def note(step: Callable[[], None]) -> None:
        try:
            step()
        except Exception as failed:
            ends.append(failed)
        else:
            ends.append(None)

    def merge_again() -> None:
        with shop.database.write() as session:
            two = [materials.find_id(session, name) for name in ("c", "a")]
            session.execute(select(MaterialRow.id).where(MaterialRow.id.in_(two)).with_for_update())
            time.sleep(0.3)  # the other one is at this material now
            materials.merge(session, *two)

    threads = [Thread(target=note, args=(step,)) for step in (lambda: end(shop, log_id), merge_again)]
    with shop.database.write() as session:
        two = [materials.find_id(session, name) for name in ("a", "b")]
        session.execute(select(MaterialRow.id).where(MaterialRow.id.in_(two)).with_for_update())
        for thread in threads:
            thread.start()
        threads[0].join(timeout=0.3)  # both wait for us
        assert threads[0].is_alive()
        materials.merge(session, *two)
    for thread in threads:
        thread.join()
    assert ends == [None, None]
    with shop.database.read() as session:
        assert materials_of_logs.get(session, log_id) == materials.find_id(session, "c")


def test_an_epoch_waits_for_who_withdraws_a_log_with_nothing_locked(shop: Shop) -> None:
    log_id = shop.ingest("a", 0)
    ends: list[object] = []

    def begin() -> None:
        ends.append(curate.begin_epoch(shop.context, "a", "wet", None)[1])

    thread = Thread(target=begin)
    with shop.database.write() as session:
        materials_of_logs.hold(session, log_id)
        thread.start()
        thread.join(timeout=0.3)  # it is at the material now, which is ours
        assert thread.is_alive()
        grasp_logs.withdraw(session, log_id, "torn")
    thread.join()
    assert ends == [0]


def materials_of(shop: Shop) -> set[int]:
    with shop.database.read() as session:
        return {materials.find_id(session, name) for name in ("a", "b")}
