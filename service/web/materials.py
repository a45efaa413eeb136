"""Names of materials, for the forms that ask for one."""

from db.repositories import materials
from service.domain.resources.context import Context

FIRST_NAMES = 200
"""So many are offered; any other may be typed."""


def names(context: Context) -> list[str]:
    """Names of the first materials, in alphabetical order."""
    with context.database.read() as session:
        return materials.first_names(session, FIRST_NAMES)
