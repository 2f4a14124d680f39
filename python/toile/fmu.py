"""FMUs of toile from Python, by FMPy: one run by names, or many runs beside each other.

``toile fmu scene.json -o cloth.fmu`` makes the archive. :class:`Cloth` drives one instance;
:func:`sweep` runs an FMU for many parameter values, on the cores of this machine or on a Dask cluster.
FMPy is needed (``pip install toile[fmu]``), Dask is not.
"""

from __future__ import annotations

import concurrent.futures
import hashlib
import io
import os
import shutil
import sys
import tempfile
import time
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Type, Union

import numpy as np

Number = Union[float, int, bool]
#: ``progress(done, total, failed)``, called after every run.
ProgressCallback = Callable[[int, int, int], None]


class Cloth:
    """One instance of a toile FMU, FMI 2 or 3, by variable names. A context manager.

    Values may be set before :meth:`initialize` (parameters) and between steps (inputs), arrays whole.
    Reading a variable gives a float, an int, a bool, or an array of the variable's shape, always a
    copy.
    """

    def __init__(self, archive: Union[str, Path], folder: Union[str, Path, None] = None) -> None:
        """Unpacks `archive` into `folder` (default: a temporary one that goes with the instance),
        unless it lies there already, and makes an instance."""
        import fmpy
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        self._own = tempfile.mkdtemp(prefix="toile-fmu-") if folder is None else None
        self._fmu: Any = None
        try:
            place = str(folder or self._own)
            if not (Path(place) / "modelDescription.xml").is_file():
                fmpy.extract(str(archive), place)
            self.description = fmpy.read_model_description(place)
            self._variables = {v.name: v for v in self.description.modelVariables}
            self._three = self.description.fmiVersion != "2.0"
            #: Lines of the FMU's log: (status, category, text).
            self.log: List[tuple[int, str, str]] = []
            kind = FMU3Slave if self._three else FMU2Slave
            fmu = kind(
                guid=self.description.guid,
                unzipDirectory=place,
                modelIdentifier=self.description.coSimulation.modelIdentifier,
                instanceName="cloth",
            )
            if self._three:
                fmu.instantiate(logMessage=self._tell3)
            else:
                fmu.instantiate()
            self._fmu = fmu
        except BaseException:
            self.close()
            raise
        self.time = 0.0

    def _tell3(self, _environment: Any, status: int, category: bytes, message: bytes) -> None:
        self.log.append((status, category.decode(), message.decode()))

    def __enter__(self) -> Cloth:
        return self

    def __exit__(
        self,
        _type: Optional[Type[BaseException]],
        _value: Optional[BaseException],
        _trace: Optional[TracebackType],
    ) -> None:
        self.close()

    def close(self) -> None:
        """Frees the instance and its temporary folder; a second time does nothing."""
        if self._fmu is not None:
            self._fmu.freeInstance()
            self._fmu = None
        if self._own is not None:
            shutil.rmtree(self._own, ignore_errors=True)
            self._own = None

    def _open(self) -> Any:
        if self._fmu is None:
            raise ValueError("the FMU's instance is closed")
        return self._fmu

    def _variable(self, name: str) -> Any:
        try:
            return self._variables[name]
        except KeyError:
            raise KeyError(f"the FMU has no variable '{name}'") from None

    def _call(self, what: str, function: Callable[[], Any]) -> Any:
        try:
            return function()
        except Exception as error:
            told = f": {self.log[-1][2]}" if self.log else ""
            raise RuntimeError(f"{what}: {error}{told}") from error

    def __getitem__(self, name: str) -> Any:
        fmu, variable = self._open(), self._variable(name)
        get = getattr(fmu, "get" + variable.type)
        references = [variable.valueReference]
        if not self._three:
            return self._call(name, lambda: get(references)[0])
        if variable.type == "Binary":
            return bytes(self._call(name, lambda: get(references)[0]))
        shape = tuple(variable.shape or ())
        count = int(np.prod(shape)) if shape else 1
        values = self._call(name, lambda: get(references, nValues=count))
        return np.array(values).reshape(shape) if shape else values[0]

    def __setitem__(self, name: str, value: Union[Number, np.ndarray]) -> None:
        fmu, variable = self._open(), self._variable(name)
        put = getattr(fmu, "set" + variable.type)
        shape = tuple(variable.shape or ()) if self._three else ()
        if np.shape(value) != shape:
            raise ValueError(f"{name}: shape {np.shape(value)}, expected {shape}")
        values = np.ravel(value).tolist()
        self._call(name, lambda: put([variable.valueReference], values))

    def initialize(self, start: float = 0.0) -> None:
        """Ends the setting of parameters; drapes if the parameter ``drape`` says so."""
        fmu = self._open()
        if self._three:
            self._call("initialize", lambda: fmu.enterInitializationMode(startTime=start))
        else:
            self._call("initialize", lambda: fmu.setupExperiment(startTime=start))
            self._call("initialize", fmu.enterInitializationMode)
        self._call("initialize", fmu.exitInitializationMode)
        self.time = start

    def step(self, size: float) -> None:
        """Advances by `size` [s]."""
        fmu = self._open()
        self._call("step", lambda: fmu.doStep(self.time, size))
        self.time += size


