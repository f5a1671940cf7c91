"""The doctor: each finding is made to appear and to disappear, on a machine of files that the test writes."""

from __future__ import annotations

import errno
import importlib.metadata
import io
import os
import re
import resource
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from hpcdem.cli import doctor as program
from hpcdem.halo.comm import SerialComm
from hpcdem.runtime import doctor, launch
from hpcdem.runtime.doctor import CHECKS, Level, Scene, cgroups, cores, host, kernels, mpi, slurm, software, storage
from hpcdem.runtime.doctor.findings import Finding, merged, named, ok, problem, size, warning
from hpcdem.runtime.doctor.mounts import existing, mount_of
from hpcdem.runtime.doctor.scene import Disk, Software
from hpcdem.runtime.launch import Launcher, Place

DISK = "20 1 8:1 / / rw,relatime - ext4 /dev/sda1 rw\n"
NFS = "30 20 0:40 / {} rw,relatime shared:1 - nfs4 server:/home rw,vers=4.2\n"
NO_LIMIT = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
OPEN_MPI, MPICH = "Open MPI v4.1.4", "MPICH Version: 5.0.2"


def places(n: int = 1, cores: int = 4, threads: int = 1, host: str = "a", first: int = 0) -> list[Place]:
    return [Place(host, cores, frozenset(range(first, first + cores)), threads) for _ in range(n)]


@pytest.fixture
def machine(tmp_path) -> Callable[..., Scene]:
    """`machine(files, environ, **attributes)`: a healthy machine with these files under its root; `machine.root`."""
    root, results = tmp_path / "root", tmp_path / "results"
    results.mkdir()

    def make(files: dict[str, str] | None = None, environ: dict[str, str] | None = None, **attributes) -> Scene:
        shutil.rmtree(root, ignore_errors=True)
        for name, text in {"proc/self/mountinfo": DISK, **(files or {})}.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        surroundings = {"NUMBA_CACHE_DIR": str(tmp_path / "kernels"), **(environ or {})}
        scene = Scene(places(), root=root, directory=results, temporary=results, environ=surroundings)
        scene.encodings = lambda: {"output": "utf-8"}
        scene.limits = lambda number: NO_LIMIT
        scene.ask = no_program
        scene.which = lambda name: None
        for name, value in attributes.items():
            setattr(scene, name, value)
        return scene

    return make


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


def test_every_check_of_the_table_is_there():
    for check in CHECKS:
        module, _, function = check.name.partition(".")
        found = getattr(__import__(f"hpcdem.runtime.doctor.{module}", fromlist=[function]), function)
        assert found.__doc__, check.name
    assert len({check.name for check in CHECKS}) == len(CHECKS)


def test_a_healthy_machine_starts_in_silence(machine):
    assert doctor.start_warnings(machine(), SerialComm()) == []


def test_the_start_costs_next_to_nothing(machine, tmp_path):
    """Less than 5 ms on the machine at hand, after the modules are loaded; and no file is written."""
    taken = []
    for _ in range(7):
        scene = Scene(places(64), directory=tmp_path)
        began = time.perf_counter()
        doctor.start_warnings(scene, SerialComm())
        taken.append(time.perf_counter() - began)
    assert min(taken[1:]) < 5e-3

    scene = machine(directory=tmp_path / "not" / "yet")
    before = sorted(tmp_path.rglob("*"))
    doctor.start_warnings(scene, SerialComm())
    assert sorted(tmp_path.rglob("*")) == before


def test_what_is_wrong_at_the_start_is_said_once(machine):
    scene = machine({"proc/meminfo": "MemAvailable: 100 kB\n"}, places=places(2))
    (line,) = doctor.start_warnings(scene, SerialComm())
    assert line.startswith("50 KiB of memory for each of 2 ranks (free 100 KiB): a rank takes") and "Cure: " in line


def test_a_check_that_fails_ends_nothing(machine):
    def broken(number):
        raise ValueError("a limit nobody has heard of")

    scene = machine(limits=broken)
    assert doctor.start_warnings(scene, SerialComm()) == []
    texts = [finding.text for _, _, finding in doctor.look(scene)]
    assert "the check host.shell_limits itself failed: ValueError: a limit nobody has heard of" in texts


def test_findings_of_hosts_are_put_together():
    slow, full = warning("x", "slow"), problem("y", "full")
    of_ranks = [[(0, False, ok("z", "job")), (2, True, full), (3, True, slow)], [], [(3, True, slow)]]
    assert merged(of_ranks, ["a", "a", "b"]) == [ok("z", "job"), problem("y", "a: full"), slow]
    assert merged([[(2, True, full)]], ["a"]) == [full]
    assert named("abcdef") == "a, b, c, d and 2 more"


