"""What trying a file costs: processor time, memory, and both for each of its bytes."""

import resource
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from upholster.base.errors import FormatError, InputError

__all__ = ["Costs"]


def peak() -> int:
    """Most memory, in bytes, since `forget_peak`; where the system does not tell that, of all the time."""
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM"):
                return 1024 * int(line.split()[1])
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def forget_peak() -> int:
    """Let the peak begin anew; return it."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return peak()


def seconds_spent() -> float:
    """Processor time of this process and of those that it started and that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def peak_of_children() -> int:
    """Most memory of a process that this one started and that has ended, in bytes."""
    return 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss


class Costs:
    """Tries files of one kind, and keeps what was dearest.

    Parameters
    ----------
    kind
        What they are.
    slow, large
        Files that take more than so many seconds, or bytes of memory, are kept.

    Attributes
    ----------
    kind
        What they are.
    seen
        How often what came of it.
    seconds, memory, seconds_a_byte
        The most of one file: of processor time, of further memory in bytes, of time for each byte. Processes
        that reading starts count as well; their memory where it is more than that of all before.
    """

    def __init__(self, kind: str, *, slow: float = 1.0, large: int = 2**28) -> None:
        self.kind, self._slow, self._large = kind, slow, large
        self.seen: Counter[str] = Counter()
        self.seconds = self.seconds_a_byte = 0.0
        self.memory = 0

    def attempt(self, data: bytes, read: Callable[[], str]) -> None:
        """Read a file; what it raises beside the two errors is raised, and the file kept."""
        before, start, largest_child = forget_peak(), seconds_spent(), peak_of_children()
        try:
            self.seen[read()] += 1
        except (FormatError, InputError) as error:
            text = str(error)
            if "\n" in text or not text.isprintable():
                self._keep(data, "message")
                raise RuntimeError(f"message is no line: {text!r}") from error
            self.seen["refused"] += 1
        except BaseException:
            self._keep(data, "failure")
            raise
        seconds, memory = seconds_spent() - start, peak() - before
        if (child := peak_of_children()) > largest_child:
            memory = max(memory, child)
        if seconds > max(self._slow, self.seconds):
            self._keep(data, "slow", f", {seconds:.2f} s")
        if memory > max(self._large, self.memory):
            self._keep(data, "large", f", {memory >> 20} MB")
        self.seconds = max(self.seconds, seconds)
        self.memory = max(self.memory, memory)
        self.seconds_a_byte = max(self.seconds_a_byte, seconds / max(1, len(data)))

    def _keep(self, data: bytes, why: str, reported: str = "") -> None:
        path = Path(tempfile.gettempdir()) / f"fuzz_{why}.{self.kind}"
        path.write_bytes(data)
        print(f"{self.kind}: {why} ({len(data)} bytes{reported}): {path}", flush=True)

    def __str__(self) -> str:
        seen = ", ".join(f"{count:,} {what}" for what, count in sorted(self.seen.items()))
        return (
            f"{self.kind}: {seen}; slowest {self.seconds:.2f} s, most memory {self.memory / 2**20:.0f} MB, "
            f"{1e6 * self.seconds_a_byte:.0f} µs a byte"
        )
