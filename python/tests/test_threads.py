"""Threads, Ctrl-C, and imports, in processes of their own where they would disturb others."""

from __future__ import annotations

import pathlib
import signal
import subprocess
import sys
import textwrap
import threading

import bittybuzz
import pytest

import worlds


def test_a_second_thread_gets_busy_and_never_waits(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    begun, end = threading.Event(), threading.Event()

    def each(now: bittybuzz.Simulation) -> None:
        begun.set()
        # If the calls of the other thread waited, this would never end.
        assert end.wait(60)

    thread = threading.Thread(target=lambda: simulation.step(1, each=each))
    thread.start()
    assert begun.wait(60)
    snapshot = None
    for call in (
        simulation.step,
        simulation.poses,
        simulation.leds,
        simulation.digest,
        simulation.snapshot,
        simulation.logs,
        simulation.expectations,
        simulation.measures,
        lambda: simulation.read("x"),
        lambda: simulation.write("global.n", 1),
        lambda: simulation.command("fail = 1"),
        lambda: simulation.time,
        lambda: simulation.record(tmp_path / "run.bbr"),
    ):
        with pytest.raises(bittybuzz.Busy, match="in use"):
            call()
    assert repr(simulation) == "<Simulation in use>" and snapshot is None
    end.set()
    thread.join()
    assert simulation.time == 0.1 and simulation.step() == 1


def test_simulations_run_in_threads(tmp_path: pathlib.Path) -> None:
    scenario = worlds.scenario(tmp_path)
    simulations = [scenario.start(seed=seed) for seed in range(4)]
    threads = [threading.Thread(target=one.step, args=(200,)) for one in simulations]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for seed, one in enumerate(simulations):
        alone = scenario.start(seed=seed)
        alone.step(200)
        assert one.digest() == alone.digest()


def test_the_lock_is_free_while_a_world_runs(root: pathlib.Path) -> None:
    """Another thread of Python goes on within one call of `step`, and ends it by its signal."""
    script = f"""
        import bittybuzz, os, signal, threading

        def interrupt():
            while True:
                try:
                    simulation.time
                except bittybuzz.Busy:
                    return os.kill(os.getpid(), signal.SIGINT)

        scenario = bittybuzz.Scenario.load({str(root / "examples/swarm/gradient.toml")!r}, set={{"world.duration": 2e6}})
        simulation = scenario.start()
        # This thread sees `step` only if `step` releases the lock.
        threading.Thread(target=interrupt).start()
        try:
            simulation.step(10**8)
        except KeyboardInterrupt:
            done = round(simulation.time * 10)
            simulation.step(25)
            other = scenario.start()
            other.step(done + 25)
            assert simulation.digest() == other.digest()
            print("interrupted")
    """
    assert run(script) == "interrupted\n"


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_from_outside_ends_a_step(root: pathlib.Path) -> None:
    script = f"""
        import bittybuzz
        scenario = bittybuzz.Scenario.load({str(root / "examples/swarm/gradient.toml")!r}, set={{"world.duration": 2e6}})
        simulation = scenario.start()
        try:
            print("begun", flush=True)
            simulation.step(10**8)
        except KeyboardInterrupt:
            print(simulation.step(3), flush=True)
    """
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(script)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    assert process.stdout.read() == "3\n" and process.wait() == 0


def test_ctrl_c_ends_a_script() -> None:
    script = """
        import bittybuzz, os, signal, threading
        begun = threading.Event()
        threading.Thread(target=lambda: begun.wait() and os.kill(os.getpid(), signal.SIGINT)).start()
        try:
            begun.set()
            bittybuzz.run("function step() { i = 0 while(i < 1000) { i = i + 1 } }", steps=10**15)
        except KeyboardInterrupt:
            print("interrupted")
    """
    assert run(script) == "interrupted\n"


def test_an_import_loads_no_other_module() -> None:
    script = """
        import sys
        before = set(sys.modules)
        import bittybuzz
        others = {name for name in set(sys.modules) - before if not name.startswith("bittybuzz")}
        print(sorted(others))
    """
    assert run(script) == "['__future__']\n"


def test_numpy_is_imported_by_the_first_array(tmp_path: pathlib.Path) -> None:
    script = f"""
        import bittybuzz, sys
        simulation = bittybuzz.Scenario.parse({worlds.WORLD!r}, {str(worlds.folder(tmp_path))!r}).start()
        simulation.step(5)
        simulation.write("global.n", 3)
        simulation.digest(), simulation.logs(), simulation.snapshot()
        assert "numpy" not in sys.modules
        simulation.poses()
        assert "numpy" in sys.modules
        print("lazy")
    """
    assert run(script) == "lazy\n"


def test_without_numpy_an_array_is_an_import_error(tmp_path: pathlib.Path) -> None:
    script = f"""
        import sys
        sys.modules["numpy"] = None
        import bittybuzz
        simulation = bittybuzz.Scenario.parse({worlds.WORLD!r}, {str(worlds.folder(tmp_path))!r}).start()
        for call in (simulation.poses, simulation.leds, lambda: simulation.read("x")):
            try:
                call()
            except ImportError as error:
                print(error)
        simulation.step()
    """
    assert run(script) == "arrays need NumPy: `pip install numpy`\n" * 3


def run(script: str) -> str:
    """Runs a script in a process of its own, and returns what it prints."""
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout
