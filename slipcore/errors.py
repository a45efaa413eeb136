"""The exceptions of slipcore: one small tree."""


class SlipcoreError(Exception):
    """Whatever slipcore refuses to do."""


class InvalidInput(SlipcoreError, ValueError):
    """An input that cannot be what it claims to be.

    Attributes: ``name`` of the thing, its ``value`` as text, and what is ``allowed``.
    """

    def __init__(self, name: str, value: object, allowed: str) -> None:
        self.name, self.value, self.allowed = name, str(value), allowed
        Exception.__init__(self, name, self.value, allowed)  # all three, so that the error survives pickling

    def __str__(self) -> str:
        return f"{self.name} is {self.value}; allowed: {self.allowed}"


class UnknownScale(SlipcoreError):
    """A log whose lengths are not known in metres was asked for something that needs them."""


class NoForces(SlipcoreError):
    """A log without micro-element forces was asked for something that needs them."""
