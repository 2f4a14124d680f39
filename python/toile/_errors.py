"""A status of the library as an exception with the library's own text."""

from __future__ import annotations

from ._ffi import lib


class ToileError(Exception):
    """The library refused a call; ``status`` is its fixed code, ``name`` the code's name."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status
        self.name: str = lib.toile_status_name(status).decode()


class UsageError(ToileError):
    """Wrong use: an argument, a handle, a state (-1 to -19)."""


class DataError(ToileError):
    """A file, pattern, mesh or fabric that cannot be (-20 to -39)."""


class NumericsError(ToileError):
    """No admissible state was found (-40 to -59)."""


def _check(status: int) -> None:
    if status == 0:
        return
    text = lib.toile_last_error().decode("utf-8", "replace")
    kind = ToileError
    for limit, candidate in ((-19, UsageError), (-39, DataError), (-59, NumericsError)):
        if status >= limit:
            kind = candidate
            break
    raise kind(status, text)
