"""Names of materials, for the forms that ask for one."""

from db.paging import Window
from db.repositories import materials
from service.domain.context import Context

FIRST_NAMES = Window("name", limit=200)
"""So many are offered; any other may be typed."""


def names(context: Context) -> list[str]:
    """Names of the first materials, in alphabetical order."""
    with context.database.read() as session:
        return [each.name for each in materials.list_all(session, FIRST_NAMES)]
