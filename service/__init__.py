"""The web service: routes, use cases, jobs, file formats and the `stiction` command line."""

from importlib.metadata import version

__version__ = version("stiction")