def test_sizes_as_people_write_them():
    assert [size(n) for n in (0, 512, 4 << 20, 1.5 * (1 << 30), 1 << 50)] == [
        "0 B", "512 B", "4 MiB", "1.5 GiB", "1.02e+03 TiB",
    ]  # fmt: skip


def test_every_host_has_one_rank_that_looks():
    scene = Scene(places(2, host="a") + places(2, host="b"))
    firsts = []
    for scene.rank in range(4):
        firsts.append(scene.first_of_host)
    assert firsts == [True, False, True, False] and scene.hosts == ["a", "b"]


# -- cores: more in test_runtime_launch ----------------------------------------------------------------------------


def test_ranks_bound_to_one_core_while_others_are_idle(machine):
    bound = places(2, cores=1) + places(1, cores=3, first=1)
    found = only(cores.crowded(machine(places=bound)))
    assert "2 ranks are bound to the same 1 of the 4 cores" in found.text and "bind-to none" in found.cure
    apart = [Place("a", 1, frozenset([core]), 1) for core in range(3)]
    assert not bad(cores.crowded(machine(places=apart)))


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
def test_a_quota_of_processor_time(machine, files, expected):
    scene = machine(files, places=places(3, cores=8))
    assert cgroups.cpu_quota(scene) == expected
    found = bad(cores.quota(scene))
    assert len(found) == (expected is not None)
    if found:
        assert f"the time of {expected:g} cores" in found[0].text
        assert found[0].cure.startswith(f"mpiexec -n {max(1, int(expected))} ")


def test_a_quota_as_wide_as_the_ranks_need(machine):
    files = {"proc/self/mountinfo": CGROUP2, "proc/self/cgroup": "0::/", "sys/fs/cgroup/cpu.max": "300000 100000"}
    assert not bad(cores.quota(machine(files, places=places(3, cores=8))))
    assert any("3 cores" in f.text for f in cores.mapping(machine(files, places=places(3, cores=8))))


def test_where_the_ranks_are():
    (found,) = cores.mapping(Scene(places(2, 2) + places(1, 2, first=4), root=Path("/nowhere")))
    assert found.text == "rank 0 cores 0-1; rank 1 cores 0-1; rank 2 cores 4-5"
    assert cores.core_list([3]) == "core 3" and cores.core_list([8, 0, 1, 2]) == "cores 0-2,8"


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
def test_memory(machine, files, environ, level, text):
    scene = machine(files, environ, places=places(2))
    if level is None:
        assert not bad(host.memory(scene))
    else:
        found = only(host.memory(scene))
        assert found.level == level and text in found.text
        assert ("--mem-per-cpu" in found.cure) == ("SLURM_JOB_ID" in environ)
        assert not list(host.memory_said(scene))


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
def test_limits_of_the_shell(machine, name, little, enough, text):
    def limited(to):
        def limits(number):
            return (to, to) if number == getattr(resource, f"RLIMIT_{name}") else NO_LIMIT

        return limits

    two_hosts = places(1, host="a") + places(1, host="b")
    files = {"sys/class/infiniband/mlx5_0": ""}
    found = only(host.shell_limits(machine(files, limits=limited(little), places=two_hosts)))
    assert text in found.text and "ulimit -" in found.cure
    assert not bad(host.shell_limits(machine(files, limits=limited(enough), places=two_hosts)))
    if name == "MEMLOCK":
        assert not bad(host.shell_limits(machine({}, limits=limited(little), places=two_hosts)))
        assert not bad(host.shell_limits(machine(files, limits=limited(little))))


def test_core_files(machine):
    texts = [f.text for f in host.shell_limits_said(machine())]
    assert texts[0].startswith("open files unlimited, core files unlimited") and "core file as large" in texts[1]
    none = machine(limits=lambda number: (0, 0))
    assert len(list(host.shell_limits_said(none))) == 1


def test_clocks(machine):
    assert not bad(host.clocks(machine()))
    assert not bad(host.clocks(machine(clocks=[100.0, 104.0])))
    assert "long ago" in only(host.clocks(machine(now=lambda: 3600.0))).text
    assert "differ by 60 s" in only(host.clocks(machine(clocks=[100.0, 160.0, 101.0]))).text


