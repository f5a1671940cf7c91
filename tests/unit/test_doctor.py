"""The doctor: each finding is made to appear and to disappear, on a machine of files that the test writes."""

from __future__ import annotations

import errno
import fcntl
import importlib.metadata
import io
import os
import platform
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from hpcdem.cli import doctor as program
from hpcdem.core.comm import SerialComm
from hpcdem.runtime import cgroups, doctor, launch
from hpcdem.runtime.doctor import CHECKS, Level, Machine, host, merged, software, storage
from hpcdem.runtime.doctor.machine import Finding, ok, problem, size, warning
from hpcdem.runtime.doctor.storage import existing, is_network, kind_of
from hpcdem.runtime.launch import Launcher, Place
from hpcdem.runtime.stop_requests import slurm_end_time

DISK = "20 1 8:1 / / rw,relatime - ext4 /dev/sda1 rw\n"
NFS = "30 20 0:40 / {} rw,relatime shared:1 - nfs4 server:/home rw,vers=4.2\n"
PYTHON = Path(sys.executable).name
NO_LIMIT = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
OPEN_MPI, MPICH = "Open MPI v4.1.4", "MPICH Version: 5.0.2"


def places(n: int = 1, cores: int = 4, threads: int = 1, host: str = "a", first: int = 0) -> list[Place]:
    return [Place(host, cores, frozenset(range(first, first + cores)), threads) for _ in range(n)]


@pytest.fixture
def make_machine(tmp_path, monkeypatch) -> Callable[..., Machine]:
    """`make_machine(files, environ, **attributes)`: a healthy machine with these files under its root.

    Also what the system says: limits(number), run(command), which(name), now().
    """
    root, results = tmp_path / "root", tmp_path / "results"
    results.mkdir()
    clock = time.time

    def make(files=None, environ=None, limits=no_limit, run=no_program, which=nothing, now=clock, **attributes):
        shutil.rmtree(root, ignore_errors=True)
        for name, text in {"proc/self/mountinfo": DISK, **(files or {})}.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        monkeypatch.setattr(resource, "getrlimit", limits)
        monkeypatch.setattr(subprocess, "run", run)
        monkeypatch.setattr(host, "slurm_end_time", partial(slurm_end_time, ask=run))
        monkeypatch.setattr(shutil, "which", which)
        monkeypatch.setattr(time, "time", now)
        monkeypatch.setattr(tempfile, "tempdir", str(results))
        environ = {"NUMBA_CACHE_DIR": str(tmp_path / "kernels"), **(environ or {})}
        return Machine(**{"places": places(), "root": root, "directory": results, "environ": environ, **attributes})

    return make


def no_limit(number):
    return NO_LIMIT


def nothing(name):
    return None


def no_program(command, **how):
    raise FileNotFoundError(errno.ENOENT, "no such program", command[0])


def answers(**programs: tuple[int, str, str]):
    """What other programs say, by their names: exit code, output, errors."""

    def ask(command, **how):
        name = Path(command[0]).name
        if name not in programs:
            return no_program(command)
        code, out, err = programs[name]
        if how.get("check") and code:
            raise subprocess.CalledProcessError(code, command)
        return subprocess.CompletedProcess(command, code, out, err)

    return ask


def bad(findings: Iterator[Finding]) -> list[Finding]:
    return [finding for finding in findings if finding.level > Level.OK]


def only(findings: Iterator[Finding]) -> Finding:
    (finding,) = bad(findings)
    assert finding.cure and "\n" not in finding.text + finding.cure
    return finding


# -- the table and how it is read ----------------------------------------------------------------------------------


def test_every_check_has_a_name_and_a_purpose():
    assert all(check.function.__doc__ for check in CHECKS)
    assert len({check.function.__name__ for check in CHECKS}) == len(CHECKS)


def test_a_healthy_machine_starts_in_silence(make_machine):
    assert doctor.start_warnings(make_machine(), SerialComm()) == []


def test_the_start_costs_next_to_nothing(make_machine, tmp_path):
    """Less than 5 ms on the machine at hand, after the modules are loaded; and no file is written."""
    taken = []
    for _ in range(7):
        machine = Machine(places(64), directory=tmp_path)
        began = time.thread_time()
        doctor.start_warnings(machine, SerialComm())
        taken.append(time.thread_time() - began)
    assert min(taken[1:]) < 5e-3

    machine = make_machine(directory=tmp_path / "not" / "yet")
    before = sorted(tmp_path.rglob("*"))
    doctor.start_warnings(machine, SerialComm())
    assert sorted(tmp_path.rglob("*")) == before


def test_what_is_wrong_at_the_start_is_reported_once(make_machine):
    machine = make_machine({"proc/meminfo": "MemAvailable: 100 kB\n"}, places=places(2))
    (line,) = doctor.start_warnings(machine, SerialComm())
    assert line.startswith("50 KiB of memory for each of 2 ranks (free 100 KiB): a rank needs") and "Cure: " in line


def test_a_check_that_fails_ends_nothing(make_machine):
    def broken(number):
        raise ValueError("a limit nobody has heard of")

    machine = make_machine(limits=broken)
    assert doctor.start_warnings(machine, SerialComm()) == []
    texts = [finding.text for _, _, finding in doctor.inspect(machine)]
    assert "the check shell_limits itself failed: ValueError: a limit nobody has heard of" in texts


def test_findings_of_hosts_are_put_together():
    slow, full = warning("x", "slow"), problem("y", "full")
    of_ranks = [[(0, False, ok("z", "job")), (2, True, full), (3, True, slow)], [], [(3, True, slow)]]
    assert merged(of_ranks, ["a", "a", "b"]) == [ok("z", "job"), problem("y", "a: full"), slow]
    assert merged([[(2, True, full)]], ["a"]) == [full]
    assert merged([[(2, True, full)]] * 6 + [[]], "abcdefg")[0].text == "a, b, c, d and 2 more: full"


