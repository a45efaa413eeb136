"""Closed forms of contact mechanics, as importable code: what the numerical solver is tested against.

One module a problem: ``hertz``, ``cattaneo_mindlin``, ``mindlin_deresiewicz`` (reversal, changing normal force),
``torsion``, ``flat_punch``, ``cylinder``, ``wavy``, ``lee_radok`` (viscoelastic), ``bonded_layer``. ``elastic_pair``
has the compliances that they take. ``beam_chain`` is the paper's discrete model, solved exactly.
"""

from slipcore.contact.reference.bonded_layer import BondedLayer
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.cylinder import CylinderContact
from slipcore.contact.reference.elastic_pair import RIGID, Compliance, elastic_pair, half_space
from slipcore.contact.reference.flat_punch import FlatPunch
from slipcore.contact.reference.hertz import HertzContact
from slipcore.contact.reference.lee_radok import LeeRadok, PronySeries
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz
from slipcore.contact.reference.torsion import ReissnerSagoci, TorsionPartialSlip
from slipcore.contact.reference.wavy import WavyContact

__all__ = [
    "RIGID",
    "BondedLayer",
    "CattaneoMindlin",
    "Compliance",
    "CylinderContact",
    "FlatPunch",
    "HertzContact",
    "LeeRadok",
    "MindlinDeresiewicz",
    "PronySeries",
    "ReissnerSagoci",
    "TorsionPartialSlip",
    "WavyContact",
    "elastic_pair",
    "half_space",
]
