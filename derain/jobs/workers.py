"""Worker processes of this machine, which repeat a task whose process dies."""

import multiprocessing
import pickle
import signal
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any, TypeVar

from derain.errors import InputError
from derain.system.memory import keep_freed_memory
from derain.system.workers import end_with_parent, without_main_module

# Times that a task is tried while its process dies.
TRIES = 3

Result = TypeVar("Result")


def processes(count: int) -> AbstractContextManager["WorkerPool | None"]:
    """Lends processes of this machine as an executor; None for one, which is this process.

    Args:
        count: Number of processes.
    """
    return nullcontext() if count == 1 else WorkerPool(count)


class WorkerPool(ThreadPoolExecutor):
    """Processes of this machine; each runs one task after the other.

    If a process dies, for instance because memory is full, a new one runs its task again. A task
    whose process always dies fails with an InputError, and the other tasks continue.

    A ``with`` block ends the processes: after an error at once, otherwise when all tasks are done.

    Args:
        workers: Number of processes.
    """

    def __init__(self, workers: int) -> None:
        super().__init__(workers)
        self._workers = [_Worker() for _ in range(workers)]
        self._idle = SimpleQueue[_Worker]()
        for worker in self._workers:
            self._idle.put(worker)
        self._ended = False

    def submit(self, work: Callable[..., Result], /, *args: Any, **kwargs: Any) -> Future[Result]:
        """Runs a function in the next process that is idle."""
        return super().submit(self._run, pickle.dumps((work, args, kwargs)))

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._ended = True
            self.shutdown(wait=False, cancel_futures=True)
            self._kill()
        self.shutdown(wait=True)
        self._kill()

    def _kill(self) -> None:
        for worker in self._workers:
            worker.kill()

    def _run(self, task: bytes) -> Any:
        """Waits for a process and for its answer, in a thread of this process."""
        worker = self._idle.get()
        try:
            for _ in range(TRIES):
                if self._ended:
                    raise CancelledError
                try:
                    succeeded, answer = worker.run(task)
                except (EOFError, OSError):
                    worker.kill()
                    continue
                if succeeded:
                    return answer
                raise answer
        finally:
            self._idle.put(worker)
        if self._ended:
            raise CancelledError
        fewer = "; fewer --workers need less" if len(self._workers) > 1 else ""
        raise InputError(
            "worker",
            f"its process died {TRIES} times",
            f"Check whether the memory is full{fewer}.",
        )


class _Worker:
    """A process that is started with its first task, and again after it died."""

    def __init__(self) -> None:
        self._lock = threading.Lock()  # a pool kills from another thread than it runs tasks from
        self._process: multiprocessing.process.BaseProcess | None = None
        self._connection: Connection[Any, Any] | None = None

    def run(self, task: bytes) -> tuple[bool, Any]:
        """Sends a task to the process, and waits for its answer.

        Args:
            task: A function, its arguments and its keyword arguments, pickled.

        Returns:
            True if it succeeded, and the value that it returned or raised.

        Raises:
            EOFError: The process died.
            OSError: It died earlier.
        """
        with self._lock:
            connection = self._connection or self._start()
        connection.send_bytes(task)
        answer: tuple[bool, Any] = connection.recv()
        return answer

    def kill(self) -> None:
        """Ends the process at once, also during a task."""
        with self._lock:
            if self._process is not None:
                self._process.kill()
                self._process.join()
            self._process = self._connection = None

    def _start(self) -> "Connection[Any, Any]":
        # Not forked: a fork has the locks of this process, but not the threads that release them.
        context = multiprocessing.get_context("spawn")
        self._connection, worker_end = context.Pipe()
        self._process = context.Process(target=_run_tasks, args=(worker_end,), daemon=True)
        with without_main_module():
            self._process.start()
        worker_end.close()  # so that the connection ends with the process
        return self._connection


def _run_tasks(connection: "Connection[Any, Any]") -> None:
    """Runs tasks until its process is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal: the parent process ends this one
    end_with_parent()
    keep_freed_memory()
    while True:
        try:
            task = connection.recv_bytes()
        except EOFError:  # the parent process has ended
            return
        answer: tuple[bool, Any]
        try:
            work, args, kwargs = pickle.loads(task)
            answer = True, work(*args, **kwargs)
        except Exception as error:
            answer = False, error
        try:
            connection.send(answer)
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            connection.send((False, TypeError(f"{answer[1]!r} cannot be sent ({error})")))