def test_sizes_as_people_write_them():
    assert [size(n) for n in (0, 512, 4 << 20, 1.5 * (1 << 30), 1 << 50)] == [
        "0 B", "512 B", "4 MiB", "1.5 GiB", "1.02e+03 TiB",
    ]  # fmt: skip


def test_every_host_has_one_rank_that_checks():
    machines = [Machine(places(2, host="a") + places(2, host="b"), rank) for rank in range(4)]
    assert [m.first_of_host for m in machines] == [True, False, True, False]
    assert machines[3].hosts == ["a", "b"] and len(machines[3].here) == 2


# -- cores: more in test_runtime_launch ----------------------------------------------------------------------------


def test_ranks_bound_to_one_core_while_others_are_idle(make_machine):
    bound = places(2, cores=1) + places(1, cores=3, first=1)
    found = only(host.oversubscribed(make_machine(places=bound)))
    assert "2 ranks are bound to the same 1 of the 4 cores" in found.text and "bind-to none" in found.cure
    apart = [Place("a", 1, frozenset([core]), 1) for core in range(3)]
    assert not bad(host.oversubscribed(make_machine(places=apart)))


CGROUP2 = "31 1 0:28 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n"
CGROUP1 = "33 1 0:30 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu,cpuacct\n35 1 0:31 /docker/1f /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n"  # noqa: E501


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({}, None),
        ({"proc/self/mountinfo": DISK + CGROUP2, "proc/self/cgroup": "0::/\n"}, None),
        ({"proc/self/mountinfo": DISK + CGROUP2, "proc/self/cgroup": "0::/\n",
          "sys/fs/cgroup/cpu.max": "max 100000\n"}, None),
        ({"proc/self/mountinfo": DISK + CGROUP2, "proc/self/cgroup": "0::/\n",
          "sys/fs/cgroup/cpu.max": "150000 100000\n"}, 1.5),
        # the group above allows less than the own one
        ({"proc/self/mountinfo": DISK + CGROUP2, "proc/self/cgroup": "0::/user/job\n",
          "sys/fs/cgroup/user/cpu.max": "200000 100000\n", "sys/fs/cgroup/user/job/cpu.max": "400000 100000"}, 2.0),
        ({"proc/self/mountinfo": DISK + CGROUP1, "proc/self/cgroup": "3:cpu,cpuacct:/\n",
          "sys/fs/cgroup/cpu/cpu.cfs_quota_us": "-1", "sys/fs/cgroup/cpu/cpu.cfs_period_us": "100000"}, None),
        ({"proc/self/mountinfo": DISK + CGROUP1, "proc/self/cgroup": "3:cpu,cpuacct:/\n",
          "sys/fs/cgroup/cpu/cpu.cfs_quota_us": "50000", "sys/fs/cgroup/cpu/cpu.cfs_period_us": "100000"}, 0.5),
        ({"proc/self/mountinfo": DISK + CGROUP2, "proc/self/cgroup": "nonsense\n\n0:\n",
          "sys/fs/cgroup/cpu.max": "a b"}, None),
    ],
)  # fmt: skip
def test_a_quota_of_processor_time(make_machine, files, expected):
    machine = make_machine(files, places=places(3, cores=8))
    assert cgroups.cpu_quota(machine.root) == expected
    found = bad(host.cpu_quota(machine))
    assert len(found) == (expected is not None)
    if found:
        assert f"allows {expected:g} cores" in found[0].text
        assert found[0].cure.startswith(f"mpiexec -n {max(1, int(expected))} ")


def test_a_quota_as_wide_as_the_ranks_need(make_machine):
    files = {"proc/self/mountinfo": CGROUP2, "proc/self/cgroup": "0::/", "sys/fs/cgroup/cpu.max": "300000 100000"}
    assert not bad(host.cpu_quota(make_machine(files, places=places(3, cores=8))))
    assert any("3 cores" in f.text for f in host.cpu_quota(make_machine(files, places=places(3, cores=8))))


def test_where_the_ranks_are():
    (found,) = host.mapping(Machine(places(2, 2) + places(1, 2, first=4)))
    assert found.text == "rank 0 cores 0-1; rank 1 cores 0-1; rank 2 cores 4-5"
    assert host.core_list([3]) == "3" and host.core_list([8, 0, 1, 2]) == "0-2,8"


# -- memory, limits, clock, text -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("files", "environ", "level", "text"),
    [
        ({"proc/meminfo": "MemTotal: 9 kB\nMemAvailable: 8000000 kB\n"}, {}, None, ""),
        ({"proc/meminfo": "MemAvailable: 800000 kB\n"}, {}, Level.WARNING, "391 MiB of memory for each of 2 ranks"),
        # 4 means 4 MiB, not 4 GiB
        ({}, {"SLURM_JOB_ID": "7", "SLURM_MEM_PER_NODE": "4"}, Level.PROBLEM, "2 MiB of memory for each of 2 ranks"),
        ({}, {"SLURM_JOB_ID": "7", "SLURM_MEM_PER_NODE": "0"}, None, ""),
        ({}, {"SLURM_JOB_ID": "7", "SLURM_MEM_PER_CPU": "100", "SLURM_CPUS_ON_NODE": "4"}, Level.PROBLEM, "200 MiB"),
        ({}, {"SLURM_JOB_ID": "7", "SLURM_MEM_PER_CPU": "2000", "SLURM_CPUS_ON_NODE": "4"}, None, ""),
        ({"proc/self/mountinfo": CGROUP2, "proc/self/cgroup": "0::/", "sys/fs/cgroup/memory.max": "268435456"}, {},
         Level.PROBLEM, "128 MiB of memory for each of 2 ranks (limit of the control group 256 MiB)"),
        ({"proc/self/mountinfo": CGROUP2, "proc/self/cgroup": "0::/", "sys/fs/cgroup/memory.max": "max"}, {}, None, ""),
        # the mount shows the group of the container as its root
        ({"proc/self/mountinfo": CGROUP1, "proc/self/cgroup": "4:memory:/docker/1f",
          "sys/fs/cgroup/memory/memory.limit_in_bytes": "536870912"}, {}, Level.WARNING, "256 MiB"),
        ({"proc/self/mountinfo": CGROUP1, "proc/self/cgroup": "4:memory:/docker/1f",
          "sys/fs/cgroup/memory/memory.limit_in_bytes": "9223372036854771712"}, {}, None, ""),
    ],
)  # fmt: skip
def test_memory(make_machine, files, environ, level, text):
    machine = make_machine(files, environ, places=places(2))
    if level is None:
        assert not bad(host.memory(machine))
    else:
        found = only(host.memory(machine))
        assert found.level == level and text in found.text
        assert ("--mem-per-cpu" in found.cure) == ("SLURM_JOB_ID" in environ)
        assert len(list(host.memory(machine))) == 1


