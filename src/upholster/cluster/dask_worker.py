"""What each worker of this machine does first: Dask loads this module in its process."""

import signal
import threading
from typing import Any

__all__ = ["dask_setup"]


def dask_setup(_worker: Any) -> None:
    """Leave Ctrl-C to the command that has started the workers: it ends them, and says what is done."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
