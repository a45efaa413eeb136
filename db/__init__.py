"""The database of materials: tables, repositories, blob store."""

from importlib.metadata import version

__version__ = version("stiction")