@pytest.mark.parametrize(
    ("name", "little", "enough", "text"),
    [
        ("NOFILE", 100, 1024, "ulimit -n is 100"),
        ("STACK", 1 << 16, 8 << 20, "ulimit -s is 64 KiB"),
        ("AS", 1 << 30, 8 << 30, "ulimit -v is 1 GiB"),
        ("NPROC", 20, 4096, "ulimit -u is 20"),
        ("FSIZE", 10 << 20, resource.RLIM_INFINITY, "files may have no more than 10 MiB"),
        ("CPU", 600, resource.RLIM_INFINITY, "killed after 600 s of processor time"),
        ("MEMLOCK", 64 << 10, 64 << 20, "only 64 KiB of memory can be locked"),
    ],
)
def test_limits_of_the_shell(make_machine, name, little, enough, text):
    def limited(to):
        def limits(number):
            return (to, to) if number == getattr(resource, f"RLIMIT_{name}") else NO_LIMIT

        return limits

    two_hosts = places(1, host="a") + places(1, host="b")
    files = {"sys/class/infiniband/mlx5_0": ""}
    found = only(host.shell_limits(make_machine(files, limits=limited(little), places=two_hosts)))
    assert text in found.text and "ulimit -" in found.cure
    assert not bad(host.shell_limits(make_machine(files, limits=limited(enough), places=two_hosts)))
    if name == "MEMLOCK":
        assert not bad(host.shell_limits(make_machine({}, limits=limited(little), places=two_hosts)))
        assert not bad(host.shell_limits(make_machine(files, limits=limited(little))))


def test_core_files(make_machine):
    (found,) = host.shell_limits(make_machine())
    assert (
        found.text.startswith("open files unlimited, core files unlimited") and "as large as the memory" in found.cure
    )
    *_, found = host.shell_limits(make_machine(limits=lambda number: (0, 0)))
    assert "core files 0 B" in found.text and not found.cure


def test_clocks(make_machine):
    assert not bad(host.clocks(make_machine()))
    assert not bad(host.clocks(make_machine(clocks=[100.0, 104.0])))
    assert "differ by 60 s" in only(host.clocks(make_machine(clocks=[100.0, 160.0, 101.0]))).text


@pytest.mark.parametrize(
    ("output", "names", "wrong"), [("utf-8", "UTF8", False), ("ascii", "utf-8", True), ("utf-8", "latin1", True)]
)
def test_text(make_machine, monkeypatch, output, names, wrong):
    said = SimpleNamespace(stdout=SimpleNamespace(encoding=output), getfilesystemencoding=lambda: names)
    monkeypatch.setattr(host, "sys", said)
    found = bad(host.text(make_machine()))
    assert [f.cure for f in found] == ["export LC_ALL=C.UTF-8"] * wrong


# -- file systems --------------------------------------------------------------------------------------------------


def test_the_file_system_of_a_path(tmp_path):
    (tmp_path / "a b" / "c").mkdir(parents=True)
    escaped = str(tmp_path / "a b").replace(" ", "\\040")
    table = DISK + NFS.format(escaped) + "short line\n" + NFS.format("/somewhere/else")
    assert kind_of(tmp_path, table) == "ext4" and kind_of(tmp_path / "a b" / "c", table) == "nfs4"
    hidden = table + f"31 20 0:41 / {escaped} ro - tmpfs tmpfs rw\n"  # mounted over it later
    assert kind_of(tmp_path / "a b" / "c", hidden) == kind_of(tmp_path / "a b", hidden) == "tmpfs"
    assert kind_of(tmp_path / "a bc", table) == "ext4" and kind_of(tmp_path, "") == ""
    assert existing(tmp_path / "a b" / "not" / "yet") == tmp_path / "a b"


@pytest.mark.parametrize(
    ("kind", "network"),
    [("nfs", True), ("lustre", True), ("fuse.sshfs", True), ("ext4", False), ("overlay", False),
     ("fuse.squashfuse", False), ("", False)],
)  # fmt: skip
def test_network_file_systems(kind, network):
    assert is_network(kind) is network


def test_results_in_memory(make_machine):
    assert not bad(storage.in_memory(make_machine()))
    memory = make_machine({"proc/self/mountinfo": "20 1 8:1 / / rw - tmpfs tmpfs rw\n"})
    assert "(tmpfs) is in memory" in only(storage.in_memory(memory)).text
    assert not bad(storage.in_memory(make_machine({"proc/self/mountinfo": ""})))


