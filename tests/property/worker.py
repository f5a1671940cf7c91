"""Carries out scripts one after the other, each in a session of its own: `[mpiexec -n R] python worker.py SOCKET
[THREADS]`.

Every rank speaks with the tests through a socket of its own: one line of JSON in, one out. A script runs as it does
under the program `hpcdem`; only the process stays.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import re
import signal
import socket
import sys
import time
from pathlib import Path
from typing import Any

from hpcdem.runtime import launch, shutdown

AT_ONCE = 20.0
"""Seconds in which all ranks must fail if one does: a busy machine is no reason to call an error a lonely one."""
TOLD = re.compile(r"warning: |GEN: |LOAD: |step \d+: \d+ particles left")
"""Lines of the log that must not depend on the ranks."""


def main() -> None:
    """Until the other end hangs up."""
    threads = int((sys.argv[2:] or [1])[0])
    launch.prepare_environment(threads)
    comm = launch.start_mpi()
    shutdown.GRACE = AT_ONCE
    channel = shutdown.private_channel(comm)
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(sys.argv[1])
        with line.makefile("rw", encoding="utf-8") as talk:

            def say(answer: dict[str, Any]) -> None:
                talk.write(json.dumps({"rank": comm.rank} | answer) + "\n")
                talk.flush()

            get_ready(comm, "", threads=threads)
            say({"pid": os.getpid()})
            for words in talk:
                job = json.loads(words)
                say(TASKS[job["task"]](comm, channel, job, say))
    shutdown.leave(shutdown.ExitStatus(rank=comm.rank))


READY: set[str] = set()
"""Kinds of kernels that are loaded."""


def get_ready(comm: Any, *kinds: str, threads: int = 1) -> None:
    """Load kernels, or compile them: a script is not to wait for that, and each kind has to be loaded before a script
    imports some of it."""
    from hpcdem import session
    from hpcdem.runtime.progress import Log

    for kind in kinds:
        if kind not in READY:
            session.prepare(comm, Log(comm.rank, stream=io.StringIO()), [kind], threads)
            READY.add(kind)


# ---- a script --------------------------------------------------------------------------------------------------------


def carry_out(comm: Any, channel: Any, job: dict[str, Any], say: Any) -> dict[str, Any]:
    """Run job["script"] in job["folder"]; then, if job["again"] names a checkpoint, restore it and save it again."""
    from hpcdem.cli.run import Options, run
    from hpcdem.core.errors import HpcdemError, StoppedWithCheckpoint
    from hpcdem.runtime.progress import Log
    from hpcdem.runtime.stop_requests import StopRequests

    os.chdir(job["folder"])
    told = io.StringIO()
    shared = watched(job)(
        comm, Log(comm.rank, stream=told), StopRequests(), figure=False, ready={""}
    )  # fmt: skip
    failure, ours = None, False
    try:
        run(shared, Options(script=Path(job["script"]), figure=False))
        if job.get("again"):
            save_again(comm, job["again"])
    except BaseException as error:
        failure, ours = shutdown.describe(error), not isinstance(error, (HpcdemError, StoppedWithCheckpoint))
    answer = {
        "code": failure.code if failure else 0, "text": failure.text if failure else "", "ours": ours,
        "told": [row for row in told.getvalue().splitlines() if TOLD.match(row)], "seen": shared.seen(),
    }  # fmt: skip
    if channel is not None and not shutdown.all_arrive(channel, failure):
        say(answer | {"alone": True})
        comm.abort(1)
    return answer


def watched(job: dict[str, Any]) -> Any:
    """The class of a session that remembers its simulations and lets accidents happen to them."""
    from hpcdem.session import Session

    class Watched(Session):
        def simulation(self, *values: Any, **options: Any) -> Any:
            sim = super().simulation(*values, **options)
            self.watched = sim
            if job.get("accident"):
                prepare_accident(sim, job["accident"])
            return sim

        def seen(self) -> dict[str, Any]:
            """What this rank knows of the end, without asking the others."""
            sim = getattr(self, "watched", None)
            if sim is None:
                return {}
            breaks = sim.breaks + (sim.uncollected_breaks() if sim.closed else 0)
            return {
                "step": sim.clock.step, "owned": len(sim.particles), "bonds": int(sim.bonds),
                "breaks": breaks.tolist(), "rebuilds": sim.rebuilds, "made": sim.next_gid,
                "travel": float(abs(sim.walls.v).max()) if len(sim.walls) else 0.0,
            }  # fmt: skip

    return Watched


def save_again(comm: Any, name: str) -> None:
    """A checkpoint brought in and written once more, as again.sav: it must say the same."""
    from hpcdem.physics.dem import saved_state
    from hpcdem.physics.dem.simulation import Simulation

    sim = Simulation(comm)
    try:
        found = saved_state.restore(sim, name)
        sim.script, sim.position, sim.progress = found["script"], found["position"], found["progress"]
        saved_state.save(sim, "again.sav")
    finally:
        sim.release()


def prepare_accident(sim: Any, kind: str) -> None:
    """At step 7, on the last rank of several: what the tests must notice."""
    from hpcdem.core.errors import CommandError
    from hpcdem.physics.dem.simulation import Watcher

    def happen() -> None:
        if sim.clock.step != 7 or sim.comm.rank + 1 != sim.comm.size or sim.comm.size == 1:
            return
        match kind:
            case "a bit":
                speeds = sim.particles["vy"]
                speeds[:] = speeds * (1.0 + 2.0**-52)
            case "hangs":
                time.sleep(3600.0)
            case "dies":
                os.kill(os.getpid(), signal.SIGKILL)
            case "alone":
                shutdown.GRACE = 1.0
                raise CommandError("this rank has something against it")
            case "leaves a file":
                Path("data").mkdir(exist_ok=True)
                Path("data/all_7.dat.tmp").write_text("half")

    if kind == "is ours":
        raise ValueError("a mistake of the program itself")
    sim.watchers.append(Watcher(1, happen))


# ---- the program -----------------------------------------------------------------------------------------------------


def carry_out_words(comm: Any, channel: Any, job: dict[str, Any], say: Any) -> dict[str, Any]:
    """`hpcdem WORDS` in job["folder"]: exit code, what is printed to stdout and to stderr."""
    from hpcdem.cli import new_session, read_options, run
    from hpcdem.runtime.progress import Log
    from hpcdem.session import enter

    get_ready(comm, "", "blocks", "coupled", threads=job["threads"])
    os.chdir(job["folder"])
    words, path, modules = list(sys.argv), list(sys.path), set(sys.modules)
    out, err, session, failure = io.StringIO(), io.StringIO(), None, None
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            options = read_options(job["words"])
            session = new_session(comm, Log(comm.rank), options, job["threads"])
            session.ready = READY
            session.stop.install(comm.rank)  # a session does so when it waits for kernels
            run(session, options)
        except BaseException as error:
            failure = shutdown.describe(error)
        if session is not None:
            session.stop.uninstall()
        if channel is not None and not shutdown.all_arrive(channel, failure):
            say({"code": 1, "out": out.getvalue(), "err": failure.text if failure else "", "alone": True})
            comm.abort(1)
        if comm.rank == 0:
            shutdown.report(failure, 0, 1)
    enter(None)
    sys.argv, sys.path = words, path
    for name in set(sys.modules) - modules:
        file = str(getattr(sys.modules[name], "__file__", ""))
        own = file.startswith(sys.prefix) or name.partition(".")[0] in ("hpcdem", "tests")
        if file.startswith(job["folder"]) and not own:
            del sys.modules[name]  # a helper that stands beside the script
    return {"code": failure.code if failure else 0, "out": out.getvalue(), "err": err.getvalue()}


# ---- a checkpoint ----------------------------------------------------------------------------------------------------


def read_damaged(comm: Any, channel: Any, job: dict[str, Any], say: Any) -> dict[str, Any]:
    """Read a checkpoint after each of job["damages"], lists of (place, byte to put in), or a new length.

    Answers with one word each: "same", "refused", "changed", or what was raised.
    """
    from hpcdem.core.errors import HpcdemError
    from hpcdem.io import checkpoint

    whole = Path(job["file"]).read_bytes()
    expected = digest(*checkpoint.read(job["file"]))
    spoilt, outcomes = Path(job["file"]).with_suffix(".spoilt"), []
    for damage in job["damages"]:
        data = bytearray(whole)
        if isinstance(damage, int):
            del data[damage:]
        else:
            for place, value in damage:
                data[place] = value
        spoilt.write_bytes(data)
        try:
            outcomes.append("same" if digest(*checkpoint.read(spoilt)) == expected else "changed")
        except HpcdemError:
            outcomes.append("refused")
        except BaseException as error:
            outcomes.append(f"{type(error).__name__}: {error}")
    return {"outcomes": outcomes}


def digest(state: Any, tables: Any) -> str:
    """Of all that a checkpoint says: values, types and shapes."""
    found = hashlib.sha256(json.dumps(state, sort_keys=True).encode())
    for table, columns in sorted(tables.items()):
        for name, values in sorted(columns.items()):
            found.update(f"{table}/{name} {values.dtype.str} {values.shape}".encode() + values.tobytes())
    return found.hexdigest()


TASKS = {"script": carry_out, "program": carry_out_words, "damaged": read_damaged}

if __name__ == "__main__":
    main()
