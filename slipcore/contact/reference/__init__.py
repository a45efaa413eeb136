"""Closed forms of contact mechanics, as importable code: what the numerical solver is tested against.

One module a problem: ``hertz``, ``cattaneo_mindlin``; ``elastic_pair`` has the compliances that they take.
"""

from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.elastic_pair import RIGID, Compliance, elastic_pair, half_space
from slipcore.contact.reference.hertz import HertzContact

__all__ = ["RIGID", "CattaneoMindlin", "Compliance", "HertzContact", "elastic_pair", "half_space"]