@pytest.mark.parametrize(("value", "warned"), [("FALSE", False), ("0", False), ("TRUE", True), ("BEST_EFFORT", True)])
def test_locks_of_hdf5_on_a_network_file_system(make_machine, value, warned):
    nfs = {"proc/self/mountinfo": NFS.format("/")}
    found = bad(storage.hdf5_locks(make_machine(nfs, {"HDF5_USE_FILE_LOCKING": value})))
    assert [f.cure for f in found] == ["export HDF5_USE_FILE_LOCKING=FALSE"] * warned
    assert not bad(storage.hdf5_locks(make_machine({}, {"HDF5_USE_FILE_LOCKING": value})))
    assert not bad(storage.hdf5_locks(make_machine(nfs)))


def room(free: int = 1 << 40, inodes: int = 10**6, counted: bool = True) -> SimpleNamespace:
    return SimpleNamespace(
        f_bavail=free // 4096, f_bfree=free // 4096, f_frsize=4096, f_blocks=1 << 30, f_favail=inodes,
        f_files=10**7 if counted else 0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("found", "level", "text"),
    [
        (room(), None, ""),
        (room(free=500 << 20), Level.WARNING, "only 500 MiB free"),
        (room(free=4 << 20), Level.PROBLEM, "4 MiB free"),
        (room(inodes=12), Level.WARNING, "space for only 12 more files"),
        (room(inodes=0, counted=False), None, ""),
    ],
)
def test_disk_space(make_machine, monkeypatch, found, level, text):
    machine = make_machine()
    monkeypatch.setattr(os, "statvfs", lambda path: found)
    for look in (storage.free_space, storage.temporary):
        if level is None:
            assert not bad(look(machine))
        else:
            said = only(look(machine))
            assert said.level == level and text in said.text


def fails(number: int) -> Callable[..., None]:
    def call(*arguments):
        raise OSError(number, os.strerror(number))

    return call


def test_a_file_system_that_does_not_answer(make_machine, monkeypatch):
    machine = make_machine()
    monkeypatch.setattr(os, "statvfs", fails(errno.ESTALE))
    assert "Stale file handle" in only(storage.free_space(machine)).text


@pytest.mark.parametrize(
    ("module", "name", "call", "level", "text"),
    [
        (os, "getpid", os.getpid, None, ""),
        (os, "mkdir", fails(errno.EROFS), Level.PROBLEM, "cannot make a folder in {}: the file system is read-only"),
        (os, "fsync", fails(errno.EIO), Level.PROBLEM, "cannot write a file in {}: the disk reports an input/output"),
        (os, "replace", fails(errno.EPERM), Level.PROBLEM, "cannot write a file in {}: permission denied"),
        (fcntl, "flock", fails(errno.ENOSYS), Level.WARNING, "{}: file locks do not work"),
        (fcntl, "flock", fails(errno.EIO), Level.PROBLEM, "cannot lock a file in {}: the disk reports"),
        (fcntl, "flock", lambda file, how: None, Level.WARNING, "{}: file locks do not work"),
    ],
)
def test_what_a_run_does_with_files(make_machine, monkeypatch, module, name, call, level, text):
    machine = make_machine()
    monkeypatch.setattr(module, name, call)
    if level is None:
        (found,) = storage.results(machine)
        assert re.search(r"\(ext4\): .* free, 1 MiB is safe in [\d.e+]+ ms$", found.text)
    else:
        found = only(storage.results(machine))
        folder = f"{machine.directory}" + " (ext4)" * (level == Level.PROBLEM)
        assert found.level == level and text.format(folder) in found.text
    assert not list(machine.directory.iterdir()), "it cleans up behind itself"


def test_a_slow_disk(make_machine, monkeypatch):
    machine = make_machine()
    monkeypatch.setattr(storage, "SLOW", 0.02)
    monkeypatch.setattr(os, "fsync", lambda handle: time.sleep(0.03))
    assert "checkpoints will wait" in only(storage.results(machine)).text
    monkeypatch.setattr(os, "fsync", lambda handle: None)
    assert not bad(storage.results(machine))


def test_a_file_server_with_another_clock(make_machine):
    clock = time.time
    found = only(storage.results(make_machine(now=lambda: clock() - 100.0)))
    assert "100 s in the future" in found.text
    assert "100 s in the past" in only(storage.results(make_machine(now=lambda: clock() + 100.0))).text


def test_a_folder_that_cannot_be_written(make_machine, tmp_path):
    machine = make_machine(directory=Path("/proc/self/fdinfo"))
    assert "cannot make a folder" in only(storage.results(machine)).text
    assert not bad(storage.results(make_machine(directory=tmp_path / "not" / "yet")))


QUOTA = "Disk quotas for user me (uid 7):\n  Filesystem blocks quota limit grace\n server:/home 5000* 4000 6000 6days\n"


def test_a_quota_that_is_used_up(make_machine):
    found = only(storage.quota(make_machine(run=answers(quota=(1, QUOTA, "")))))
    assert "server:/home is used up: 5000* 4000 6000" in found.text
    assert not bad(storage.quota(make_machine(run=answers(quota=(0, QUOTA.replace("*", ""), "")))))
    assert not bad(storage.quota(make_machine(run=no_program)))


def test_hosts_that_see_different_folders(make_machine, tmp_path, monkeypatch):
    monkeypatch.setattr(storage, "SOON", 0.0)
    (tmp_path / "seen").touch()
    hosts = places(host="a") + places(host="b")
    assert not bad(storage.shared(make_machine(places=hosts, rank=1, token=tmp_path / "seen")))
    found = only(storage.shared(make_machine(places=hosts, rank=1, token=tmp_path / "unseen")))
    assert found.level == Level.PROBLEM and "is not visible" in found.text
    assert not bad(storage.shared(make_machine(places=places(2), token=tmp_path / "unseen")))


