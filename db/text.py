"""Text that a database can hold."""


def is_storable(text: str) -> bool:
    """Whether every database takes it: PostgreSQL has no NUL in text, and UTF-8 no lone surrogates."""
    return "\0" not in text and not any("\ud800" <= letter <= "\udfff" for letter in text)