def test_files_from_the_future(machine):
    scene = machine()
    (scene.directory / "0000000100.sav").touch()
    assert not bad(storage.future_files(scene))
    tomorrow = time.time() + 86400.0
    os.utime(scene.directory / "0000000100.sav", (tomorrow, tomorrow))
    found = only(storage.future_files(scene))
    assert "1 files" in found.text and "0000000100.sav" in found.text and found.cure.endswith("0000000100.sav")
    assert not bad(storage.future_files(machine(directory=scene.directory / "nowhere")))


@pytest.mark.parametrize(
    ("output", "names", "wrong"),
    [("utf-8", "UTF8", False), ("ascii", "utf-8", True), ("utf-8", "latin1", True), ("no code", "utf-8", True)],
)
def test_text(machine, output, names, wrong):
    found = bad(host.text(machine(encodings=lambda: {"output": output, "file names": names})))
    assert [f.cure for f in found] == ["export LC_ALL=C.UTF-8"] * wrong


# -- file systems --------------------------------------------------------------------------------------------------


def test_the_mount_of_a_path(tmp_path):
    (tmp_path / "a b" / "c").mkdir(parents=True)
    escaped = str(tmp_path / "a b").replace(" ", "\\040")
    table = DISK + NFS.format(escaped) + "short line\n" + NFS.format("/somewhere/else")
    assert mount_of(tmp_path, table).kind == "ext4"
    found = mount_of(tmp_path / "a b" / "c", table)
    assert (found.kind, found.source, found.network, found.point) == (
        "nfs4",
        "server:/home",
        True,
        str(tmp_path / "a b"),
    )
    hidden = table + f"31 20 0:41 / {escaped} ro - tmpfs tmpfs rw\n"  # mounted over it later
    assert mount_of(tmp_path / "a b" / "c", hidden).in_memory and mount_of(tmp_path / "a b", hidden).read_only
    assert mount_of(tmp_path / "a bc", table).kind == "ext4"
    assert mount_of(tmp_path, "") is None
    assert existing(tmp_path / "a b" / "not" / "yet") == tmp_path / "a b"


@pytest.mark.parametrize(
    ("kind", "network"),
    [("nfs", True), ("lustre", True), ("fuse.sshfs", True), ("ext4", False), ("overlay", False),
     ("fuse.squashfuse", False)],
)  # fmt: skip
def test_network_file_systems(tmp_path, kind, network):
    assert mount_of(tmp_path, f"20 1 8:1 / / rw - {kind} x rw\n").network is network


def test_results_in_memory_or_on_a_disk_that_cannot_be_written(machine):
    assert not bad(storage.kind(machine()))
    memory = machine({"proc/self/mountinfo": "20 1 8:1 / / rw - tmpfs tmpfs rw\n"})
    assert "in memory (tmpfs)" in only(storage.kind(memory)).text
    frozen = only(storage.kind(machine({"proc/self/mountinfo": "20 1 8:1 / / rw - ext4 /dev/sda ro\n"})))
    assert frozen.level == Level.PROBLEM and "read-only (ext4)" in frozen.text
    assert not bad(storage.kind(machine({"proc/self/mountinfo": ""})))


@pytest.mark.parametrize(("value", "warned"), [("FALSE", False), ("0", False), ("TRUE", True), ("BEST_EFFORT", True)])
def test_locks_of_hdf5_on_a_network_file_system(machine, value, warned):
    nfs = {"proc/self/mountinfo": NFS.format("/")}
    found = bad(storage.locking_of_hdf5(machine(nfs, {"HDF5_USE_FILE_LOCKING": value})))
    assert [f.cure for f in found] == ["export HDF5_USE_FILE_LOCKING=FALSE"] * warned
    assert not bad(storage.locking_of_hdf5(machine({}, {"HDF5_USE_FILE_LOCKING": value})))
    assert not bad(storage.locking_of_hdf5(machine(nfs)))


def room(free: int = 1 << 40, inodes: int = 10**6, counted: bool = True) -> Disk:
    found = SimpleNamespace(
        f_bavail=free // 4096, f_frsize=4096, f_blocks=1 << 30, f_favail=inodes, f_files=10**7 if counted else 0
    )
    return Disk(statvfs=lambda path: found)


@pytest.mark.parametrize(
    ("disk", "level", "text"),
    [
        (room(), None, ""),
        (room(free=500 << 20), Level.WARNING, "only 500 MiB free"),
        (room(free=4 << 20), Level.PROBLEM, "4 MiB free"),
        (room(inodes=12), Level.WARNING, "room for only 12 more files"),
        (room(inodes=0, counted=False), None, ""),
    ],
)
def test_room(machine, disk, level, text):
    scene = machine(disk=disk)
    for look in (storage.free_space, storage.temporary):
        if level is None:
            assert not bad(look(scene))
        else:
            found = only(look(scene))
            assert found.level == level and text in found.text