def test_the_file_that_all_hosts_search_is_made_and_removed(make_machine, monkeypatch):
    """Of two hosts this one has rank 0; without the file the check would wait, and fail."""
    monkeypatch.setattr(doctor, "CHECKS", (doctor.Check(storage.shared, each_host=True),))
    monkeypatch.setattr(storage, "SOON", 0.0)
    machine = make_machine(places=places(host="a") + places(host="b"))
    assert doctor.examine(machine, SerialComm()) == []
    assert machine.token.parent == machine.directory and not list(machine.directory.iterdir())
    monkeypatch.setattr(Path, "touch", fails(errno.EACCES))
    assert "is not visible" in only(doctor.examine(machine, SerialComm())).text


# -- kernels -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("mode", "who"), [(0o700, ""), (0o755, ""), (0o777, "everyone"), (0o1777, "everyone")])
def test_a_cache_that_others_can_write(make_machine, tmp_path, mode, who):
    base = tmp_path / "kernels"
    base.mkdir()
    base.chmod(mode)
    machine = make_machine({}, {"NUMBA_CACHE_DIR": str(base)})
    if who:
        found = only(storage.cache_owner(machine))
        assert f"written by {who}" in found.text
        assert found.cure == (f"chmod go-w {base}" if mode == 0o777 else "export NUMBA_CACHE_DIR=DIR of your own")
    else:
        assert not bad(storage.cache_owner(machine))
    assert not bad(storage.cache_owner(make_machine({}, {"NUMBA_CACHE_DIR": str(base / "absent")})))


def test_a_cache_of_a_group_or_of_somebody_else(make_machine, tmp_path, monkeypatch):
    base = tmp_path / "kernels"
    base.mkdir()
    base.chmod(0o775)
    machine = make_machine({}, {"NUMBA_CACHE_DIR": str(base)})
    monkeypatch.setattr(storage, "_private", lambda group: False)
    assert "written by your group" in only(storage.cache_owner(machine)).text
    monkeypatch.setattr(storage, "_private", lambda group: True)
    assert not bad(storage.cache_owner(machine))
    monkeypatch.setattr(os, "getuid", lambda: base.stat().st_uid + 1)
    if base.stat().st_uid:  # what is root's is as safe as the system
        assert "belongs to" in only(storage.cache_owner(machine)).text
    else:
        os.chown(base, 54321, -1)
        assert "belongs to user 54321" in only(storage.cache_owner(machine)).text


def test_where_the_kernels_are(make_machine, tmp_path, monkeypatch):
    base = tmp_path / "kernels"
    folder = base / "1-numba"
    machine = make_machine({}, {"NUMBA_CACHE_DIR": str(base)})
    monkeypatch.setattr(storage, "store_of", lambda environ: (folder, True))
    (found,) = storage.cache(machine)
    assert "no kernels of this version" in found.text and found.cure == "hpcdem warmup"
    (folder / "a").mkdir(parents=True)
    (folder / "a" / "k.nbc").write_bytes(bytes(2048))
    (folder / "ready-blocks-0").write_bytes(b"")
    (found,) = storage.cache(machine)
    assert f"{folder} (ext4): 1 entries" in found.text

    monkeypatch.setattr(storage, "store_of", lambda environ: (folder, False))
    assert "cannot be written" in only(storage.cache(machine)).text


def test_one_cache_for_many_hosts(make_machine, tmp_path, monkeypatch):
    monkeypatch.setattr(storage, "store_of", lambda environ: (tmp_path / "1-numba", True))
    nfs, environ = {"proc/self/mountinfo": NFS.format("/")}, {"NUMBA_CACHE_DIR": str(tmp_path)}
    two = places(1, host="a") + places(1, host="b")
    assert "2 hosts will read it" in only(storage.cache(make_machine(nfs, environ, places=two))).text
    assert not bad(storage.cache(make_machine(nfs, environ)))
    assert not bad(storage.cache(make_machine({}, environ, places=two)))


def test_what_threads_run_on(make_machine, monkeypatch):
    monkeypatch.setattr(launch, "openmp_runtime_found", lambda: True)
    assert not bad(software.threads(make_machine()))
    assert "unset" in only(software.threads(make_machine({}, {"NUMBA_THREADING_LAYER": "tbb"}))).cure
    monkeypatch.setattr(launch, "openmp_runtime_found", lambda: False)
    assert "libgomp" in only(software.threads(make_machine())).text


# -- software ------------------------------------------------------------------------------------------------------


@pytest.fixture
def install(monkeypatch) -> Callable[..., None]:
    """`install(versions, needs, load)`: these packages, what they need of each other, and how they are loaded."""

    def absent(name: str) -> object:
        raise ImportError(name)

    def do(versions=None, needs=None, load=absent) -> None:
        versions = {"hpcdem": "1", **(versions or {})}
        own = ["numpy>=1.24", "numba>=0.59", 'mpich>=4.2; extra == "mpi"', "not a requirement !"]
        required = {"hpcdem": own, **(needs or {})}

        def version(name: str) -> str:
            if name not in versions:
                raise importlib.metadata.PackageNotFoundError(name)
            return versions[name]

        def requires(name: str) -> list[str] | None:
            version(name)
            return required.get(name)

        error = importlib.metadata.PackageNotFoundError
        found = SimpleNamespace(version=version, requires=requires, PackageNotFoundError=error)
        monkeypatch.setattr(software, "metadata", found)
        monkeypatch.setattr(software, "load", load)

    return do