@dataclass(frozen=True)
class Result:
    """What one run of a sweep came to."""

    #: The run's parameters, as given.
    parameters: Mapping[str, Number]
    #: Outputs at its end by name, or what `evaluate` made of them; ``None`` if it failed.
    value: Any
    #: Why it failed, or ``None``.
    error: Optional[str]
    #: Wall time [s].
    seconds: float


def run(
    archive: Union[str, Path],
    parameters: Mapping[str, Number],
    outputs: Iterable[str],
    duration: float = 0.0,
    step: float = 1 / 60,
    folder: Union[str, Path, None] = None,
) -> Dict[str, Any]:
    """Sets `parameters`, initializes, steps for `duration` [s] and returns `outputs` by name."""
    with Cloth(archive, folder) as cloth:
        for name, value in parameters.items():
            cloth[name] = value
        cloth.initialize()
        for _ in range(round(duration / step)):
            cloth.step(step)
        return {name: cloth[name] for name in outputs}


#: Folders with unpacked archives of this process, by content.
_unpacked: Dict[str, str] = {}


def _unpack(archive: bytes) -> str:
    import fmpy

    key = hashlib.sha256(archive).hexdigest()
    if key not in _unpacked:
        folder = tempfile.mkdtemp(prefix="toile-sweep-")
        fmpy.extract(io.BytesIO(archive), folder)
        _unpacked[key] = folder
        import atexit

        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return _unpacked[key]


def _one(
    archive: bytes,
    parameters: Mapping[str, Number],
    outputs: Sequence[str],
    duration: float,
    step: float,
    evaluate: Optional[Callable[[Dict[str, Any]], Any]],
) -> Result:
    """A run in a worker: whatever goes wrong belongs to this run alone."""
    begun = time.perf_counter()
    try:
        folder = _unpack(archive)
        value: Any = run(folder, parameters, outputs, duration, step, folder)
        if evaluate is not None:
            value = evaluate(value)
        error = None
    except Exception as failure:
        value, error = None, f"{type(failure).__name__}: {failure}"
    return Result(dict(parameters), value, error, time.perf_counter() - begun)


def show_progress(done: int, total: int, failed: int) -> None:
    """The default progress: one line on standard error."""
    sys.stderr.write(f"\r{done} of {total} runs, {failed} failed")
    if done == total:
        sys.stderr.write("\n")
    sys.stderr.flush()


def sweep(
    archive: Union[str, Path],
    runs: Sequence[Mapping[str, Number]],
    outputs: Sequence[str],
    duration: float = 0.0,
    step: float = 1 / 60,
    evaluate: Optional[Callable[[Dict[str, Any]], Any]] = None,
    workers: Optional[int] = None,
    scheduler: Optional[str] = None,
    progress: Optional[ProgressCallback] = show_progress,
) -> List[Result]:
    """Runs the FMU once for each entry of `runs` (parameter values by name); results in their order.

    `evaluate` makes a result of the `outputs` where they are, so that arrays need not travel; it must
    be a function of a module. `scheduler` is the address of a Dask scheduler, such as
    ``tcp://host:8786``; ``"local"`` asks for a local Dask cluster, ``"processes"`` for processes of
    :mod:`concurrent.futures`. By default the former if Dask is installed, else the latter. `workers` is
    the number of processes, by default one for each core. A run that fails is told in its result
    (``error``), and the others are kept.
    """
    data = Path(archive).read_bytes()
    count = workers or os.cpu_count() or 1
    if scheduler is None:
        try:
            import distributed  # noqa: F401
        except ImportError:
            scheduler = "processes"
        else:
            scheduler = "local"
    calls = [(p, list(outputs), duration, step, evaluate) for p in runs]
    results: List[Optional[Result]] = [None] * len(calls)

    def take(index: int, future: Any) -> None:
        try:
            results[index] = future.result()
        except Exception as failure:
            # the worker itself was lost
            why = f"{type(failure).__name__}: {failure}"
            results[index] = Result(dict(calls[index][0]), None, why, float("nan"))
        if progress is not None:
            there = [r for r in results if r is not None]
            progress(len(there), len(calls), sum(r.error is not None for r in there))

    if scheduler == "processes":
        import multiprocessing

        # a fresh process for each worker: forking one that has threads is not safe
        context = multiprocessing.get_context("spawn")

        def together(indices: Sequence[int], last: bool) -> List[int]:
            """Runs these; those that were lost with a worker, which ends the whole pool."""
            lost = []
            size = max(1, min(count, len(indices)))
            with concurrent.futures.ProcessPoolExecutor(size, mp_context=context) as pool:
                futures = {pool.submit(_one, data, *calls[i]): i for i in indices}
                for future in concurrent.futures.as_completed(futures):
                    if not last and isinstance(future.exception(), BrokenProcessPool):
                        lost.append(futures[future])
                    else:
                        take(futures[future], future)
            return lost

        # a worker that was killed from outside need not be again; one that ends itself takes only
        # its own run along when that is alone
        for index in together(together(range(len(calls)), False), False):
            together([index], True)
    else:
        from distributed import Client, LocalCluster, as_completed

        cluster = None
        if scheduler == "local":
            cluster = LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None)
        try:
            with Client(cluster or scheduler) as client:
                shared = client.scatter(data, broadcast=True)
                numbers = {
                    client.submit(_one, shared, *call, pure=False, retries=0): i
                    for i, call in enumerate(calls)
                }
                for future in as_completed(list(numbers)):
                    take(numbers[future], future)
        finally:
            if cluster is not None:
                cluster.close()
    return [r for r in results if r is not None]