def test_a_file_system_that_does_not_answer(machine):
    def stale(path):
        raise OSError(errno.ESTALE, "Stale file handle")

    assert "Stale file handle" in only(storage.free_space(machine(disk=Disk(statvfs=stale)))).text


def fails(number: int) -> Callable[..., None]:
    def call(*arguments):
        raise OSError(number, os.strerror(number))

    return call


@pytest.mark.parametrize(
    ("disk", "level", "text"),
    [
        (Disk(), None, ""),
        (Disk(fsync=fails(errno.EIO)), Level.PROBLEM, "cannot bring a file to the disk (fsync): Input/output error"),
        (Disk(replace=fails(errno.EPERM)), Level.PROBLEM, "cannot rename a file: Operation not permitted"),
        (Disk(flock=fails(errno.ENOSYS)), Level.WARNING, "locks of files do not work (Function not implemented)"),
        (Disk(lockf=fails(errno.ENOLCK)), Level.WARNING, "locks of files do not work (No locks available)"),
        (Disk(flock=lambda file, how: None), Level.WARNING, "two can have the same lock"),
    ],
)
def test_what_a_run_does_with_files(machine, disk, level, text):
    scene = machine(disk=disk)
    if level is None:
        (found,) = storage.results(scene)
        assert re.search(r"\(ext4\): .* free, 1 MiB is safe in [\d.e+]+ ms$", found.text)
    else:
        found = only(storage.results(scene))
        assert found.level == level and text in found.text
    assert not list(scene.directory.iterdir()), "it cleans up behind itself"


def test_a_slow_disk(machine, monkeypatch):
    monkeypatch.setattr(storage, "SLOW", 0.02)
    slow = machine(disk=Disk(fsync=lambda handle: time.sleep(0.03)))
    assert "checkpoints will wait" in only(storage.results(slow)).text
    assert not bad(storage.results(machine(disk=Disk(fsync=lambda handle: None))))


def test_a_file_server_with_another_clock(machine):
    found = only(storage.results(machine(now=lambda: time.time() - 100.0)))
    assert "100 s in the future" in found.text
    assert "100 s in the past" in only(storage.results(machine(now=lambda: time.time() + 100.0))).text


def test_a_folder_that_cannot_be_written(machine, tmp_path):
    scene = machine(directory=Path("/proc/self/fdinfo"))
    assert "cannot make a folder" in only(storage.results(scene)).text
    assert not bad(storage.results(machine(directory=tmp_path / "not" / "yet")))


QUOTA = "Disk quotas for user me (uid 7):\n  Filesystem blocks quota limit grace\n server:/home 5000* 4000 6000 6days\n"


def test_a_quota_that_is_used_up(machine):
    scene = machine(which=lambda name: f"/usr/bin/{name}", ask=answers(quota=(1, QUOTA, "")))
    assert "server:/home is used up: 5000* 4000 6000" in only(storage.results(scene)).text
    scene.ask = answers(quota=(0, QUOTA.replace("*", ""), ""))
    assert not bad(storage.results(scene))
    scene.ask = no_program
    assert not bad(storage.results(scene))


class Second(SerialComm):
    """The second of two ranks, which is told of a file."""

    rank, size = 1, 2

    def __init__(self, told: Path) -> None:
        self.told = told

    def bcast(self, obj, root=0):
        return self.told


def test_hosts_that_see_different_folders(machine, tmp_path, monkeypatch):
    monkeypatch.setattr(doctor, "SOON", 0.0)
    scene = machine(places=places(host="a") + places(host="b"), rank=1)
    (tmp_path / "seen").touch()
    assert not doctor._one_file_system(scene, Second(tmp_path / "seen"))
    ((_, each_host, found),) = doctor._one_file_system(scene, Second(tmp_path / "unseen"))
    assert each_host and found.level == Level.PROBLEM and "is not seen" in found.text
    scene.places = places(2)
    assert not doctor._one_file_system(scene, Second(tmp_path / "unseen"))


# -- kernels -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("mode", "who"), [(0o700, ""), (0o755, ""), (0o777, "everyone"), (0o1777, "everyone")])
def test_a_cache_that_others_can_write(machine, tmp_path, mode, who):
    base = tmp_path / "kernels"
    base.mkdir()
    base.chmod(mode)
    scene = machine({}, {"NUMBA_CACHE_DIR": str(base)})
    if who:
        found = only(kernels.not_ours_alone(scene))
        assert f"written by {who}" in found.text
        assert found.cure == (f"chmod go-w {base}" if mode == 0o777 else "export NUMBA_CACHE_DIR=DIR of your own")
    else:
        assert not bad(kernels.not_ours_alone(scene))
    assert not bad(kernels.not_ours_alone(machine({}, {"NUMBA_CACHE_DIR": str(base / "absent")})))


