"""JSON in files and mappings, with what is wrong reported by name."""

import json
from typing import Any

from service.json_objects import RepeatedKey, unique
from slipcore.errors import InvalidInput


def parse(name: str, text: str | bytes, allowed: str = "a JSON object") -> Any:
    """What a ``text`` says that is called ``name``; raises ``InvalidInput``, also where an object has a key twice."""
    try:
        return json.loads(text, object_pairs_hook=unique)
    except RepeatedKey as error:
        raise InvalidInput(name, f"with {error}", "each key of an object once") from error
    except (ValueError, RecursionError) as error:
        raise InvalidInput(name, f"not JSON ({str(error)[:80]})", allowed) from error


def parse_object(name: str, text: str | bytes) -> dict[str, Any]:
    """The same of one object; raises ``InvalidInput`` for anything else."""
    found = parse(name, text)
    if not isinstance(found, dict):
        raise InvalidInput(name, f"JSON of a {type(found).__name__}", "a JSON object")
    return found
