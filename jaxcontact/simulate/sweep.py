"""Many cases of one function: what is missing is computed, each case kept as it is done, failures passed over."""

import contextlib
import copy
import functools
import hashlib
import json
import pickle
import sys
import types
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from jaxcontact._compile.compilation_cache import enable_compilation_cache
from jaxcontact._compile.programs import optimised_at_once
from jaxcontact._support import checks, fingerprint
from jaxcontact._support.files import locked, read_npz, write_npz, write_whole
from jaxcontact._support.terminal import recorded_warnings
from jaxcontact.results.notes import Note, counts_in_words, in_one_line, kind_of

Case = dict[str, Any]
Result = dict[str, np.ndarray]
CASE = "case.json"  # the name of the case beside its arrays
NOTES = "notes.json"  # beside them as well: the warnings that f issued, each with its kind
PATIENCE = 10.0  # [s] without a result, after which a cluster is checked for workers
MOST_SHOWN = 20  # failed cases in the text of a study
FUNCTION = "function.json"  # the identity of the function whose results a folder holds
MOST_NAMES = 6  # of the parts that differ, in a message
# read by XLA and by the linear algebra of numpy and scipy, whose threads spin where they wait: two processes that
# each had as many as cores took longer than one
THREADS = ("NPROC", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


@dataclass(frozen=True)
class Study:
    """The results of a sweep, read from its folder on demand.

    folder: folder of the results; cases: in the order given; failures: {index of a case: reason of the failure, in one
    line}; ``notes``: {index of a case: warnings that f issued there}.
    """

    folder: Path
    cases: tuple[Case, ...]
    failures: dict[int, str]

    def __len__(self) -> int:
        return len(self.cases)

    def __getitem__(self, index: int) -> Result:
        """Return the result of f for a case; KeyError for one that failed, IndexError for an unknown one."""
        index = range(len(self))[index]
        if index in self.failures:
            raise KeyError(f"case {index} failed: {self.failures[index]}")
        arrays = read_npz(self.folder / _file(self.cases[index]))
        return {name: values for name, values in arrays.items() if name not in (CASE, NOTES)}

    @functools.cached_property
    def notes(self) -> dict[int, tuple[str, ...]]:
        """{index of a case: the warnings that f issued there, in words}, without the cases that have none."""
        found = {}
        for index in self.done():
            # none in one of an earlier version
            stored = read_npz(self.folder / _file(self.cases[index]), NOTES)
            found[index] = tuple(Note(*each) for each in json.loads(str(stored.get(NOTES, "[]"))))
        return {index: notes for index, notes in found.items() if notes}

    def notes_in_words(self) -> list[str]:
        """Return the number of cases with each kind of note: "35 of 36 cases: film strain above 0.2", ..."""
        return counts_in_words((map(kind_of, notes) for notes in self.notes.values()), len(self), "cases")

    def done(self) -> list[int]:
        """The indices of the cases that did not fail."""
        return [index for index in range(len(self)) if index not in self.failures]

    def stacked(self, name: str) -> np.ndarray:
        """One result of all cases, (n, ...), nan where a case failed; ValueError unless all have it in one shape."""
        found = {index: self[index] for index in self.done()}
        names = sorted(set[str]().union(*found.values()))
        if not found or any(name not in result for result in found.values()):
            raise ValueError(f"name: expected what every case returned, one of {names}; got {name!r}")
        shapes = {result[name].shape for result in found.values()}
        if len(shapes) > 1:
            raise ValueError(f"{name}: expected one shape in all cases, got {sorted(shapes)}; take study[i]")
        missing = np.full(shapes.pop(), np.nan)
        return np.stack([found[i][name] if i in found else missing for i in range(len(self))])

    def plot(self, name: str) -> Any:
        """Return a figure of one result over the values that the cases vary: a map of two, or a line of one.

        Axes are logarithmic where the values have equal ratios. Cells of cases that failed, or that do not exist, stay
        empty.

        Args:
            name: of a result that is one number in each case; of a time series, the last value is drawn.

        Raises:
            ValueError: an unknown name, or cases that vary none or more than two numbers.
        """
        from jaxcontact.results.plotting import studies_figure

        values = self.stacked(name)
        return studies_figure(self.cases, {name: values.reshape(len(self), -1)[:, -1]})

    def __str__(self) -> str:
        done = len(self) - len(self.failures)
        lines = [f"{done} of {len(self)} cases are in {self.folder}"]
        failed = [f"failed: {self.cases[i]}: {why}" for i, why in list(self.failures.items())[:MOST_SHOWN]]
        if len(self.failures) > MOST_SHOWN:
            failed.append(f"failed: {len(self.failures) - MOST_SHOWN} more; study.failures has all")
        return "\n".join([*lines, *(f"note: {line}" for line in self.notes_in_words()), *failed])

    __repr__ = __str__


def sweep(
    f: Callable[[Case], Mapping[str, Any]],
    cases: Iterable[Mapping[str, Any]],
    out: str | Path,
    *,
    executor: Executor | None = None,
    processes: int | None = None,
    version: str | None = None,
) -> Study:
    """Call f for each case in parallel and store the results; cases whose result is already in ``out`` are skipped.

    The result of each case is written to a file of its own as soon as it is complete. If a sweep is interrupted, the
    finished cases are kept, and the same call continues with the others. A case that raises an exception, or whose
    process dies, is reported and does not affect the others; the next call repeats it. Warnings issued by f are stored
    with the case instead of being shown (``study.notes``).

    The folder belongs to one f and one state of this package. f is compared by content: its code as it runs, its
    defaults and the variables that it closes over; the functions, classes and constants that it names, and what those
    use; all members of your own modules that it uses; installed packages by their versions and by what you replaced in
    them, this one by a digest of its sources. A comment or another place in the file changes nothing. A use of
    ``importlib``, ``eval`` or ``sys.modules`` is refused without a ``version``, since it may read anything. Files and
    environment variables that f reads are not compared; put their content, or a digest of it, into the cases.

    Args:
        f: a function of a dict that returns a dict of arrays or numbers. It may be defined in a module or in a notebook.
        cases: dicts of numbers, text, or lists of them; ``itertools.product`` makes a grid of them.
        out: folder of the results, created if necessary; only one sweep at a time may write into it.
        executor: any ``concurrent.futures.Executor``, such as ``distributed.Client(...).get_executor()`` or
            ``mpi4py.futures.MPIPoolExecutor``; by default processes of this machine, which share the cache of compiled
            programs. If a worker's death breaks the executor, as it does a ``ProcessPoolExecutor``, processes of this
            machine compute the remaining cases. A Dask cluster without workers is waited for, with a message.
        processes: number of processes of this machine, by default one for each core.
        version: a text of your own that names the version of f; it replaces the comparison of f by content.

    Returns:
        A ``Study``: ``study[i]`` is the result of a case, ``study.stacked(name)`` one result of all cases.

    Raises:
        ValueError: cases that are not such dicts; f that is not a function, or that uses a value whose content cannot be
            compared, such as an open file, or ``importlib`` or ``eval``, if no ``version`` is given; a folder of another f
            or of another state of this package, or one in use; or both processes and an executor.

    Example:
        >>> import tempfile
        >>> def area(case):
        ...     return {"area": np.pi * case["radius"] ** 2}
        >>> cases = [{"radius": radius} for radius in (1.0, 2.0)]
        >>> study = jc.sweep(area, cases, tempfile.mkdtemp())  # doctest: +SKIP
        >>> study.stacked("area")  # doctest: +SKIP
        array([ 3.14159265, 12.56637061])
    """
    if not isinstance(f, types.FunctionType):
        raise ValueError(
            f"f: expected a function of a case, got {type(f).__name__}: what varies goes into the cases"
        )
    if isinstance(cases, Mapping | str) or not isinstance(cases, Iterable):
        raise ValueError(f"cases: expected a list of dicts, got {type(cases).__name__}")
    chosen: list[Case] = []
    for index, case in enumerate(cases):
        if not isinstance(case, Mapping) or not all(isinstance(name, str) for name in case):
            raise ValueError(f"cases[{index}]: expected a dict of names, got {case!r}")
        try:
            chosen.append(json.loads(_text(dict(case))))
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"cases[{index}]: expected finite numbers, text and lists, got {case}"
            ) from error
    if not isinstance(version, str | None):
        raise ValueError(f"version: expected a text, got {version!r}")
    parts = fingerprint.parts_of(f) if version is None else {"version": version}
    return sweep_of(f, chosen, Path(out), parts, executor=executor, processes=processes)