@pytest.mark.parametrize(
    ("versions", "needs", "text", "cure"),
    [
        ({"numpy": "2.1.0", "numba": "0.61"}, {}, "", ""),
        ({"numpy": "2.1.0"}, {}, "numba is not installed", 'pip install "numba>=0.59"'),
        ({"numpy": "1.23.9", "numba": "0.61"}, {}, "hpcdem needs numpy>=1.24, and numpy 1.23.9 is installed",
         'pip install "numpy>=1.24"'),
        ({"numpy": "2.5.0", "numba": "0.61"}, {"numba": ["numpy<2.3,>=1.24", 'tbb; extra == "fast"']},
         "numba needs numpy<2.3,>=1.24, and numpy 2.5.0 is installed", 'pip install "numpy<2.3,>=1.24"'),
        ({"numpy": "2.5.0rc1", "numba": "0.61.0.dev0"}, {"numba": ["numpy<3"]}, "", ""),
    ],
)  # fmt: skip
def test_versions(make_machine, install, versions, needs, text, cure):
    install(versions, needs)
    if text:
        found = only(software.packages(make_machine()))
        assert (found.level, found.text, found.cure) == (Level.PROBLEM, text, cure)
    else:
        python, found = software.packages(make_machine())
        assert f"Python {platform.python_version()}" in python.text and found.level == Level.OK
        assert f"numpy {versions['numpy']}" in found.text and "mpich" not in found.text


def test_a_package_without_a_description_says_its_version_itself(make_machine, install):
    """As Debian's h5py, whose two builds are described under names of their own."""
    install({"numpy": "2.1.0"}, load=lambda name: SimpleNamespace(__version__="0.58"))
    assert "hpcdem needs numba>=0.59, and numba 0.58 is installed" == only(software.packages(make_machine())).text
    install({"numpy": "2.1.0"}, load=lambda name: SimpleNamespace(__version__="0.61"))
    assert list(software.packages(make_machine()))[-1] == ok("packages", "numpy 2.1.0, numba 0.61")
    install({"numpy": "2.1.0"}, load=lambda name: SimpleNamespace())
    assert only(software.packages(make_machine())).text == "numba is not installed"


def test_a_source_tree_that_is_not_installed(make_machine, install):
    install(needs={"hpcdem": []})
    assert "hpcdem is not installed" in only(software.packages(make_machine())).text


def test_the_declared_needs_are_those_of_pyproject():
    assert {"numpy", "numba", "h5py"} <= {need.name for need in software._needs("hpcdem")}


def loads(h5py_with_mpi: bool = False, **broken: str) -> Callable[[str], object]:
    about = SimpleNamespace(version="3.16.0", hdf5_version="1.14.6")

    def load(name: str) -> object:
        if name in broken:
            raise ImportError(broken[name])
        return SimpleNamespace(version=about, get_config=lambda: SimpleNamespace(mpi=h5py_with_mpi))

    return load


def test_packages_that_cannot_be_loaded(make_machine, install, monkeypatch):
    install(load=loads())
    assert not bad(software.libraries(make_machine()))
    install(load=loads(scipy="libgfortran.so.5: cannot open shared object\nmore"))
    assert only(software.libraries(make_machine())).text == (
        "scipy cannot be loaded: libgfortran.so.5: cannot open shared object"
    )
    install(load=loads(matplotlib="'qt' is no backend"))
    assert only(software.libraries(make_machine({}, {"MPLBACKEND": "qt"}))).cure == "unset MPLBACKEND"
    install(load=loads(h5py="x"))
    assert not any(found.topic == "HDF5" for found in software.libraries(make_machine()))
    install(load=loads())
    monkeypatch.setattr(software, "PATIENT", -1.0)
    assert "slow file system" in only(software.libraries(make_machine())).text


@pytest.mark.parametrize(
    ("with_mpi", "text"), [(True, "with MPI: all ranks"), (False, "without MPI: files go through")]
)
def test_hdf5_with_and_without_mpi(make_machine, install, with_mpi, text):
    install(load=loads(with_mpi))
    (found,) = (found for found in software.libraries(make_machine()) if found.topic == "HDF5")
    assert found.level == Level.OK and text in found.text and bool(found.cure) is not with_mpi


def test_films(make_machine, install, monkeypatch):
    install(load=loads())
    monkeypatch.setattr(software, "find_spec", nothing)
    *_, film = software.libraries(make_machine())
    assert film.topic == "films" and film.cure == "pip install imageio-ffmpeg"
    *_, film = software.libraries(make_machine(which=lambda name: f"/usr/bin/{name}"))
    assert film.text == "ffmpeg: /usr/bin/ffmpeg"
    monkeypatch.setattr(software, "find_spec", lambda name: name)
    *_, film = software.libraries(make_machine())
    assert film.text == "ffmpeg: of imageio-ffmpeg"


def test_petsc(make_machine, install, monkeypatch):
    install({"petsc4py": "3.22"})
    monkeypatch.setattr(software, "find_spec", nothing)
    (found,) = software.petsc(make_machine())
    assert found.level == Level.OK and "not installed" in found.text
    monkeypatch.setattr(software, "find_spec", lambda name: name)
    assert [f.text for f in software.petsc(make_machine(run=answers(**{PYTHON: (0, "", "")})))] == [
        "petsc4py 3.22 loads"
    ]
    failed = (1, "", "Traceback\nImportError: libpetsc.so: no such file\n")
    assert "libpetsc.so: no such file" in only(software.petsc(make_machine(run=answers(**{PYTHON: failed})))).text


# -- MPI -----------------------------------------------------------------------------------------------------------


def test_the_library(make_machine):
    (found,) = software.mpi_library(make_machine(run=answers(**{PYTHON: (0, f"\n{MPICH}\nmore\n", "")})))
    assert found.text == f"{MPICH}; 1 rank on a, started without a launcher"
    four = make_machine(library=MPICH, places=places(2) + places(2, host="b"), launcher=Launcher("Slurm", 4, 0))
    assert [f.text for f in software.mpi_library(four)] == [f"{MPICH}; 4 ranks on 2 hosts, started by Slurm"]
    none = make_machine(run=answers(**{PYTHON: (1, "", "ImportError: cannot load MPI library\n")}))
    assert "only one rank is possible: ImportError: cannot load MPI library" in only(software.mpi_library(none)).text


