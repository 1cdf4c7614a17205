"""The server's side of the worker process."""

import asyncio
import multiprocessing

from upholster.apps.studio.worker import Worker


def test_messages_after_the_end_of_the_loop_are_dropped() -> None:
    loop = asyncio.new_event_loop()
    loop.close()
    own, theirs = multiprocessing.Pipe()
    theirs.send(("stage", 1, "lay", 0, 1))
    with own, theirs:
        Worker("", 1)._listen(own, loop)
        assert not own.poll()
