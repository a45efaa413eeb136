"""What a run found, as the tables of page.md."""

from collections.abc import Mapping

from scipy import stats

from benchmarks.mutants.edits import Edit
from benchmarks.mutants.verdicts import Verdict
from benchmarks.pages import table

SCORE = ("package", "lines of code", "drawn", "tried", "killed", "survived, explained", "survived", "score", "95 %")

Verdicts = Mapping[str, Verdict]
Reasons = Mapping[str, str]


def tables(drawn: list[Edit], verdicts: Verdicts, reasons: Reasons, lines: Mapping[str, int]) -> dict[str, str]:
    """Score by package, survivors that are explained, and those that are not."""
    alive = [edit for edit in drawn if edit.key in verdicts and not verdicts[edit.key].is_killed]
    alive.sort(key=lambda edit: (edit.path, edit.start))
    explained = [[_place(edit), _change(edit), reasons[edit.key]] for edit in alive if edit.key in reasons]
    others = [[_place(edit), _change(edit)] for edit in alive if edit.key not in reasons]
    return {
        "score": score(drawn, verdicts, reasons, lines),
        "explained": table(("where", "change", "why no test should notice"), explained),
        "survivors": table(("where", "change"), others),
    }


def score(drawn: list[Edit], verdicts: Verdicts, reasons: Reasons, lines: Mapping[str, int]) -> str:
    """Of each package, and of all, how many mutants were killed of those that could be."""
    rows = []
    for package, size in [*lines.items(), ("all", sum(lines.values()))]:
        own = [edit for edit in drawn if package == "all" or edit.path.startswith(f"{package}/")]
        tried = [edit for edit in own if edit.key in verdicts]
        killed = sum(verdicts[edit.key].is_killed for edit in tried)
        explained = sum(edit.key in reasons and not verdicts[edit.key].is_killed for edit in tried)
        possible = len(tried) - explained
        shares = _share(killed, possible) if possible else ("–", "–")
        rows.append((package, size, len(own), len(tried), killed, explained, possible - killed, *shares))
    return table(SCORE, rows)


def _share(killed: int, possible: int) -> tuple[str, str]:
    """What part was killed, and in which interval (Wilson's) that of all mutants lies."""
    low, high = stats.binomtest(killed, possible).proportion_ci(method="wilson")
    return f"{killed / possible:.1%}", f"{low:.1%} to {high:.1%}"


def _place(edit: Edit) -> str:
    return f"`{edit.path}`" + (f", `{edit.scope}`" if edit.scope else "")


def _change(edit: Edit) -> str:
    old, new = (" ".join(text.split())[:60] for text in (edit.old, edit.new))
    change = f"`{old}` → `{new}`" if new else f"without `{old}`"
    return f"{change} in `{edit.statement[:100]}`".replace("|", "\\|")