def test_a_launch_that_a_run_would_refuse(make_machine):
    who = Launcher("Slurm", 4, 0)
    refused = make_machine(library=OPEN_MPI, launcher=who, refusal=launch.copies_of_rank_0(who, OPEN_MPI))
    found = only(software.mpi_library(refused))
    assert found.level == Level.PROBLEM and "rank 0 of 1" in found.text and found.cure == "Open MPI's own mpiexec"
    assert not list(software.mpi_launcher(refused))
    unloaded = make_machine(launcher=who, refusal="mpi4py finds no MPI library")
    assert only(software.mpi_library(unloaded)).cure == "pip install mpich"


@pytest.mark.parametrize(
    ("answer", "level", "text"),
    [
        ((0, "hpcdem sees 2\nhpcdem sees 2\n", ""), None, "starts two ranks"),
        ((0, "hpcdem sees 1\nhpcdem sees 1\n", ""), Level.PROBLEM, "does not belong to the MPI library"),
        ((1, "", "--\nmpiexec has detected an attempt\nto run as root.\n--\n"), Level.WARNING, "attempt to run as"),
        ((213, "", ""), Level.WARNING, "exit code 213"),
    ],
)  # fmt: skip
def test_the_launcher_of_the_path_is_tried(make_machine, monkeypatch, answer, level, text):
    monkeypatch.setattr(sys, "executable", "/nowhere/bin/python")
    machine = make_machine(library=OPEN_MPI, which=lambda name: f"/opt/bin/{name}", run=answers(mpiexec=answer))
    (found,) = software.mpi_launcher(machine)
    assert found.level == (level or Level.OK) and text in found.text
    machine.launcher = Launcher("Open MPI", 2, 0)
    assert not list(software.mpi_launcher(machine)), "ranks that run need no trial"


def test_the_right_launcher_is_at_hand(make_machine, monkeypatch, tmp_path):
    """It lies beside python, as that of a wheel does: a run can work, so this is only a warning."""
    (tmp_path / "mpiexec").touch()
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    ask = answers(mpiexec=(0, "hpcdem sees 1\n", ""))
    found = only(software.mpi_launcher(make_machine(library=MPICH, which=lambda name: f"/usr/bin/{name}", run=ask)))
    assert found.level == Level.WARNING and found.cure == f"{tmp_path}/mpiexec -n 2 hpcdem ..."
    (found,) = software.mpi_launcher(make_machine(library=MPICH, run=answers(mpiexec=(0, "hpcdem sees 2\n", ""))))
    assert found.level == Level.OK and found.cure == f"export PATH={tmp_path}:$PATH"


