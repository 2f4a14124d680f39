"""Ctrl-C during a long call of the library."""

from __future__ import annotations

import signal
import threading
from typing import Any


class _Interrupts:
    """Notes Ctrl-C while a call runs, and hands it on once the call has ended.

    A handler that raises would raise at any place inside a callback, also where ctypes can only print
    the exception and go on. So the handler makes a note, the callback stops the call when it sees it,
    and the handler that was there before (Python's own raises ``KeyboardInterrupt``) is called at
    the end. Signals reach the main thread alone; elsewhere this does nothing, nor where the
    program ignores Ctrl-C or leaves it to the system.
    """

    def __init__(self) -> None:
        self.asked = False
        self._before: Any = None
        self._frame: Any = None

    def _note(self, _number: int, frame: Any) -> None:
        self.asked, self._frame = True, frame

    def __enter__(self) -> _Interrupts:
        before = signal.getsignal(signal.SIGINT)
        if callable(before) and threading.current_thread() is threading.main_thread():
            self._before = before
            signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(self, *_: Any) -> None:
        if self._before is None:
            return
        before, frame, self._before, self._frame = self._before, self._frame, None, None
        signal.signal(signal.SIGINT, before)
        if self.asked:
            before(signal.SIGINT, frame)
