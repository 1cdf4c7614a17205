"""Tasks side by side: all of them run, errors come through, progress counts up in the calling thread."""

import threading
import time

import pytest

from upholster.errors import InputError
from upholster.parallel import run_tasks, running, thread_count


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_every_task_runs_once_and_progress_counts(threads):
    done, seen = [], []

    def report(stage, count, total):
        assert threading.current_thread() is threading.main_thread()
        seen.append((stage, count, total))

    with running(threads, report):
        run_tasks([lambda n=n: done.append(n) for n in range(20)], stage="work")
    assert sorted(done) == list(range(20))
    assert seen == [("work", count, 20) for count in range(1, 21)]


@pytest.mark.parametrize("threads", [1, 3])
def test_the_first_error_stops_the_rest(threads):
    done = []

    def fail():
        raise ValueError("broken")

    def slow(n):
        time.sleep(0.01)
        done.append(n)

    # So many that a thread which has to wait for a busy machine still is in time to stop them.
    with pytest.raises(ValueError, match="broken"):
        run_tasks([fail, *[lambda n=n: slow(n) for n in range(5000)]], threads=threads)
    assert len(done) < 5000


def test_tasks_run_side_by_side():
    barrier = threading.Barrier(2, timeout=120)
    run_tasks([barrier.wait, barrier.wait], threads=2)


def test_nothing_to_do_is_done():
    run_tasks([], threads=4)


@pytest.mark.parametrize("threads", [0, -1, 257])
def test_thread_counts_are_checked(threads):
    with pytest.raises(InputError, match="threads"), running(threads):
        pass


def test_by_default_one_thread_per_core():
    assert thread_count() >= 1
