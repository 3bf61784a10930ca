"""A sweep over many cases: each computed once, whatever dies on the way, with the numbers of a plain loop."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.simulate import sweep

CASES = [{"x": float(x), "log": ""} for x in range(6)]


def noted(case):
    """A line for each call, in the file that the case names."""
    if case["log"]:
        with open(case["log"], "a") as log:
            print(case["x"], file=log)
    return {"square": case["x"] ** 2, "row": np.sin(case["x"] * np.arange(4.0))}


def troubled(case):
    if case["x"] == 2.0:
        raise RuntimeError("two\nlines")
    if case["x"] == 4.0:
        os._exit(7)
    return noted(case)


def words(case):
    return {"name": "steel"} if case["x"] else [1.0]


def with_log(path, count=6):
    return [{"x": float(x), "log": str(path)} for x in range(count)]


@pytest.mark.slow
@pytest.mark.parametrize("executor", [None, ThreadPoolExecutor(2)], ids=["processes", "threads"])
def test_the_numbers_of_a_plain_loop_each_computed_once(tmp_path, executor):
    log = tmp_path / "log"
    cases = with_log(log)
    study = jc.sweep(noted, [*cases[:4], cases[0]], tmp_path / "out", executor=executor)
    study = jc.sweep(noted, cases, tmp_path / "out", executor=executor)
    assert sorted(map(float, log.read_text().split())) == [0, 1, 2, 3, 4, 5]
    assert len(study) == 6 and not study.failures and str(study).startswith("6 of 6 cases")
    np.testing.assert_array_equal(study.stacked("square"), np.arange(6.0) ** 2)
    np.testing.assert_array_equal(study[3]["row"], np.sin(3.0 * np.arange(4.0)))


@pytest.mark.slow
def test_what_fails_is_reported_and_the_others_are_done(tmp_path):
    """A case that raises, and one that takes its process with it."""
    study = jc.sweep(troubled, CASES, tmp_path)
    assert study.failures == {2: "RuntimeError: two lines", 4: "its process died (out of memory?)"}
    np.testing.assert_array_equal(np.isnan(study.stacked("square")), [False, False, True, False, True, False])
    assert study.stacked("row").shape == (6, 4)
    with pytest.raises(KeyError, match="case 2 failed: RuntimeError"):
        study[2]
    bad = jc.sweep(words, CASES[:2], tmp_path / "words")
    assert bad.failures == {
        0: "ValueError: f: expected a dict of arrays, got list",
        1: "ValueError: f: expected numbers in 'name', got <U5",
    }
    with pytest.raises(ValueError, match="one of"):
        bad.stacked("name")


class Apart(Exception):
    """An exception that cannot be unpickled: it needs two values and pickle gives it one."""

    def __init__(self, what, why):
        super().__init__(f"{what}: {why}")


class Unreadable(Exception):
    def __str__(self):
        raise RuntimeError("no text")


def awkward(case):
    """Every way to end a case without a result."""
    if case["x"] == 1.0:
        raise Apart("gap", "negative")
    if case["x"] == 2.0:
        raise Unreadable
    if case["x"] == 3.0:
        sys.exit("enough")
    if case["x"] == 4.0:
        os._exit(7)
    return noted(case)


@pytest.mark.parametrize(
    "executor",
    [
        pytest.param(None, id="processes", marks=pytest.mark.long),
        pytest.param(ThreadPoolExecutor(2), id="threads"),
    ],
)
def test_every_exception_is_reported_as_itself_and_costs_no_other_case(tmp_path, executor):
    """One that does not unpickle, one without a text, the exit of a script, and a process that really dies."""
    cases = CASES if executor is None else CASES[:4]
    study = jc.sweep(awkward, cases, tmp_path, executor=executor)
    told = {1: "Apart: gap: negative", 2: "Unreadable", 3: "SystemExit: enough"}
    if executor is None:
        told[4] = "its process died (out of memory?)"
    assert study.failures == told
    assert [float(study[index]["square"]) for index in study.done()] == (
        [0.0, 25.0] if executor is None else [0.0]
    )


@pytest.mark.slow
def test_a_function_that_a_process_cannot_read_is_told_so(tmp_path, monkeypatch):
    """A module that this process alone can import: f is sent by its name."""
    (tmp_path / "only_here.py").write_text("def f(case): return {'v': 1.0}")
    monkeypatch.syspath_prepend(tmp_path)
    import only_here

    (tmp_path / "only_here.py").unlink()
    study = jc.sweep(only_here.f, CASES[:1], tmp_path / "out", processes=1)
    assert study.failures == {0: "ModuleNotFoundError: No module named 'only_here'"}
    lock = __import__("threading").Lock()
    with pytest.raises(ValueError, match="f: cannot be sent to another process: TypeError"):
        jc.sweep(lambda case: {"v": lock}, CASES[:1], tmp_path / "lock", version="1")


SLOWLY = """
import sys, time
import jaxcontact as jc

