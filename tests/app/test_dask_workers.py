"""`--farm tls://…`: workers on a Dask cluster, here one of this machine; the same bytes."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from radiosity_addon.base import BakeError
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.farm import DaskWorkers, Spool
from tests.moments import until
from tests.processes import ROOT

from .test_local_workers import BAKE, WAITING_BAKE, alone, claimants, each_call, kill_workers

__all__ = ["alone"]


@pytest.fixture(scope="module")
def distributed() -> Any:
    return pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster(distributed: Any) -> Iterator[Any]:
    """Two workers of one thread each, which are processes that are started again when they die."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        yield cluster


@pytest.fixture
def busy(distributed: Any, cluster: Any) -> Iterator[Callable[[], bool]]:
    """Tells whether the cluster runs anything."""
    with distributed.Client(cluster.scheduler_address) as client:
        yield lambda: any(client.processing().values())


def words(folder: Path, scheduler: str) -> list[str]:
    return [*BAKE, "--output", str(folder / "out"), "--spool", str(folder / "spool"), "--farm", scheduler]


def test_a_cluster_gives_the_same_bytes(
    alone: bytes, cluster: Any, busy: Callable[[], bool], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    helped: set[int] = set()

    def wait_for_both(spool: Spool, digest: str) -> None:
        if len(helped) < 2:
            until(lambda: claimants(spool, digest))
            helped.update(claimants(spool, digest))

    each_call(monkeypatch, wait_for_both)
    assert main(words(tmp_path, cluster.scheduler_address)) == 0
    assert len(helped) == 2
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    assert not json.loads((tmp_path / "out" / "report.json").read_text())["warnings"]
    assert sorted(path.name for path in (tmp_path / "spool").iterdir()) == ["over", "spool.json"]
    until(lambda: not busy())


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")
def test_a_process_of_the_cluster_that_is_killed_costs_its_tasks(
    alone: bytes, cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    killed = kill_workers(monkeypatch, 2)
    assert main(words(tmp_path, cluster.scheduler_address)) == 0
    assert len(killed) >= 2
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone


def test_workers_of_another_version_are_refused(
    alone: bytes, cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start, started = DaskWorkers.start, list[DaskWorkers]()

    def start_in_another_version(self: DaskWorkers, spool: Spool) -> None:
        record = json.loads((spool.path / "spool.json").read_text())
        record["program"]["NumPy"] = "1.0"
        (spool.path / "spool.json").write_text(json.dumps(record))
        start(self, spool)
        started.append(self)

    monkeypatch.setattr(DaskWorkers, "start", start_in_another_version)
    each_call(
        monkeypatch,
        lambda *_: until(lambda: all(each.status == "error" for each in started[0].futures)),
    )
    assert main(words(tmp_path, cluster.scheduler_address)) == 0
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    (warning,) = json.loads((tmp_path / "out" / "report.json").read_text())["warnings"]
    assert warning["message"].startswith("2 of 2 workers on the cluster failed: spool ")
    assert "is of another NumPy (1.0, here " in warning["message"]


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")
@pytest.mark.parametrize("name", ["SIGINT", "SIGKILL"])
def test_an_interrupted_bake_leaves_the_cluster(
    name: str, distributed: Any, cluster: Any, busy: Callable[[], bool], tmp_path: Path
) -> None:
    command = [sys.executable, "-c", WAITING_BAKE, *words(tmp_path, cluster.scheduler_address)]
    paths = {**os.environ, "PYTHONPATH": str(Path(distributed.__file__).parents[1])}
    baking = subprocess.Popen(
        command, cwd=ROOT, env=paths, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    spool = tmp_path / "spool"
    until(lambda: len(list(spool.glob("calls/*/*.result"))) >= 2)
    assert busy()
    os.kill(baking.pid, getattr(signal, name))
    (spool / "go").touch()
    _, said = baking.communicate(timeout=60)
    if name == "SIGINT":
        assert baking.returncode == 130
        assert said.startswith("error: interrupted; nothing was written; what was computed is kept in ")
        assert said.count("\n") == 1
    until(lambda: not busy())


def test_a_cluster_that_is_lost_leaves_the_bake_alone(
    alone: bytes, distributed: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster:
        is_open = True

        def lose(spool: Spool, digest: str) -> None:
            nonlocal is_open
            if is_open:
                until(lambda: claimants(spool, digest))
                cluster.close()
                is_open = False

        each_call(monkeypatch, lose)
        assert main(words(tmp_path, cluster.scheduler_address)) == 0
    assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    (warning,) = json.loads((tmp_path / "out" / "report.json").read_text())["warnings"]
    assert warning["message"].startswith("the cluster was lost: ")


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make a certificate with")
def test_a_cluster_is_reached_through_tls_as_dask_is_set_up(
    alone: bytes,
    distributed: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    make = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost"]
    subprocess.run([*make, "-keyout", key, "-out", certificate], capture_output=True, check=True)
    settings: dict[str, Any] = {"ca-file": str(certificate)}
    for who in ("client", "scheduler", "worker"):
        settings |= {f"{who}.cert": str(certificate), f"{who}.key": str(key)}
    settings = {f"distributed.comm.tls.{name}": value for name, value in settings.items()}
    import dask

    with dask.config.set({**settings, "distributed.comm.require-encryption": True}):
        security = distributed.Security()
        with distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, dashboard_address=":0", security=security, protocol="tls://"
        ) as cluster:
            assert cluster.scheduler_address.startswith("tls://")
            each_call(monkeypatch, lambda spool, digest: until(lambda: claimants(spool, digest)))
            assert main(words(tmp_path, cluster.scheduler_address)) == 0
            assert (tmp_path / "out" / "lightmap.exr").read_bytes() == alone
    capsys.readouterr()
    # Without these settings nothing is reached, and that is one line.
    assert main(words(tmp_path, "tls://127.0.0.1:1")) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: --farm tls://127.0.0.1:1: ")
    assert said.endswith("see Dask's settings for TLS\n")
    assert said.count("\n") == 1


def test_a_scheduler_that_does_not_answer_is_one_line(
    distributed: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("radiosity_addon.farm.dask_workers.CONNECT", "0.2s")
    assert main(words(tmp_path, "tcp://127.0.0.1:1")) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: --farm tcp://127.0.0.1:1: ")
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_without_dask_the_package_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(words(tmp_path, "tls://farm:8786")) == 1
    said = capsys.readouterr().err
    assert said == (
        "error: --farm tls://farm:8786 needs Dask (distributed is not installed): run "
        "`pip install distributed`\n"
    )
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(BakeError):
        DaskWorkers("tls://farm:8786")


@pytest.mark.parametrize(
    "spec",
    [
        "tcp://farm:8786",
        "tcp://127.0.0.1.x:1",
        "http://farm:1",
        "tls://farm",
        "tls://farm:0",
        "tls://farm:99999",
        "tls://:8786",
        "tls://[::1",
        "tls://me@farm:1",
        "tls://fa rm:1",
        "tls://farm:1/x",
        "tls://farm:1?x",
    ],
)
def test_other_addresses_are_usage_errors(
    spec: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(tmp_path, spec)) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: --farm '{spec}'")
    assert said.count("\n") == 1


def test_a_cluster_needs_a_folder_that_it_shares(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*BAKE, "--output", str(tmp_path / "out"), "--farm", "tls://farm:8786"]) == 2
    assert "tls://farm:8786 needs --spool DIR" in capsys.readouterr().err
