"""Garments on bodies: sewing patterns in, draped and moving garments out.

SI units throughout; points are rows of three. A call that the library refuses raises
:class:`ToileError` (or a subclass) with the library's own text, and leaves the object as it was.
"""

from __future__ import annotations

from ._body import Body
from ._errors import DataError, NumericsError, ToileError, UsageError
from ._ffi import lib
from ._garment import Edge, Garment
from ._report import CRITERIA, Energies, Outcome, Report, Suggestion, SystemInfo, YarnChanges
from ._sim import Sim

__all__ = [
    "CRITERIA",
    "Body",
    "DataError",
    "Edge",
    "Energies",
    "Garment",
    "NumericsError",
    "Outcome",
    "Report",
    "Sim",
    "Suggestion",
    "SystemInfo",
    "ToileError",
    "UsageError",
    "YarnChanges",
    "version",
]


def version() -> int:
    """Version of the library that was loaded, as one number."""
    return int(lib.toile_version())
