"""Many ranks in one process: a thread each, with a communicator that counts what it is asked for."""

from __future__ import annotations

import pickle
import queue
import sys
import threading
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError

TIMEOUT = 120.0


class Request:
    """A message that is sent or received each time it is started."""

    def __init__(self, mailbox: queue.SimpleQueue | None, buffer: np.ndarray, sends: bool, counts: Counter) -> None:
        self.mailbox, self.buffer, self.sends, self.counts = mailbox, buffer, sends, counts

    def start(self) -> Request:
        if self.mailbox is not None and self.sends:
            self.counts["messages"] += 1
            self.mailbox.put(self.buffer.tobytes())
        return self

    def finish(self) -> None:
        if self.mailbox is not None and not self.sends:
            self.buffer.reshape(-1).view(np.uint8)[:] = np.frombuffer(self.mailbox.get(timeout=TIMEOUT), np.uint8)

    def Free(self) -> None:
        pass


class Mailboxes:
    """The messages between neighbours, as mpi4py names them."""

    def __init__(self, ranks: Ranks, rank: int, counts: Counter) -> None:
        self.ranks, self.rank, self.counts = ranks, rank, counts

    def Recv_init(self, buffer: np.ndarray, source: int, tag: int) -> Request:
        mailbox = self.ranks.mailbox(source, self.rank, tag) if source >= 0 else None
        return Request(mailbox, buffer, False, self.counts)

    def Send_init(self, buffer: np.ndarray, dest: int, tag: int) -> Request:
        mailbox = self.ranks.mailbox(self.rank, dest, tag) if dest >= 0 else None
        return Request(mailbox, buffer, True, self.counts)

    def Irecv(self, buffer: np.ndarray, source: int, tag: int) -> Request:
        return self.Recv_init(buffer, source, tag).start()

    def Isend(self, buffer: np.ndarray, dest: int, tag: int) -> Request:
        return self.Send_init(buffer, dest, tag).start()

    def Recv(self, buffer: np.ndarray, source: int, tag: int) -> None:
        self.Recv_init(buffer, source, tag).finish()

    def Send(self, buffer: np.ndarray, dest: int, tag: int) -> None:
        self.Send_init(buffer, dest, tag).start()


class Pretended(SerialComm):
    """One of the ranks. counts: messages sent to other ranks, reductions, lists as long as there are ranks ("lists"),
    calls of Python functions since `watch` ("calls"); most: bytes of the largest thing it was told or got at once."""

    def __init__(self, ranks: Ranks, rank: int) -> None:
        self.ranks, self.rank, self.size = ranks, rank, ranks.size
        self.counts: Counter = Counter()
        self.most = 0
        self.mpi = Mailboxes(ranks, rank, self.counts)
        self.crowded = True  # they are threads of one process

    def watch(self) -> None:
        """Count from now on."""
        self.counts.clear()
        self.most = 0

        def called(frame: Any, event: str, _: object) -> None:
            if event == "call" and "/hpcdem/" in frame.f_code.co_filename:
                self.counts["calls"] += 1

        sys.setprofile(called)

    def wait(self, *requests: Request) -> None:
        self.wait_all(list(requests))

    def wait_all(self, requests: list[Request]) -> None:
        for request in requests:
            request.finish()

    def start_all(self, requests: list[Request]) -> None:
        for request in requests:
            request.start()

    def _together(self, value: Any, kind: str) -> list:
        """What all ranks brought."""
        self.counts[kind] += 1
        self.ranks.table[self.rank] = value
        self.ranks.meet.wait(TIMEOUT)
        every = list(self.ranks.table)
        self.ranks.meet.wait(TIMEOUT)
        return every

    def _copied(self, obj: Any) -> Any:
        """What came from other ranks, as if it had been on the way."""
        parcel = pickle.dumps(obj)
        self.most = max(self.most, len(parcel))
        return pickle.loads(parcel)

    def barrier(self) -> None:
        self._together(None, "reductions")

    def bcast(self, obj: Any, root: int = 0) -> Any:
        told = self._together(obj, "reductions")[root]
        return obj if self.rank == root else self._copied(told)

    def gather(self, obj: Any) -> list | None:
        every = self._together(obj, "lists")
        return self._copied(every) if self.rank == 0 else None

    def allgather(self, obj: Any) -> list:
        return self._copied(self._together(obj, "lists"))

    def any(self, flag: bool) -> bool:
        return any(self._together(bool(flag), "reductions"))

    def _reduce(self, array: np.ndarray, how: Callable) -> np.ndarray:
        array[...] = how(np.stack(self._together(array.copy(), "reductions")), axis=0)
        return array

    def max_into(self, array: np.ndarray) -> np.ndarray:
        return self._reduce(array, np.max)

    def min_into(self, array: np.ndarray) -> np.ndarray:
        return self._reduce(array, np.min)

    def sum_into(self, array: np.ndarray) -> np.ndarray:
        return self._reduce(array, np.sum)

    def exscan(self, count: int) -> int:
        return sum(self._together(count, "reductions")[: self.rank])

    def exchange(self, parcels: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
        self.counts["messages"] += len(parcels)
        every = self._together(parcels, "reductions")
        return self._copied({source: given[self.rank] for source, given in enumerate(every) if self.rank in given})

    def agree(self, error: str | None) -> None:
        found = [e for e in self._together(error, "reductions") if e is not None]
        if found:
            raise HpcdemError(found[0])


class Ranks:
    """So many of them."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.table: list[Any] = [None] * size
        self.meet = threading.Barrier(size)
        self.mail: dict[tuple[int, int, int], queue.SimpleQueue] = {}

    def mailbox(self, source: int, dest: int, tag: int) -> queue.SimpleQueue:
        """That of messages from one rank to another; sender and receiver may be the first to ask at the same time."""
        return self.mail.setdefault((source, dest, tag), queue.SimpleQueue())

    def run(self, program: Callable[[Pretended], Any]) -> list[Any]:
        """What the program returns on every rank. The first error of a rank ends all and comes out here."""
        results: list[Any] = [None] * self.size
        errors: list[BaseException] = []

        def work(comm: Pretended) -> None:
            try:
                results[comm.rank] = program(comm)
            except threading.BrokenBarrierError:
                pass
            except BaseException as error:
                errors.append(error)
                self.meet.abort()
            finally:
                sys.setprofile(None)

        comms = [Pretended(self, rank) for rank in range(self.size)]
        threads = [
            threading.Thread(target=work, args=(comm,), daemon=True, name=f"rank {comm.rank} of {self.size}")
            for comm in comms
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(TIMEOUT)
        if errors:
            raise errors[0]
        assert not any(thread.is_alive() for thread in threads), "ranks wait for each other"
        return results
