"""Setup of each worker on this machine: Dask loads this module in its process."""

import signal
import threading
from typing import Any

__all__ = ["dask_setup"]


def dask_setup(_worker: Any) -> None:
    """Leave Ctrl-C to the command that started the workers: it ends them, and reports finished work."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