def test_a_cache_of_a_group_or_of_somebody_else(machine, tmp_path, monkeypatch):
    base = tmp_path / "kernels"
    base.mkdir()
    base.chmod(0o775)
    scene = machine({}, {"NUMBA_CACHE_DIR": str(base)})
    monkeypatch.setattr(kernels, "_private", lambda group: False)
    assert "written by your group" in only(kernels.not_ours_alone(scene)).text
    monkeypatch.setattr(kernels, "_private", lambda group: True)
    assert not bad(kernels.not_ours_alone(scene))
    monkeypatch.setattr(os, "getuid", lambda: base.stat().st_uid + 1)
    if base.stat().st_uid:  # what is root's is as safe as the system
        assert "belongs to" in only(kernels.not_ours_alone(scene)).text
    else:
        os.chown(base, 54321, -1)
        assert "belongs to user 54321" in only(kernels.not_ours_alone(scene)).text


def test_where_the_kernels_are(machine, tmp_path, monkeypatch):
    base = tmp_path / "kernels"
    folder = base / "1-numba"
    scene = machine({}, {"NUMBA_CACHE_DIR": str(base)})
    monkeypatch.setattr(kernels, "cache_folder", lambda environ: (folder, True))
    (found,) = kernels.cache(scene)
    assert "no kernels of this version" in found.text and found.cure == "hpcdem warmup"
    (folder / "a").mkdir(parents=True)
    (folder / "a" / "k.1.nbc").write_bytes(bytes(2048))
    (folder / "a" / "k.nbi").write_bytes(bytes(1024))
    (found,) = kernels.cache(scene)
    assert f"{folder} (ext4): 1 entries, 3 KiB; all versions 3 KiB" in found.text

    monkeypatch.setattr(kernels, "cache_folder", lambda environ: (folder, False))
    assert "cannot be written" in only(kernels.cache(scene)).text


def test_one_cache_for_many_hosts(machine, tmp_path, monkeypatch):
    monkeypatch.setattr(kernels, "cache_folder", lambda environ: (tmp_path / "1-numba", True))
    nfs, environ = {"proc/self/mountinfo": NFS.format("/")}, {"NUMBA_CACHE_DIR": str(tmp_path)}
    two = places(1, host="a") + places(1, host="b")
    assert "2 hosts will read it" in only(kernels.cache(machine(nfs, environ, places=two))).text
    assert not bad(kernels.cache(machine(nfs, environ)))
    assert not bad(kernels.cache(machine({}, environ, places=two)))


def test_what_threads_run_on(machine, monkeypatch):
    monkeypatch.setattr(launch, "openmp_runtime_found", lambda: True)
    assert not bad(kernels.threads(machine()))
    assert "unset" in only(kernels.threads(machine({}, {"NUMBA_THREADING_LAYER": "tbb"}))).cure
    monkeypatch.setattr(launch, "openmp_runtime_found", lambda: False)
    assert "libgomp" in only(kernels.threads(machine())).text


# -- software ------------------------------------------------------------------------------------------------------


def packages(versions: dict[str, str], needs: dict[str, list[str]] | None = None, **more) -> Software:
    def version(name: str) -> str:
        if name not in versions:
            raise importlib.metadata.PackageNotFoundError(name)
        return versions[name]

    def load(name: str) -> object:
        raise ImportError(name)

    def requires(name: str) -> list[str]:
        version(name)
        return (needs or {}).get(name)

    declared = (">=3.11", ["numpy>=1.24", "numba>=0.59", 'mpich>=4.2; extra == "mpi"', "not a requirement !"])
    return Software(
        declared=lambda: declared,
        version=version,
        requires=requires,
        python=(3, 11, 7),
        **{"load": load, **more},
    )