def slowly(case):
    with open(sys.argv[1] if len(sys.argv) > 1 else case["log"], "a") as log:
        print(case["x"], file=log)
    time.sleep(0.3)
    return {"square": case["x"] ** 2}

if __name__ == "__main__":
    cases = [{"x": float(x), "log": sys.argv[1]} for x in range(10)]
    print(jc.sweep(slowly, cases, sys.argv[2]).stacked("square").tolist())
"""


@pytest.mark.slow
def test_a_killed_sweep_goes_on_and_computes_again_what_was_running_alone(tmp_path):
    script, log, out = tmp_path / "study.py", tmp_path / "log", tmp_path / "out"
    script.write_text(SLOWLY)
    command = [sys.executable, str(script), str(log), str(out)]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    while len(list(out.glob("*.npz"))) < 3:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout.strip() == str([float(x * x) for x in range(10)])
    calls = log.read_text().split()
    assert sorted(set(map(float, calls))) == list(range(10)) and len(calls) <= 10 + os.cpu_count() + 1


def test_a_folder_holds_one_function(tmp_path):
    jc.sweep(noted, CASES[:1], tmp_path, executor=ThreadPoolExecutor(1))
    with pytest.raises(ValueError, match="of another function: "):
        jc.sweep(words, CASES[:1], tmp_path)
    for cases, told in (
        ([1.0], r"cases\[0\]: expected a dict of names, got 1.0"),
        ([{"x": np.nan}], "expected finite"),
        ([{"x": {1}}], "expected finite numbers"),
    ):
        with pytest.raises(ValueError, match=told):
            jc.sweep(noted, cases, tmp_path)
    with pytest.raises(ValueError, match="processes: expected none with an executor, got 2"):
        jc.sweep(noted, CASES, tmp_path, executor=ThreadPoolExecutor(1), processes=2)
    with pytest.raises(ValueError, match="f: expected a function of a case, got partial"):
        jc.sweep(__import__("functools").partial(noted), CASES, tmp_path)


def test_a_changed_function_of_the_same_name_is_another(tmp_path):
    """Also where no source can be read, and where it is what the function closes over that has changed."""

    def made(factor):
        def f(case):
            return {"v": factor * case["x"]}

        return f

    one = ThreadPoolExecutor(1)
    assert jc.sweep(made(1.0), CASES[:2], tmp_path, executor=one).stacked("v").tolist() == [0.0, 1.0]
    with pytest.raises(ValueError, match="of another function: "):
        jc.sweep(made(2.0), CASES[:2], tmp_path, executor=one)
    for text in ("2.0", "3.0"):
        names = {}
        exec(f"def f(case): return {{'v': {text} * case['x']}}", names)
        if text == "2.0":
            jc.sweep(names["f"], CASES[:2], tmp_path / "read", executor=one)
    with pytest.raises(ValueError, match="of another function: "):
        jc.sweep(names["f"], CASES[:2], tmp_path / "read", executor=one)


def test_a_version_of_ones_own_replaces_the_comparison(tmp_path):
    one = {"executor": ThreadPoolExecutor(1)}
    held = [open(os.devnull)]  # noqa: SIM115
    with held[0]:
        f = lambda case: {"v": case["x"], "open": not held[0].closed}
        with pytest.raises(ValueError, match=r'TextIOWrapper \(held in f\); pass version="'):
            jc.sweep(f, CASES[:2], tmp_path / "none", **one)
        assert jc.sweep(f, CASES[:2], tmp_path, version="a", **one).stacked("open").all()
    assert jc.sweep(noted, CASES[:2], tmp_path, version="a", **one).stacked("open").all()
    with pytest.raises(ValueError, match="of another function: version differ"):
        jc.sweep(f, CASES[:2], tmp_path, version="b", **one)
    with pytest.raises(ValueError, match="version: expected a text, got 2"):
        jc.sweep(f, CASES[:2], tmp_path, version=2, **one)


@pytest.mark.parametrize("version", [None, "1"])
def test_another_state_of_the_package_is_not_gone_on_with(tmp_path, monkeypatch, version):
    one = {"executor": ThreadPoolExecutor(1), "version": version}
    jc.sweep(noted, CASES[:1], tmp_path, **one)
    monkeypatch.setattr("jaxcontact._support.fingerprint.source_digest", lambda package: "changed physics")
    with pytest.raises(
        ValueError, match="another function: the sources of jaxcontact differ; take another folder"
    ):
        jc.sweep(noted, CASES, tmp_path, **one)
    assert len(list(tmp_path.glob("*.npz"))) == 1


@pytest.mark.parametrize(
    "text", ['{"function": "noted", "code": "0", "jaxcontact": "0.1.0"}', "", "[]", '{"parts": 1}'], ids=str
)
def test_a_folder_with_an_older_record_of_its_function_is_refused(tmp_path, text):
    jc.sweep(noted, CASES[:1], tmp_path, executor=ThreadPoolExecutor(1))
    (tmp_path / "function.json").write_text(text)
    with pytest.raises(
        ValueError, match=r"earlier version of jaxcontact, .* or function\.json is damaged; take another"
    ):
        jc.sweep(noted, CASES[:1], tmp_path)


def test_what_f_does_to_its_case_and_what_stands_in_the_folder(tmp_path):
    def f(case):
        case["x"] = 2.0 * case["x"]
        return {"v": case["x"], "shape": np.zeros(int(case["x"]))}

    one = ThreadPoolExecutor(1)
    study = jc.sweep(f, ({"x": x} for x in (1.0, 2.0)), tmp_path, executor=one)
    assert study.stacked("v").tolist() == [2.0, 4.0] and study[-1]["v"] == 4.0 and study.done() == [0, 1]
    for path in tmp_path.glob("*.npz"):
        path.write_bytes(b"cut off")
    study = jc.sweep(f, [{"x": 1.0}, {"x": 2.0}], tmp_path, executor=one)
    assert study.stacked("v").tolist() == [2.0, 4.0]
    with pytest.raises(ValueError, match=r"shape: expected one shape in all cases, got \[\(2,\), \(4,\)\]"):
        study.stacked("shape")
    with pytest.raises(ValueError, match=r"one of \['shape', 'v'\]; got 'V'"):
        study.stacked("V")
    with pytest.raises(IndexError):
        study[2]
    with pytest.raises(ValueError, match="expected a list of dicts, got NoneType"):
        jc.sweep(f, None, tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="out: expected a folder, got the file"):
        jc.sweep(f, [], tmp_path / "file")


def test_a_folder_in_use_is_said_to_be(tmp_path):
    import filelock

    with (
        filelock.FileLock(tmp_path / ".lock"),
        pytest.raises(ValueError, match="found another run in progress there"),
    ):
        jc.sweep(noted, CASES, tmp_path)


@pytest.mark.long
def test_a_killed_worker_of_ones_own_executor_costs_no_other_case(tmp_path):
    """A ProcessPoolExecutor is broken by it, and all its futures with it, also those not yet submitted."""
    cases = with_log(tmp_path / "log", 12)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        study = jc.sweep(troubled, cases, tmp_path / "out", executor=pool)
        assert study.failures == {2: "RuntimeError: two lines", 4: "its process died (out of memory?)"}
        found = study.stacked("square")
        # an executor that is broken already
        again = jc.sweep(noted, cases[:3], tmp_path / "broken", executor=pool)
    np.testing.assert_array_equal(np.delete(found, [2, 4]), np.delete(np.arange(12.0) ** 2, [2, 4]))
    assert not again.failures


@pytest.mark.slow
def test_a_cluster_without_workers_is_waited_for_with_a_word(tmp_path, monkeypatch, capfd):
    distributed = pytest.importorskip("distributed", reason="the extra cluster")
    monkeypatch.setattr(sweep, "PATIENCE", 0.3)
    one = {"threads_per_worker": 1, "dashboard_address": None, "processes": False}
    with (
        distributed.LocalCluster(n_workers=0, **one) as cluster,
        distributed.Client(cluster) as client,
        ThreadPoolExecutor(1) as beside,
    ):
        waiting = beside.submit(jc.sweep, noted, CASES[:2], tmp_path, executor=client.get_executor())
        time.sleep(2.0)
        assert not waiting.done()
        told = capfd.readouterr().err
        assert told.count("the cluster has no worker; 2 cases wait for one") == 1
        cluster.scale(1)
        assert waiting.result(timeout=60).stacked("square").tolist() == [0.0, 1.0]


@pytest.mark.long
def test_through_dask(tmp_path):
    distributed = pytest.importorskip("distributed", reason="the extra cluster")
    with distributed.Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        study = jc.sweep(noted, CASES, tmp_path, executor=client.get_executor())
    np.testing.assert_array_equal(study.stacked("square"), np.arange(6.0) ** 2)


FIVE_WAYS = """
import sys
import jax, numpy as np
import jaxcontact as jc
from distributed import Client
from jax.sharding import Mesh, PartitionSpec