def test_no_launcher_at_all(make_machine, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nowhere/bin/python")
    assert "mpiexec is not in" in only(software.mpi_launcher(make_machine(library=MPICH))).text
    assert not list(software.mpi_launcher(make_machine(library=MPICH, places=places(1, cores=1))))


def test_other_programs_see_no_launcher(make_machine):
    """A program that starts MPI would take itself for a rank, and the launcher would end the job with it."""
    seen = {}

    def ask(command, env, **how):
        seen.update(env)
        return subprocess.CompletedProcess(command, 0, "", "")

    environ = {"PMI_SIZE": "2", "PMI_FD": "7", "OMPI_COMM_WORLD_SIZE": "2", "SLURM_PROCID": "1", "PATH": "/bin"}
    make_machine({}, environ, run=ask).run(["true"])
    assert seen.keys() == {"PATH", "NUMBA_CACHE_DIR"} and seen["PATH"] == "/bin"


def test_programs_that_do_not_answer(make_machine):
    def hangs(command, timeout, **how):
        raise subprocess.TimeoutExpired(command, timeout)

    assert make_machine(run=hangs).run(["squeue"])[0] == 124 and make_machine().run(["squeue"])[0] == 127


# -- Slurm ---------------------------------------------------------------------------------------------------------

JOB = {"SLURM_JOB_ID": "7"}
SIGNAL = "#!/bin/bash\n#SBATCH --ntasks=4\n#SBATCH --signal=USR1@300  # five minutes\nsrun hpcdem push.py\n"


def test_nothing_is_reported_outside_a_job(make_machine):
    for look in (host.slurm_end, host.sbatch_cores, software.slurm_mpi_type):
        assert not list(look(make_machine(library=MPICH)))


@pytest.mark.parametrize(
    ("environ", "programs", "text"),
    [
        ({"SLURM_JOB_END_TIME": "1900000000"}, {}, "job 7 ends at 2030-"),
        ({}, {"squeue": (0, "2030-01-02T03:04:05\n", "")}, "job 7 ends at 2030-01-02 03:04"),
        ({}, {"squeue": (0, "2030-01-02T03:04:05\n", ""), "scontrol": (0, SIGNAL, "")}, "requests the signal USR1@300"),
        ({}, {"scontrol": (0, SIGNAL, "")}, "the end of job 7 is unknown"),
        ({}, {"scontrol": (0, SIGNAL.replace("#SBATCH --signal", "## --signal"), "")}, None),
        ({}, {"squeue": (1, "", "no controller")}, None),
        ({}, {"squeue": (0, "Unknown\n", "")}, None),
    ],
)
def test_the_end_of_the_job(make_machine, environ, programs, text):
    (found,) = host.slurm_end(make_machine({}, JOB | environ, run=answers(**programs)))
    if text is None:
        assert (
            found.level == Level.WARNING and "the last steps would be lost" in found.text and "--signal" in found.cure
        )
    else:
        assert found.level == Level.OK and text in found.text


@pytest.mark.parametrize(
    ("environ", "warned"),
    [
        ({"SLURM_CPUS_PER_TASK": "4"}, True),
        ({"SLURM_CPUS_PER_TASK": "4", "SRUN_CPUS_PER_TASK": "4"}, False),
        ({"SLURM_CPUS_PER_TASK": "1"}, False),
        ({"SLURM_CPUS_PER_TASK": "4", "SLURM_STEP_ID": "0"}, False),  # in a step its cores are counted
    ],
)
def test_cores_that_srun_does_not_take_from_sbatch(make_machine, environ, warned):
    found = bad(host.sbatch_cores(make_machine({}, JOB | environ)))
    assert [f.cure for f in found] == ["export SRUN_CPUS_PER_TASK=$SLURM_CPUS_PER_TASK"] * warned


LIST = "MPI plugin types are...\n\tpmix\n\tpmi2\n\tnone\nspecific pmix plugin versions available: pmix_v4\n"


@pytest.mark.parametrize(
    ("library", "chosen", "offered", "text"),
    [
        (OPEN_MPI, "pmix", LIST, None),
        (OPEN_MPI, "pmix_v4", LIST, None),
        (OPEN_MPI, "pmi2", LIST, "SLURM_MPI_TYPE=pmi2, but Open MPI v4.1.4 requires pmix"),
        (MPICH, "pmi2", LIST, None),
        (MPICH, "none", LIST, "requires pmi2"),
        (OPEN_MPI, "", LIST, None),
        (OPEN_MPI, "", "MPI plugin types are...\n\tpmi2\n", "this Slurm has no --mpi=pmix"),
        (OPEN_MPI, "", "", None),
    ],
)
def test_how_srun_tells_the_ranks_about_each_other(make_machine, library, chosen, offered, text):
    environ = JOB | ({"SLURM_MPI_TYPE": chosen} if chosen else {})
    machine = make_machine({}, environ, library=library, run=answers(srun=(0, "", offered)))
    if text is None:
        assert not bad(software.slurm_mpi_type(machine))
    else:
        assert text in only(software.slurm_mpi_type(machine)).text
    machine.places = places(2)
    assert not list(software.slurm_mpi_type(machine)), "ranks that see each other need no advice"


# -- the program ---------------------------------------------------------------------------------------------------


def test_the_table_has_one_line_per_finding():
    findings = [problem("MPI", "a [bold]long[/] text " * 20, "type this"), ok("cores", "core 3"), warning("x", "y\nz")]
    out = io.StringIO()
    assert program.report(findings, out) == 1
    lines = out.getvalue().splitlines()
    (line,) = (line for line in lines if "problem" in line and "MPI" in line)
    assert "a [bold]long[/] text" in line and line.rstrip().endswith("type this")
    assert any("y z" in line for line in lines) and "1 problem, 1 warning" in lines[-1]
    assert [line.split()[0] for line in lines if line.split()[1:2] and line.split()[1] in ("cores", "x", "MPI")] == [
        "ok", "warning", "problem",
    ]  # fmt: skip


def test_warnings_are_no_problem():
    assert program.report([warning("a", "b", "c"), ok("d", "e")], io.StringIO()) == 0
    assert program.report([], io.StringIO()) == 0
    out = io.StringIO()
    program.report([ok("d", "e")], out)
    assert out.getvalue().endswith("no problems\n")


def test_help_says_the_exit_codes():
    assert "Exit codes: 0 no" in CliRunner().invoke(program.doctor, ["--help"]).output


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.mpi)])
def test_the_doctor_comes(launch, tmp_path, ranks):
    """On one rank and on two: one table, nothing left behind."""
    done = launch(ranks, "doctor", "--dir", tmp_path, cwd=tmp_path, timeout=240)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr and "itself failed" not in done.stdout
    assert done.stdout.count("hpcdem ") >= 1 and done.stdout.count("1 MiB is safe") == 2
    assert f"{ranks} rank{'s' * (ranks > 1)} on" in done.stdout and "numpy" in done.stdout
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".hpcdem")]


def test_a_problem_is_exit_code_1(launch, tmp_path):
    done = launch(1, "doctor", "--dir", "/proc/self/fdinfo", cwd=tmp_path, timeout=240)
    assert done.returncode == 1 and "cannot make a folder" in done.stdout and done.stderr == ""


@pytest.mark.mpi
@pytest.mark.parametrize(("rank", "code"), [(0, 1), pytest.param(3, 0, marks=pytest.mark.slow)])
def test_copies_of_rank_0_are_a_finding(launch, tmp_path, rank, code):
    """A launcher of another MPI says 4, MPI says 1: a run refuses that, the doctor says it. Only one copy speaks."""
    strange = {"MV2_COMM_WORLD_SIZE": "4", "MV2_COMM_WORLD_RANK": str(rank)}
    done = launch(1, "doctor", "--dir", tmp_path, env=strange, cwd=tmp_path, timeout=240)
    assert done.returncode == code, done.stderr
    assert ("MVAPICH started 4 processes" in done.stdout and "1 problem" in done.stdout) is (rank == 0)


LIMITED = """
import resource, runpy, sys
resource.setrlimit(resource.RLIMIT_CPU, (900, 900))
sys.argv = ["hpcdem", "nothing.py"]
runpy.run_module("hpcdem", run_name="__main__")
"""


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.mpi)])
def test_a_run_warns_at_its_start(launch, tmp_path, ranks):
    """The log of a run has what the table of checks finds, whatever becomes of the run."""
    done = launch.python(ranks, "-c", LIMITED, cwd=tmp_path, timeout=120)
    assert done.returncode == 2 and "nothing.py: no such script" in done.stderr
    assert done.stdout.count("warning: a process is killed after 900 s of processor time") == 1