@pytest.mark.parametrize(
    ("versions", "needs", "text", "cure"),
    [
        ({"numpy": "2.1.0", "numba": "0.61"}, {}, "", ""),
        ({"numpy": "2.1.0"}, {}, "numba is not installed", 'pip install "numba>=0.59"'),
        ({"numpy": "1.23.9", "numba": "0.61"}, {}, "numpy 1.23.9 is installed, numpy>=1.24 is needed",
         'pip install --upgrade "numpy>=1.24"'),
        ({"numpy": "2.5.0", "numba": "0.61"}, {"numba": ["numpy<2.3,>=1.24", 'tbb; extra == "fast"']},
         "numba needs numpy<2.3,>=1.24, and numpy 2.5.0 is installed", 'pip install "numpy<2.3,>=1.24"'),
        ({"numpy": "2.5.0rc1", "numba": "0.61.0.dev0"}, {"numba": ["numpy<3"]}, "", ""),
    ],
)  # fmt: skip
def test_versions(machine, versions, needs, text, cure):
    scene = machine(software=packages(versions, needs))
    if text:
        found = only(software.packages(scene))
        assert (found.level, found.text, found.cure) == (Level.PROBLEM, text, cure)
    else:
        (found,) = software.packages(scene)
        assert found.level == Level.OK and f"numpy {versions['numpy']}" in found.text and "mpich" not in found.text


def test_a_package_without_a_description_says_its_version_itself(machine):
    """As Debian's h5py, whose two builds are described under names of their own."""
    old = packages({"numpy": "2.1.0"}, load=lambda name: SimpleNamespace(__version__="0.58"))
    assert "numba 0.58 is installed, numba>=0.59 is needed" == only(software.packages(machine(software=old))).text
    new = packages({"numpy": "2.1.0"}, load=lambda name: SimpleNamespace(__version__="0.61"))
    (found,) = software.packages(machine(software=new))
    assert found == ok("packages", "numpy 2.1.0, numba 0.61")
    mute = packages({"numpy": "2.1.0"}, load=lambda name: SimpleNamespace())
    assert only(software.packages(machine(software=mute))).text == "numba is not installed"


def test_the_declared_needs_are_those_of_pyproject():
    wanted, lines = Software().declared()
    assert "3.11" in wanted and any(line.startswith("numpy") for line in lines)


def test_an_old_python(machine):
    assert not bad(software.python(machine(software=packages({}))))
    old = Software(declared=lambda: (">=3.11", []), python=(3, 10, 2))
    assert "Python 3.10.2, and hpcdem needs >=3.11" == only(software.python(machine(software=old))).text


def loads(**broken: str) -> Callable[[str], object]:
    def load(name: str) -> object:
        if name in broken:
            raise ImportError(broken[name])
        return SimpleNamespace(__version__="1", get_cachedir=lambda: "/home/me/.cache/matplotlib")

    return load


def test_packages_that_cannot_be_loaded(machine, monkeypatch):
    assert not bad(software.imports(machine(software=packages({}, load=loads()))))
    torn = machine(software=packages({}, load=loads(scipy="libgfortran.so.5: cannot open shared object\nmore")))
    found = only(software.imports(torn))
    assert found.text == "scipy cannot be loaded: libgfortran.so.5: cannot open shared object"
    backend = machine({}, {"MPLBACKEND": "qt"}, software=packages({}, load=loads(matplotlib="'qt' is no backend")))
    assert only(software.imports(backend)).cure == "unset MPLBACKEND"
    assert not bad(software.hdf5(machine(software=packages({}, load=loads(h5py="x"))))), "said once"
    monkeypatch.setattr(software, "PATIENT", -1.0)
    assert "slow file system" in only(software.imports(machine(software=packages({}, load=loads())))).text


@pytest.mark.parametrize(
    ("with_mpi", "text"), [(True, "with MPI: all ranks"), (False, "without MPI: files go through")]
)
def test_hdf5_with_and_without_mpi(machine, with_mpi, text):
    about = SimpleNamespace(version="3.16.0", hdf5_version="1.14.6")
    h5py = SimpleNamespace(version=about, get_config=lambda: SimpleNamespace(mpi=with_mpi))
    (found,) = software.hdf5(machine(software=packages({}, load=lambda name: h5py)))
    assert found.level == Level.OK and text in found.text and bool(found.cure) is not with_mpi


def test_figures_and_films(machine, monkeypatch):
    scene = machine({}, {"MPLBACKEND": "TkAgg"}, software=packages({}, load=loads()), ffmpeg=lambda: None)
    picture, film = software.figures(scene)
    assert "MPLBACKEND=TkAgg" in picture.text and film.cure == "pip install imageio-ffmpeg"
    scene.ffmpeg = lambda: "/usr/bin/ffmpeg"
    assert [f.text for f in software.figures(scene)][1] == "ffmpeg: /usr/bin/ffmpeg"
    monkeypatch.setattr(software.tempfile, "gettempdir", lambda: "/home/me/.cache")
    assert "MPLCONFIGDIR" in only(software.figures(scene)).cure


