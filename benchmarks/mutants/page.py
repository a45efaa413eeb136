"""The page that tells what a run found."""

from collections.abc import Mapping

from benchmarks.mutants.edits import Edit
from benchmarks.mutants.verdicts import Verdict

HEAD = """# Mutation testing

A test says something if it fails when the code is wrong. `make mutants` changes the code in one small place at a time
(a comparison, an operator, a sign, a number, a condition, what is returned, a call left out), in a copy of the
repository, and runs the tests that run that place: a mutant is *killed* if one of them fails, or does not end. Mutants
are drawn by a seed, from every package in proportion to its lines of code, compiled kernels included, which are then
compiled anew. A failure counts only if that test passes without the change.

"""

EXPLAINED = """
## Survivors that no test should kill

What they change is no behaviour, or none that is promised. Each was looked at by hand, with its reason in
`benchmarks/mutants/explained.toml`, and is left out of the score.

"""

OTHERS = "\n## Other survivors\n\nMissing checks.\n\n"


def page(
    drawn: list[Edit], verdicts: Mapping[str, Verdict], reasons: Mapping[str, str], packages: Mapping[str, int]
) -> str:
    """Score by package, then every survivor with its reason or without."""
    tried = [edit for edit in drawn if edit.key in verdicts]
    alive = [edit for edit in tried if not verdicts[edit.key].is_killed]
    explained = [edit for edit in alive if edit.key in reasons]
    others = [edit for edit in alive if edit.key not in reasons]
    text = HEAD + score(tried, verdicts, reasons, packages)
    if explained:
        text += EXPLAINED + "".join(f"- {_told(edit)}: {reasons[edit.key]}\n" for edit in _sorted(explained))
    if others:
        text += OTHERS + "".join(f"- {_told(edit)}\n" for edit in _sorted(others))
    return text


def score(
    tried: list[Edit], verdicts: Mapping[str, Verdict], reasons: Mapping[str, str], packages: Mapping[str, int]
) -> str:
    """A table: of each package, and of all, how many were killed of those that could be."""
    lines = [
        "| package | lines of code | mutants | killed | survived, explained | survived | score |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for package, size in [*packages.items(), ("all", sum(packages.values()))]:
        own = [edit for edit in tried if package == "all" or edit.path.startswith(f"{package}/")]
        killed = sum(verdicts[edit.key].is_killed for edit in own)
        explained = sum(edit.key in reasons and not verdicts[edit.key].is_killed for edit in own)
        possible = len(own) - explained
        share = f"{killed / possible:.1%}" if possible else "–"
        lines.append(f"| {package} | {size} | {len(own)} | {killed} | {explained} | {possible - killed} | {share} |")
    return "\n".join(lines) + "\n"


def _sorted(edits: list[Edit]) -> list[Edit]:
    return sorted(edits, key=lambda edit: (edit.path, edit.start))


def _told(edit: Edit) -> str:
    old, new = (" ".join(text.split())[:60] for text in (edit.old, edit.new))
    change = f"`{old}` → `{new}`" if new.strip() else f"without `{old.strip()}`"
    return f"`{edit.path}` {f'`{edit.scope}`' if edit.scope else ''} `{edit.statement[:100]}`: {change}".replace(
        "  ", " "
    )
