"""JSON in files and mappings, with what is wrong reported by name."""

import json
from typing import Any

from service.json_objects import RepeatedKey, unique
from slipcore.errors import InvalidInput

ONE_OBJECT = "a JSON object"


def parse(name: str, text: str | bytes, allowed: str = ONE_OBJECT) -> Any:
    """What a ``text`` says that is called ``name``; raises ``InvalidInput``, also where an object has a key twice."""
    try:
        return json.loads(text, object_pairs_hook=unique)
    except RepeatedKey as error:
        raise InvalidInput(name, f"with {error}", "each key of an object once") from error
    except (ValueError, RecursionError) as error:
        raise InvalidInput(name, f"not JSON ({str(error)[:80]})", allowed) from error


def parse_object(name: str, text: str | bytes, allowed: str = ONE_OBJECT) -> dict[str, Any]:
    """The same of one object; raises ``InvalidInput`` for anything else."""
    found = parse(name, text, allowed)
    if not isinstance(found, dict):
        raise InvalidInput(name, f"JSON of a {type(found).__name__}", allowed)
    return found