def test_petsc(machine):
    (found,) = software.petsc(machine(software=packages({}, find=lambda name: None)))
    assert found.level == Level.OK and "not installed" in found.text
    python = Path(software.sys.executable).name
    scene = machine(
        software=packages({"petsc4py": "3.22"}, find=lambda name: name), ask=answers(**{python: (0, "", "")})
    )
    assert [f.text for f in software.petsc(scene)] == ["petsc4py 3.22 loads"]
    scene.ask = answers(**{python: (1, "", "Traceback\nImportError: libpetsc.so: no such file\n")})
    assert "libpetsc.so: no such file" in only(software.petsc(scene)).text


# -- MPI -----------------------------------------------------------------------------------------------------------

PYTHON = Path(software.sys.executable).name


def test_the_library(machine):
    (found,) = mpi.library(machine(ask=answers(**{PYTHON: (0, f"\n{MPICH}\nmore\n", "")})))
    assert found.text == f"{MPICH}; 1 rank on a, started without a launcher"
    four = machine(library=MPICH, places=places(2) + places(2, host="b"), launcher=Launcher("Slurm", 4, 0))
    assert [f.text for f in mpi.library(four)] == [f"{MPICH}; 4 ranks on 2 hosts, started by Slurm"]
    none = machine(ask=answers(**{PYTHON: (1, "", "ImportError: cannot load MPI library\n")}))
    assert "one rank only: ImportError: cannot load MPI library" in only(mpi.library(none)).text


def test_a_launch_that_a_run_would_refuse(machine):
    who = Launcher("Slurm", 4, 0)
    refused = machine(library=OPEN_MPI, launcher=who, refusal=launch.copies_of_rank_0(who, OPEN_MPI))
    found = only(mpi.library(refused))
    assert found.level == Level.PROBLEM and "rank 0 of 1" in found.text and found.cure == "Open MPI's own mpiexec"
    assert not list(mpi.trial(refused))
    unloaded = machine(launcher=who, refusal="mpi4py finds no MPI library")
    assert only(mpi.library(unloaded)).cure == "pip install mpich"


@pytest.mark.parametrize(
    ("answer", "level", "text"),
    [
        ((0, "hpcdem sees 2\nhpcdem sees 2\n", ""), None, "starts two ranks"),
        ((0, "hpcdem sees 1\nhpcdem sees 1\n", ""), Level.PROBLEM, "does not belong to the MPI library"),
        ((1, "", "--\nmpiexec has detected an attempt\nto run as root.\n--\n"), Level.WARNING, "attempt to run as"),
        ((213, "", ""), Level.WARNING, "exit code 213"),
    ],
)  # fmt: skip
def test_the_launcher_of_the_path_is_tried(machine, monkeypatch, answer, level, text):
    monkeypatch.setattr(mpi.sys, "executable", "/nowhere/bin/python")
    scene = machine(library=OPEN_MPI, which=lambda name: f"/opt/bin/{name}", ask=answers(mpiexec=answer))
    (found,) = mpi.trial(scene)
    assert found.level == (level or Level.OK) and text in found.text
    scene.launcher = Launcher("Open MPI", 2, 0)
    assert not list(mpi.trial(scene)), "ranks that run need no trial"


def test_the_right_launcher_is_at_hand(machine, monkeypatch, tmp_path):
    """It lies beside python, as that of a wheel does: a run can work, so this is only a warning."""
    (tmp_path / "mpiexec").touch()
    monkeypatch.setattr(mpi.sys, "executable", str(tmp_path / "python"))
    ask = answers(mpiexec=(0, "hpcdem sees 1\n", ""))
    found = only(mpi.trial(machine(library=MPICH, which=lambda name: f"/usr/bin/{name}", ask=ask)))
    assert found.level == Level.WARNING and found.cure == f"{tmp_path}/mpiexec -n 2 hpcdem ..."
    (found,) = mpi.trial(machine(library=MPICH, ask=answers(mpiexec=(0, "hpcdem sees 2\n", ""))))
    assert found.level == Level.OK and found.cure == f"export PATH={tmp_path}:$PATH"


def test_no_launcher_at_all(machine, monkeypatch):
    monkeypatch.setattr(mpi.sys, "executable", "/nowhere/bin/python")
    assert "no mpiexec" in only(mpi.trial(machine(library=MPICH))).text
    assert not list(mpi.trial(machine(library=MPICH, places=places(1, cores=1))))


