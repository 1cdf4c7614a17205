"""Tasks side by side: all of them run, errors come through, progress counts up in the calling thread."""

import threading
import time

import pytest

from upholster.base.errors import InputError
from upholster.runtime.parallel import (
    Stop,
    cancelled_by,
    given_threads,
    handed_on,
    quietly,
    report_note,
    report_progress,
    reporting,
    run_tasks,
    running,
    stop_flag,
    thread_count,
    thread_pool,
)


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


@pytest.mark.parametrize("threads", [1, 2])
def test_a_task_runs_on_one_thread_without_progress_and_ends_with_its_work(threads):
    seen, found, stop = [], [], Stop()

    def task():
        report_progress("inner", 1, 1)
        found.append((thread_count(), stop_flag() is stop.flag))

    with running(threads, lambda *step: seen.append(step)), cancelled_by(stop):
        run_tasks([task, task], stage="outer")
        assert thread_count() == threads
    assert found == [(1, True)] * 2
    assert seen == [("outer", 1, 2), ("outer", 2, 2)]


def test_a_pools_tasks_run_on_one_thread_of_its_own():
    found = []
    with running(2), thread_pool() as pool:
        pool.submit(("kind", 1), lambda name: found.append((name, thread_count())), "one")
        assert pool.next() == ("kind", 1)
        assert pool.width == 2
    assert found == [("one", 1)]


def test_what_is_not_said_stays_as_around_it():
    seen, notes = [], []
    with running(3, lambda *step: seen.append(step), notes.append):
        with running(2):
            report_progress("one", 1, 2)
            report_note("a note")
            assert (thread_count(), given_threads()) == (2, 2)
        with reporting(lambda stage, done, total: (stage, 10 + done, 10 * total)), quietly():
            report_progress("none", 1, 1)
        with reporting(lambda stage, done, total: (stage, 10 + done, 10 * total)):
            report_progress("two", 1, 2)
        assert thread_count() == 3
    assert (seen, notes) == ([("one", 1, 2), ("two", 11, 20)], ["a note"])
    assert given_threads() is None
    report_progress("nobody", 1, 1)


def test_a_thread_of_our_own_works_as_the_one_that_made_it():
    found = []
    with running(5):
        thread = threading.Thread(target=handed_on(lambda: found.append(given_threads())))
        lone = threading.Thread(target=lambda: found.append(given_threads()))
    for each in (thread, lone):
        each.start()
        each.join()
    assert found == [5, None]


def test_tasks_share_a_larger_stage():
    seen = []
    with running(1, lambda *step: seen.append(step)):
        run_tasks([int, int], stage="texels", share=(100, 50, 200))
    assert seen == [("texels", 125, 200), ("texels", 150, 200)]


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
