"""Imported by the process that those of the tests are forked from: what workers and readers of a server would load."""

import gc
from importlib import import_module

from service.formats import reading
from service.jobs import worker

for library in reading.LIBRARIES:
    import_module(library)
worker.warm_up()
gc.freeze()
