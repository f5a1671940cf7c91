"""Sweeps for Python programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from hpcdem.core.errors import UsageError
from hpcdem.core.nearest import hint
from hpcdem.lang import parameters
from hpcdem.sweep import array, design, driver
from hpcdem.sweep import plan as plans
from hpcdem.sweep.design import Sampling

if TYPE_CHECKING:
    from hpcdem.sweep.plan import Member, Plan
    from hpcdem.sweep.tables import Report


class Options(TypedDict, total=False):
    """Options of a report, those of `hpcdem measure`; lengths in m."""

    walls: tuple[int, ...]
    groups: tuple[str, ...]
    colors: tuple[int, ...]
    first: int
    last: int
    xmove: float
    ymove: float
    width: float
    strain: float
    length: float
    skin: float
    increment: bool
    over_time: bool
    ids: tuple[int, ...]
    points: tuple[tuple[float, float], ...]
    number: int
    history: str
    bins: int
    completeness: float
    released: bool
    joule: float
    box: tuple[float, ...]


class Sweep:
    """One script with many values of its parameters.

    ::

        sweep = hpcdem.Sweep("push.py", {"friction": [0.2, 0.3]}, seed="1:10", ranks=2)
        sweep.run()
        report = sweep.report()
        print(report.members["wedge.taper[deg] end"])

    values: by parameter, a list, or words as on the command line ("0.2,0.3", "1:10", "0.1:0.5:5"); twins: number of
    runs in which one particle is moved by 1e-5 of its radius, the first is the script unchanged; latin, sobol: so many
    samples of the ranges LOW:HIGH among them, by the sampling's own seed `sampling_seed`; folder: of the sweep, by
    default SCRIPT_sweep beside the script; links: files that the script reads. A folder that holds this sweep is taken
    up, with members that are new. UsageError or ScriptError, before anything is written, for what cannot be.
    """

    def __init__(
        self,
        script: Path | str,
        values: Mapping[str, str | Sequence[Any]] | None = None,
        *,
        seed: str | Sequence[int] | None = None,
        twins: int | None = None,
        latin: int | None = None,
        sobol: int | None = None,
        sampling_seed: int = 0,
        ranks: int = 1,
        threads: int = 1,
        folder: Path | str | None = None,
        links: Sequence[Path | str] = (),
    ) -> None:
        path = Path(script)
        wanted = dict(values or {})
        if seed is not None:
            if "seed" in wanted:
                raise UsageError("seed is given twice")
            wanted["seed"] = seed
        if twins is not None:
            if "twin" in wanted:
                raise UsageError("twin is given twice")
            wanted["twin"] = list(range(twins))
        if latin is not None and sobol is not None:
            raise UsageError("give either latin or sobol")
        number = latin if latin is not None else sobol
        sampling = None if number is None else Sampling("latin" if sobol is None else "sobol", number, sampling_seed)
        if number is not None and number < 1:
            raise UsageError(f"{number} samples: expected at least one")
        try:
            text = path.read_bytes()
        except OSError as problem:
            raise UsageError(f"{path}: cannot read the script: {problem.strerror}") from None
        adjustable = parameters.read(text, str(path))
        members = design.members(adjustable, wanted, sampling)
        place = path.parent / f"{path.stem}_sweep" if folder is None else Path(folder)
        self.plan, self.new = plans.make(
            place, adjustable, members, {name: words if isinstance(words, str) else list(words)
                                         for name, words in wanted.items()},
            None if sampling is None else [sampling.method, sampling.number, sampling.seed], ranks, threads,
            [Path(link) for link in links],
        )  # fmt: skip

    @classmethod
    def open(cls, folder: Path | str) -> Sweep:
        """The sweep in a folder. UsageError without one."""
        self = cls.__new__(cls)
        self.plan, self.new = plans.load(Path(folder)), 0
        return self

    plan: Plan
    new: int

    @property
    def folder(self) -> Path:
        """Folder of the sweep."""
        return self.plan.folder

    @property
    def members(self) -> list[Member]:
        """The runs: `folder`, `values`, `state`."""
        return self.plan.members

    def run(self, jobs: int | None = None, tries: int = 2, log: Any = None) -> dict[str, str]:
        """Carry out all that is not done, at most `jobs` at once [as many as cores allow]; returns the states."""
        return driver.run(self.plan, log or _log(), jobs, tries)

    def submit(self, options: Sequence[str] = (), at_once: int | None = None) -> str:
        """Submit the sweep as a job array of Slurm; returns its number, "" if all runs are complete."""
        path = array.write(self.plan, options, at_once)
        return "" if path is None else array.submit(path)

    def report(self, what: Sequence[str] = (), formats: Sequence[str] = ("png",), **options: Unpack[Options]) -> Report:
        """Measure all members that are done, and write tables and figures into `report` of the folder.

        Parameters
        ----------
        what : kinds of measurements (default: all that the folders allow).
        formats : file formats of the figures.
        options : options of `hpcdem measure`, for example `--strain` as strain=0.3.

        Returns
        -------
        Report : tables of the report.
        """
        for name in options:
            if name not in Options.__annotations__:
                near = hint(name, Options.__annotations__)
                raise UsageError(f"report has no option '{name}'{near}; known: {', '.join(Options.__annotations__)}")
        from hpcdem.core.comm import SerialComm
        from hpcdem.post.measure.scene import Request
        from hpcdem.sweep import report

        request = Request(folder=self.folder, what=tuple(what), formats=tuple(formats), **options)
        return report.run(SerialComm(), _log(), self.plan, request)


def _log() -> Any:
    from hpcdem.runtime.progress import Log

    return Log()