def test_other_programs_see_no_launcher(machine):
    """A program that starts MPI would take itself for a rank, and the launcher would end the job with it."""
    seen = {}

    def ask(command, env, **how):
        seen.update(env)
        return subprocess.CompletedProcess(command, 0, "", "")

    environ = {"PMI_SIZE": "2", "PMI_FD": "7", "OMPI_COMM_WORLD_SIZE": "2", "SLURM_PROCID": "1", "PATH": "/bin"}
    machine({}, environ, ask=ask).run(["true"])
    assert seen.keys() == {"PATH", "NUMBA_CACHE_DIR"} and seen["PATH"] == "/bin"


def test_programs_that_do_not_answer(machine):
    def hangs(command, timeout, **how):
        raise subprocess.TimeoutExpired(command, timeout)

    assert machine(ask=hangs).run(["squeue"])[0] == 124 and machine().run(["squeue"])[0] == 127


# -- Slurm ---------------------------------------------------------------------------------------------------------

JOB = {"SLURM_JOB_ID": "7"}
SIGNAL = "#!/bin/bash\n#SBATCH --ntasks=4\n#SBATCH --signal=USR1@300  # five minutes\nsrun hpcdem push.py\n"


def test_nothing_is_said_outside_a_job(machine):
    for look in (slurm.end_of_job, slurm.cores_of_srun, slurm.mpi_type):
        assert not list(look(machine(library=MPICH)))


@pytest.mark.parametrize(
    ("environ", "programs", "text"),
    [
        ({"SLURM_JOB_END_TIME": "1900000000"}, {}, "job 7 ends at 2030-"),
        ({}, {"squeue": (0, "2030-01-02T03:04:05\n", "")}, "job 7 ends at 2030-01-02 03:04"),
        ({}, {"squeue": (0, "2030-01-02T03:04:05\n", ""), "scontrol": (0, SIGNAL, "")}, "asks for the signal USR1@300"),
        ({}, {"scontrol": (0, SIGNAL, "")}, "the end of job 7 is not known"),
        ({}, {"scontrol": (0, SIGNAL.replace("#SBATCH --signal", "## --signal"), "")}, None),
        ({}, {"squeue": (1, "", "no controller")}, None),
        ({}, {"squeue": (0, "Unknown\n", "")}, None),
    ],
)
def test_the_end_of_the_job(machine, environ, programs, text):
    (found,) = slurm.end_of_job(machine({}, JOB | environ, ask=answers(**programs)))
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
def test_cores_that_srun_does_not_take_from_sbatch(machine, environ, warned):
    found = bad(slurm.cores_of_srun(machine({}, JOB | environ)))
    assert [f.cure for f in found] == ["export SRUN_CPUS_PER_TASK=$SLURM_CPUS_PER_TASK"] * warned


LIST = "MPI plugin types are...\n\tpmix\n\tpmi2\n\tnone\nspecific pmix plugin versions available: pmix_v4\n"


@pytest.mark.parametrize(
    ("library", "chosen", "offered", "text"),
    [
        (OPEN_MPI, "pmix", LIST, None),
        (OPEN_MPI, "pmix_v4", LIST, None),
        (OPEN_MPI, "pmi2", LIST, "SLURM_MPI_TYPE=pmi2, and Open MPI v4.1.4 wants pmix"),
        (MPICH, "pmi2", LIST, None),
        (MPICH, "none", LIST, "wants pmi2"),
        (OPEN_MPI, "", LIST, None),
        (OPEN_MPI, "", "MPI plugin types are...\n\tpmi2\n", "this Slurm has no --mpi=pmix"),
        (OPEN_MPI, "", "", None),
    ],
)
def test_how_srun_tells_the_ranks_about_each_other(machine, library, chosen, offered, text):
    environ = JOB | ({"SLURM_MPI_TYPE": chosen} if chosen else {})
    scene = machine({}, environ, library=library, ask=answers(srun=(0, "", offered)))
    if text is None:
        assert not bad(slurm.mpi_type(scene))
    else:
        assert text in only(slurm.mpi_type(scene)).text
    scene.places = places(2)
    assert not list(slurm.mpi_type(scene)), "ranks that see each other need no advice"


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


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.mpi)])
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
@pytest.mark.parametrize(("rank", "code"), [(0, 1), (3, 0)])
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


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.mpi)])
def test_a_run_warns_at_its_start(launch, tmp_path, ranks):
    """The log of a run has what the table of checks finds, whatever becomes of the run."""
    done = launch.python(ranks, "-c", LIMITED, cwd=tmp_path, timeout=120)
    assert done.returncode == 2 and "nothing.py: no such script" in done.stderr
    assert done.stdout.count("warning: a process is killed after 900 s of processor time") == 1
