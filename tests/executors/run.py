"""Carries out a sweep with an engine, and compares the merged table with that of one process.

python3 tests/executors/run.py ENGINE: shell, processes, dask, ray, hyperqueue or slurm. Prints one line.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from typing import Any

import bittybuzz

SCENARIO = """
[world]
size = [700, 700]
duration = 60

[[robots]]
name = "walkers"
robot = "kilobot"
script = "s.bzz"
count = 20

[output]
plot = ["x", "global.n"]
"""
SCRIPT = """
n = 0
G = 1
function step() {
  n = n + G * neighbors.count()
  if(math.rng.uniform(10) < 5) forward() else left()
}
"""
SET = ["robots.walkers.globals.G=1:5", "medium.ir.loss=0,0.1"]
RUNS = 6
CHUNK = 4
WORKERS = 2
# The first start of a node or cluster on a busy computer.
PATIENCE_S = 120

BBZ = [sys.executable, "-m", "bittybuzz"]


def bbz(*words: Any) -> str:
    done = subprocess.run([*BBZ, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{words}: {done.stderr}")
    return done.stdout


def plan(study: pathlib.Path) -> pathlib.Path:
    """Plans the sweep for an engine that calls the tool itself."""
    sets = [word for one in SET for word in ("--set", one)]
    bbz("sweep", "plan", study, "--runs", RUNS, "--chunk", CHUNK, *sets)
    return study.with_suffix(".sweep")


def merge(folder: pathlib.Path) -> pathlib.Path:
    table = folder.with_suffix(".csv")
    bbz("sweep", "merge", folder, "-o", table)
    return table


def with_executor(study: pathlib.Path, executor: Any) -> pathlib.Path:
    return bittybuzz.sweep(study, runs=RUNS, set=SET, chunk=CHUNK, executor=executor)


def shell(study: pathlib.Path) -> pathlib.Path:
    """The loop of docs/data.md, two chunks at a time."""
    folder = plan(study)
    run = " ".join([*BBZ, "sweep", "run", str(folder), "--threads", "1", "--chunk"])
    missing = missing_chunks(folder)
    loop = ["xargs", "-P", str(WORKERS), "-n", "1", *run.split()]
    subprocess.run(loop, input="\n".join(missing), text=True, check=True)
    return merge(folder)


def missing_chunks(folder: pathlib.Path) -> list[str]:
    """The numbers of the chunks that are not finished; the status of the command says if there are any."""
    done = subprocess.run(
        [*BBZ, "sweep", "status", folder, "--missing"], capture_output=True, text=True, check=False
    )
    return done.stdout.split()


def processes(study: pathlib.Path) -> pathlib.Path:
    with concurrent.futures.ProcessPoolExecutor(WORKERS) as executor:
        return with_executor(study, executor)


def dask(study: pathlib.Path) -> pathlib.Path:
    from dask.distributed import Client

    with Client(n_workers=WORKERS, threads_per_worker=1, dashboard_address=None) as client:
        return with_executor(study, client.get_executor())


def ray(study: pathlib.Path) -> pathlib.Path:
    import ray

    class Future:
        def __init__(self, reference: Any) -> None:
            self.reference = reference

        def result(self) -> Any:
            return ray.get(self.reference)

    class Ray:
        def submit(self, fn: Any, /, *args: Any) -> Future:
            return Future(ray.remote(fn).remote(*args))

    ray.init(num_cpus=WORKERS, include_dashboard=False, log_to_driver=False)
    try:
        return with_executor(study, Ray())
    finally:
        ray.shutdown()


def hyperqueue(study: pathlib.Path) -> pathlib.Path:
    from hyperqueue import Job, LocalCluster
    from hyperqueue.cluster import WorkerConfig
    from hyperqueue.task.function import PythonEnv

    class Future:
        def __init__(self, client: Any, job: Any) -> None:
            self.client, self.job = client, job

        def result(self) -> None:
            self.client.wait_for_jobs([self.job])

    class HyperQueue:
        def __init__(self, client: Any) -> None:
            self.client = client

        def submit(self, fn: Any, /, *args: Any) -> Future:
            job = Job()
            job.function(fn, args=args, stdout=None, stderr=None)
            return Future(self.client, self.client.submit(job))

    with LocalCluster() as cluster:
        for _ in range(WORKERS):
            cluster.start_worker(WorkerConfig(cores=1))
        client = cluster.client(python_env=PythonEnv(python_bin=sys.executable))
        return with_executor(study, HyperQueue(client))


@contextlib.contextmanager
def node(folder: pathlib.Path) -> Iterator[dict[str, str]]:
    """A cluster of Slurm that has this computer as its only node. Needs the rights of root."""
    name = os.uname().nodename
    (folder / "state").mkdir()
    (folder / "spool").mkdir()
    (folder / "slurm.conf").write_text(f"""