body = jc.LayeredHalfSpace([], jc.Maxwell(G=1e9, eta=1e11, nu=0.4))
grid, times = jc.Grid.square(32, 3e-3), np.array([0.0, 30.0, 60.0])

def press(case):
    run = jc.indent(body, jc.Sphere(case["R"]), jc.Load(case["W"]), times, grid=grid, save="last")
    return {"pressure": run.pressure, "approach": run.approach, "status": run.status}

if __name__ == "__main__":
    assert jax.device_count() == 4
    given = {"R": np.linspace(5e-3, 1e-2, 8), "W": np.linspace(20.0, 6.0, 8)}
    cases = [{name: float(values[i]) for name, values in given.items()} for i in range(8)]
    serial = [jax.jit(press)(case) for case in cases]
    assert not any(np.any(one["status"]) for one in serial)
    along = PartitionSpec("cases")
    in_chunks = jax.shard_map(
        lambda some: jax.lax.map(press, some, batch_size=2),
        mesh=Mesh(jax.devices(), ("cases",)), in_specs=along, out_specs=along, check_vma=False,
    )
    found = {"vmapped": jax.jit(jax.vmap(press))(given), "sharded": jax.jit(in_chunks)(given)}
    assert len(found["sharded"]["approach"].sharding.device_set) == 4
    study = {"processes": jc.sweep(press, cases, sys.argv[1] + "/processes", processes=2)}
    with Client(n_workers=1, threads_per_worker=2, dashboard_address=None) as client:
        study["cluster"] = jc.sweep(press, cases, sys.argv[1] + "/cluster", executor=client.get_executor())
    found |= {way: {name: s.stacked(name) for name in serial[0]} for way, s in study.items()}
    for way, results in found.items():
        for name in ("pressure", "approach"):
            expected = np.stack([one[name] for one in serial])
            largest = np.max(np.abs(expected), axis=tuple(range(1, expected.ndim)), keepdims=True)
            print(way, name, np.max(np.abs(results[name] - expected) / largest))
"""


@pytest.mark.long
def test_serial_vmapped_sharded_process_and_cluster_runs_agree(tmp_path):
    """On four virtual devices. Loads and radii vary; where a film does, vmap rounds the fit of its kernels otherwise."""
    pytest.importorskip("distributed", reason="the extra cluster")
    script = tmp_path / "study.py"
    script.write_text(FIVE_WAYS)
    four = {"XLA_FLAGS": f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count=4"}
    done = subprocess.run(
        [sys.executable, str(script), str(tmp_path)], env=os.environ | four, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
    differences = [line.split() for line in done.stdout.splitlines()]
    assert {way for way, *_ in differences} == {"vmapped", "sharded", "processes", "cluster"}
    assert len(differences) == 8 and all(float(each[-1]) <= 1e-12 for each in differences), done.stdout


def test_a_case_whose_array_is_damaged_is_computed_again(tmp_path):
    """Two bytes in the middle of a file that is otherwise whole."""
    cases = [{"x": 1.0}, {"x": 2.0}]
    f = lambda case: {"a": np.full(50, case["x"])}
    jc.sweep(f, cases, tmp_path, processes=1)
    damaged = sorted(tmp_path.glob("*.npz"))[0]
    content = bytearray(damaged.read_bytes())
    at = content.find(np.full(50, 1.0).tobytes()[:64])
    at = at if at > 0 else content.find(np.full(50, 2.0).tobytes()[:64])
    content[at + 160] ^= 0xFF
    damaged.write_bytes(bytes(content))
    np.testing.assert_array_equal(jc.sweep(f, cases, tmp_path, processes=1).stacked("a")[:, 0], [1.0, 2.0])


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(ValueError, match="out: expected a folder that can be made"):
        jc.sweep(lambda case: {"a": 1.0}, [{"x": 1.0}], tmp_path / "file" / "study")


def made_up_study(tmp_path, cases, values):
    """A study whose results are already in its folder."""
    for case, value in zip(cases, values, strict=True):
        np.savez(tmp_path / sweep._file(case), peak=value)
    return sweep.Study(tmp_path, tuple(cases), {})


def test_a_study_of_two_numbers_is_drawn_as_a_map_over_both(tmp_path):
    """Each value is in its cell, axes of equal ratios are logarithmic, and a missing combination is empty."""
    cases = [{"W": w, "h": h, "n": 1} for w in (1.0, 2.0, 3.0) for h in (1e-6, 1e-5, 1e-4)][:-1]
    study = made_up_study(tmp_path, cases, [case["W"] * case["h"] for case in cases])
    ax = study.plot("peak").axes[0]
    drawn = ax.collections[0].get_array()
    np.testing.assert_allclose(drawn[:, :2], np.outer([1e-6, 1e-5, 1e-4], [1.0, 2.0]))
    assert np.ma.getmaskarray(drawn).nonzero() == (2, 2)
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "log")
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_title()) == ("W", "h", "peak")


def test_a_study_of_one_number_is_a_line_and_of_none_or_three_is_refused(tmp_path):
    study = made_up_study(
        tmp_path, [{"W": w} for w in (3.0, 1.0, 2.0)], [np.array([0.0, v]) for v in (9.0, 1.0, 4.0)]
    )
    np.testing.assert_array_equal(study.plot("peak").axes[0].lines[0].get_xydata(), [[1, 1], [2, 4], [3, 9]])
    for cases in ([{"W": 1.0}], [{"a": i, "b": i, "c": i} for i in (1, 2)], [{"a": "x"}, {"a": "y"}]):
        with pytest.raises(ValueError, match="numbers that vary"):
            made_up_study(tmp_path, cases, [1.0] * len(cases)).plot("peak")