def sweep_of(
    f: Callable[[Case], Mapping[str, Any]],
    cases: Sequence[Case],
    folder: Path,
    parts: dict[str, str],
    *,
    executor: Executor | None = None,
    processes: int | None = None,
) -> Study:
    """Return the study of ``sweep`` for a function whose identity is known, {name of a part: digest or text}."""
    if executor is not None and processes is not None:
        raise ValueError(f"processes: expected none with an executor, got {processes}")
    checks.whole("processes", 1 if processes is None else processes, 1, 10**4)
    if folder.is_file():
        raise ValueError(f"out: expected a folder, got the file {folder}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"out: expected a folder that can be made, got {folder}: {error.strerror}") from None
    names = [_file(case) for case in cases]
    with locked(folder):
        # a new folder gets the identity of the function, another one must have the same
        path, parts = folder / FUNCTION, parts | fingerprint.packages_of("jaxcontact")
        if not path.exists():
            text = json.dumps({"parts": parts}, indent=1)
            write_whole(path, lambda partial: partial.write_text(text, encoding="utf-8"))
        else:
            remedy = "take another folder, or delete this one to compute anew"
            try:
                found = dict(json.loads(path.read_text(encoding="utf-8"))["parts"])
            except (ValueError, KeyError, TypeError) as error:
                raise ValueError(
                    f"out: {folder} was written by an earlier version of jaxcontact, whose record of the function cannot be"
                    f" compared, or {path.name} is damaged; {remedy}"
                ) from error
            if differ := fingerprint.differing(found, parts):
                listed = ", ".join(differ[:MOST_NAMES]) + (", ..." if len(differ) > MOST_NAMES else "")
                raise ValueError(
                    f"out: {folder} holds results of another function: {listed} differ; {remedy}"
                )
        missing = {name: case for name, case in zip(names, cases, strict=True) if not _whole(folder / name)}
        failed = _fill(f, missing, folder, executor or processes or _cores())
    return Study(
        folder, tuple(cases), {index: failed[name] for index, name in enumerate(names) if name in failed}
    )


def _text(case: Case) -> str:
    plain = lambda value: value.tolist() if hasattr(value, "tolist") else json.JSONEncoder().default(value)
    return json.dumps(case, sort_keys=True, allow_nan=False, default=plain)


def _file(case: Case) -> str:
    """The name of the file of a case: equal cases have one."""
    return hashlib.sha256(_text(case).encode()).hexdigest()[:20] + ".npz"


def _whole(path: Path) -> bool:
    """Return whether a case is there and all of it can be read; what cannot is computed again."""
    try:
        return path.exists() and CASE in read_npz(path)
    except ValueError:
        return False


@dataclass(frozen=True)
class Failure:
    """The end of a case without a result; text: what went wrong, in one line; died: whether its process ended."""

    text: str
    died: bool = False


DEAD = Failure("its process died (out of memory?)", died=True)


def _fill(f: Callable, missing: dict[str, Case], folder: Path, workers: Executor | int) -> dict[str, str]:
    """Compute what is missing into the folder; {file: what went wrong}."""
    if not missing:
        return {}
    own = workers if isinstance(workers, int) else _cores()
    failures: dict[str, Failure] = {}
    with tqdm(total=len(missing), unit="case", disable=None, delay=1.0) as bar:

        def keep(cases: dict[str, Case], by: Executor | int) -> dict[str, Failure]:
            """Write what is found as it comes; {file: failure} of the others."""
            failures: dict[str, Failure] = {}
            for name, found in _outcomes(f, cases, by):
                bar.update(not (isinstance(found, Failure) and found.died))
                if isinstance(found, Failure):
                    failures[name] = found
                else:
                    arrays = found | {CASE: np.asarray(_text(missing[name]))}
                    write_whole(folder / name, functools.partial(write_npz, arrays=arrays))
            return failures

        dead = lambda: {name: missing[name] for name, failure in failures.items() if failure.died}
        try:
            failures = keep(missing, workers)
            # A process that dies takes with it whatever its executor had not finished, and an executor of the user
            # cannot be made anew: those cases are computed by processes of this machine instead.
            if not isinstance(workers, int) and (lost := dead()):
                failures = {name: each for name, each in failures.items() if not each.died} | keep(lost, own)
            # each alone: now only the process of its own case can have died
            for name, case in dead().items():
                del failures[name]
                failures |= keep({name: case}, 1)
        except KeyboardInterrupt:
            # own processes would go on with what nobody waits for
            _processes(max(1, min(own, len(missing)))).shutdown(kill_workers=True)
            raise
    return {name: failure.text for name, failure in failures.items()}


def _outcomes(
    f: Callable, cases: dict[str, Case], workers: Executor | int
) -> Iterator[tuple[str, Result | Failure]]:
    """Yield the results or failures of f as they arrive; workers: an executor, or the number of own processes, one case
    each."""
    sent: Callable | bytes = f
    # as bytes, so that the process that computes can report why it cannot be read there
    if isinstance(workers, int):
        import cloudpickle  # that of loky

        try:
            sent = cloudpickle.dumps(f)
        except Exception as refused:
            raise ValueError(f"f: cannot be sent to another process: {_failure(refused).text}") from refused
    call = functools.partial(_attempt, sent)
    waiting, running = deque(cases.items()), dict[Future, str]()
    width = min(workers, len(cases)) if isinstance(workers, int) else len(cases)
    told = False
    try:
        while waiting or running:
            while waiting and len(running) < width:
                name, case = waiting.popleft()
                executor = _processes(width) if isinstance(workers, int) else workers
                try:
                    running[executor.submit(call, case)] = name
                except BrokenExecutor:  # a process has died since the last case was submitted
                    yield name, DEAD
            done = wait(running, timeout=PATIENCE, return_when=FIRST_COMPLETED).done
            # a Dask cluster that has no worker at present; other executors cannot say
            client: Any = getattr(workers, "_client", None)
            if not done and not told and hasattr(client, "nthreads") and not client.nthreads():
                told = True
                tqdm.write(
                    f"sweep: the cluster has no worker; {len(running)} cases wait for one (Ctrl-C keeps the finished"
                    " cases and ends)",
                    file=sys.stderr,
                )
            for future in done:
                error = future.exception()
                if isinstance(error, BrokenExecutor):
                    found: Result | Failure = DEAD
                else:
                    found = future.result() if error is None else _failure(error)
                yield running.pop(future), found
    finally:
        for future in running:
            future.cancel()


def _cores() -> int:
    import loky  # a tenth of what importing jaxcontact takes

    return loky.cpu_count()


def _processes(count: int) -> Any:
    """The processes of this machine, made anew where one has died; together they take no more than its cores."""
    import loky

    threads = dict.fromkeys(THREADS, str(max(1, _cores() // count)))
    return loky.get_reusable_executor(count, initializer=_share_programs, env=threads, timeout=60)


def _share_programs() -> None:
    with contextlib.suppress(OSError):
        enable_compilation_cache()


def _failure(error: BaseException) -> Failure:
    try:
        return Failure(" ".join(f"{type(error).__name__}: {error}".split()))
    except Exception:  # an exception whose own text cannot be made
        return Failure(type(error).__name__)


def _attempt(f: Callable | bytes, case: Case) -> Result | Failure:
    """Return, in the process that computes, the result of a case as arrays, with its notes where it has any, or a failure.

    No exception leaves that process: one that cannot be unpickled would end it, and the cases beside this one. Programs
    are optimised from the first call on, so that results are equal bit for bit however cases are shared.
    """
    try:
        run = pickle.loads(f) if isinstance(f, bytes) else f
        with recorded_warnings() as caught, optimised_at_once():
            found = run(copy.deepcopy(case))
        if not isinstance(found, Mapping):
            raise ValueError(f"f: expected a dict of arrays, got {type(found).__name__}")
        for name in found:
            if not isinstance(name, str) or name in (CASE, NOTES):
                raise ValueError(f"f: expected names of arrays, got {name!r}")
        arrays = {name: np.asarray(values) for name, values in found.items()}
        for name, values in arrays.items():
            if values.dtype.kind not in "biufc":
                raise ValueError(f"f: expected numbers in {name!r}, got {values.dtype}")
        notes = [in_one_line(each) for each in caught]
        told = json.dumps([(note, kind_of(note)) for note in dict.fromkeys(notes)])
        return arrays | ({NOTES: np.asarray(told)} if notes else {})
    except (Exception, SystemExit) as error:
        return _failure(error)
