"""What a farm tells Prometheus, and what the dashboard and the alerts make of it."""

from __future__ import annotations

import json
import re
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from conftest import SCENE
from prometheus_client.parser import text_string_to_metric_families

from ovtigre import Farm

ROOT = Path(__file__).parents[3]
MONITORING = ROOT / "deploy" / "monitoring"


def expressions() -> list[str]:
    """Every query of the dashboard and of the alerts."""
    dashboard = json.loads((MONITORING / "grafana.json").read_text())
    queries = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    return queries + re.findall(r"^ *expr: (.*)$", (MONITORING / "alerts.yaml").read_text(), re.MULTILINE)


def documented() -> dict[str, str]:
    """Types of the numbers, as their document says."""
    text = (ROOT / "docs" / "OPERATING.md").read_text()
    rows = re.findall(r"^\| (`ovtigre_[^|]*) \| (\w+) \|", text, re.MULTILINE)
    return {name: kind for names, kind in rows for name in re.findall(r"`(ovtigre_\w+)", names)}


@pytest.fixture()
def types(server: str) -> dict[str, str]:
    """Types of the numbers that a live farm shows."""
    families = text_string_to_metric_families(httpx.get(f"{server}/metrics").text)
    return {sample.name: family.type for family in families for sample in family.samples}


def test_what_is_asked_for_and_what_is_told_is_there(types: dict[str, str]) -> None:
    asked = {name for query in expressions() for name in re.findall(r"\bovtigre_\w+", query)}
    assert len(asked) >= 6 and asked <= types.keys()
    assert documented() == types


def test_promtool_finds_nothing(server: str) -> None:
    program = shutil.which("promtool")
    if program is None:
        pytest.skip("needs Debian's package prometheus")
    text = httpx.get(f"{server}/metrics").text
    numbers = subprocess.run([program, "check", "metrics"], input=text, text=True, capture_output=True)
    assert (numbers.returncode, numbers.stdout + numbers.stderr) == (0, "")
    for kind, file in [("config", "prometheus.yaml"), ("rules", "alerts.yaml")]:
        checked = subprocess.run([program, "check", kind, MONITORING / file], text=True, capture_output=True)
        assert checked.returncode == 0, checked.stdout + checked.stderr


@pytest.fixture()
def prometheus(server: str, tmp_path: Path) -> Iterator[httpx.Client]:
    """A Prometheus that scrapes the farm."""
    program = shutil.which("prometheus")
    if program is None:
        pytest.skip("needs Debian's package prometheus")
    config = (MONITORING / "prometheus.yaml").read_text()
    config = config.replace("15s", "1s").replace("127.0.0.1:7700", server.removeprefix("http://"))
    (tmp_path / "prometheus.yaml").write_text(config)
    shutil.copy(MONITORING / "alerts.yaml", tmp_path)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    arguments = ["--config.file=prometheus.yaml", "--storage.tsdb.path=data", f"--web.listen-address={address}"]
    with subprocess.Popen([program, *arguments], cwd=tmp_path, stderr=subprocess.DEVNULL) as running:
        try:
            with httpx.Client(base_url=f"http://{address}") as client:
                yield client
        finally:
            running.terminate()


def query(prometheus: httpx.Client, expression: str) -> list[dict[str, Any]]:
    """The vector that an expression gives; empty while there is no answer."""
    try:
        answer = prometheus.get("/api/v1/query", params={"query": expression}).json()
    except httpx.TransportError:
        return []
    assert answer["status"] == "success", f"{expression}: {answer}"
    result: list[dict[str, Any]] = answer["data"]["result"]
    return result


def test_prometheus_scrapes_it(prometheus: httpx.Client, farm: Farm) -> None:
    farm.submit(SCENE, size="32x18", samples=16, replicates=4).wait()  # Four batches at least.
    accepted = 'ovtigre_batches_total{fate="accepted"}'
    deadline = time.monotonic() + 30
    while not (found := query(prometheus, accepted)) or float(found[0]["value"][1]) < 4:
        assert time.monotonic() < deadline, "nothing was scraped"
        time.sleep(0.2)
    # A rate needs two looks, and what is to be seen in five minutes has begun just now.
    panels = [expression for expression in expressions() if ">" not in expression and "==" not in expression]
    assert len(panels) == 10
    for expression in panels:
        while not query(prometheus, expression):
            assert time.monotonic() < deadline, f"{expression} gives nothing"
            time.sleep(0.2)
    for expression in expressions():
        query(prometheus, expression)
    told = prometheus.get("/api/v1/metadata").json()["data"]
    assert {name: about[0]["type"] for name, about in told.items() if name.startswith("ovtigre_")} == documented()
    assert query(prometheus, 'sum(ovtigre_workers{state="active"})')[0]["value"][1] == "1"
    rules = prometheus.get("/api/v1/rules").json()["data"]["groups"][0]["rules"]
    assert len(rules) == 5 and all(rule["health"] in ("ok", "unknown") for rule in rules)
