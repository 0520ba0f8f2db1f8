"""A live farm with a worker, by the program that OVTIGRE_PROGRAM names."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from ovtigre import Farm

SCENE = Path(__file__).parents[3] / "tests" / "scenes" / "room.glb"


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a farm that lives as long as the tests."""
    data = tmp_path_factory.mktemp("farm")
    program = os.environ["OVTIGRE_PROGRAM"]
    farm = subprocess.Popen(
        [program, "serve", "--listen", "127.0.0.1:0", "--data", str(data), "--workers", "1"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert farm.stdout
    address = next(word for line in farm.stdout for word in line.split() if word.startswith("http://"))
    yield address
    farm.terminate()
    assert farm.wait(timeout=30) == 0


@pytest.fixture()
def farm(server: str) -> Iterator[Farm]:
    """A client of it."""
    with Farm(server) as client:
        yield client