ClusterName=bittybuzz
SlurmctldHost={name}
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/none
CredType=cred/none
SlurmUser=root
SlurmdUser=root
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
NodeName={name} NodeAddr=127.0.0.1 CPUs={WORKERS} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
""")
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    # Debian has the daemons in a folder for root.
    environment["PATH"] += ":/usr/sbin"
    daemons = [
        subprocess.Popen([daemon, "-D"], env=environment, stderr=subprocess.DEVNULL)
        for daemon in ("slurmctld", "slurmd")
    ]
    try:
        end = time.monotonic() + PATIENCE_S
        while "idle" not in subprocess.run(["sinfo", "-h", "-o", "%t"], env=environment, capture_output=True, text=True).stdout:
            if time.monotonic() > end:
                logs = [(folder / f"{daemon}.log").read_text()[-2000:] for daemon in ("slurmctld", "slurmd")]
                raise SystemExit("no node of Slurm is idle:\n" + "\n".join(logs))
            time.sleep(0.5)
        yield environment
    finally:
        for daemon in daemons:
            daemon.terminate()
            daemon.wait()


def slurm(study: pathlib.Path) -> pathlib.Path:
    """A job array that is canceled, and one that carries out the rest, as docs/data.md says."""
    folder = plan(study)
    with tempfile.TemporaryDirectory() as place, node(pathlib.Path(place)) as environment:
        os.environ.update(environment)
        bbz("sweep", "submit", folder, "--tasks", 4, "--", "--begin=now+1hour")
        waiting = tasks(folder)
        if waiting["waiting"] != 4:
            raise SystemExit(f"four tasks wait for their time: {waiting}")
        bbz("sweep", "cancel", folder)
        bbz("sweep", "submit", folder, "--", "--time=5")
        end = time.monotonic() + PATIENCE_S
        while (state := tasks(folder))["running"] + state["waiting"] > 0:
            if time.monotonic() > end:
                raise SystemExit(f"the tasks do not end: {state}")
            time.sleep(0.5)
        if state["failed"] or state["ended"] != len(missing_before(folder)):
            raise SystemExit(f"tasks have failed: {state}")
    return merge(folder)


def tasks(folder: pathlib.Path) -> dict[str, Any]:
    """The state of the job array. The status of the command says if there are missing chunks."""
    done = subprocess.run([*BBZ, "sweep", "status", folder, "--json"], capture_output=True, text=True, check=False)
    return json.loads(done.stdout)["slurm"]


def missing_before(folder: pathlib.Path) -> list[str]:
    """The lines of the last submission, one for each task."""
    return (folder.with_suffix(".slurm") / "2" / "tasks").read_text().splitlines()


ENGINES = {one.__name__: one for one in (shell, processes, dask, ray, hyperqueue, slurm)}


def main() -> None:
    engine = ENGINES[sys.argv[1]]
    with tempfile.TemporaryDirectory() as place:
        study = pathlib.Path(place) / "s.toml"
        study.write_text(SCENARIO)
        study.with_name("s.bzz").write_text(SCRIPT)
        sets = [word for one in SET for word in ("--set", one)]
        whole = study.with_name("whole.csv")
        bbz("sim", study, "--runs", RUNS, *sets, "--threads", 1, "--csv", whole)
        rows = len(whole.read_text().splitlines()) - 1
        table = engine(study)
        if table.read_bytes() != whole.read_bytes():
            raise SystemExit(f"{sys.argv[1]}: the merged table differs from that of one process")
        digest = hashlib.sha256(whole.read_bytes()).hexdigest()[:16]
        print(f"{rows} runs in chunks of {CHUNK}: the merged table has the hash of that of one process, {digest}")


if __name__ == "__main__":
    main()
