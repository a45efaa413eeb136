"""What speaks against a log, or against what was found in it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that makes the friction found in a log doubtful: its ``name`` in docs/checks.md, what was seen, and
    what to do about it.
    """

    name: str
    evidence: str
    remedy: str

    @property
    def code(self) -> str:
        """The ``name``, as the contract of names spells it."""
        return self.name

    @property
    def severity(self) -> str:
        """Always "warning": each makes friction doubtful, none stops an evaluation."""
        return "warning"
