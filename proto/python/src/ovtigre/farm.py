"""A farm and its doors."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import blake3

from ovtigre import bundle
from ovtigre.calls import Calls
from ovtigre.job import Job
from ovtigre.problem import Problem
from ovtigre.status import Status, Worker


class Farm:
    """A farm at an address.

    `token` is one of `ovtigre token create`; without, `OVTIGRE_TOKEN` is taken where it is set. `timeout` is in
    seconds, for one try of a call.
    """

    def __init__(
        self, server: str = "http://127.0.0.1:7700", *, token: str | None = None, timeout: float = 60.0
    ) -> None:
        self._calls = Calls(server, token or os.environ.get("OVTIGRE_TOKEN"), timeout)

    def __enter__(self) -> Farm:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes its connections."""
        self._calls.http.close()

    def upload(self, scene: str | os.PathLike[str] | bytes) -> str:
        """Brings a `.glb`, a `.zip`, or a `.gltf` with the files it names; only where the farm lacks it. Gives its id."""
        data = scene if isinstance(scene, bytes) else bundle.read(Path(scene))
        id = str(blake3.blake3(data).hexdigest())
        try:
            self._calls.send("GET", f"/v1/scenes/{id}")
        except Problem as problem:
            if problem.status != 404:
                raise
            self._calls.send("PUT", f"/v1/scenes/{id}", content=data)
        return id

    def scene(self, id: str) -> dict[str, Any]:
        """What is in a scene: triangles, lights, cameras, needs, warnings."""
        report: dict[str, Any] = self._calls.json("GET", f"/v1/scenes/{id}")
        return report

    def submit(self, scene: str | os.PathLike[str] | bytes, **job: Any) -> Job:
        """Uploads a scene and starts a job of it. `job` holds the command's flags by their names: `size="640x360"`,
        `samples=256`, `error=0.01`, `method="bidirectional"`, `layers=["direct=LDE"]`, …
        """
        return self.submit_uploaded(self.upload(scene), **job)

    def submit_uploaded(self, scene: str, **job: Any) -> Job:
        """Starts a job of a scene that the farm has. A repeat of the call after a lost answer starts no second one."""
        headers = {"Idempotency-Key": str(uuid.uuid4())}
        status = self._calls.json("POST", "/v1/jobs", body={"scene": scene, **job}, headers=headers)
        return Job(self._calls, status["id"])

    def check(self, scene: str, **job: Any) -> dict[str, Any]:
        """What such a job would be, without starting it. Raises `Problem` with the pointer of what is wrong."""
        answer: dict[str, Any] = self._calls.json(
            "POST", "/v1/jobs", body={"scene": scene, **job}, params={"dry_run": "true"}
        )
        return answer

    def job(self, id: str) -> Job:
        """A job by its id."""
        return Job(self._calls, id)

    def jobs(self, state: str | None = None) -> Iterator[Status]:
        """All jobs, or those in a state, newest first."""
        params = {"state": state} if state else None
        return map(Status.read, self._calls.pages("/v1/jobs", params))

    def workers(self) -> Iterator[Worker]:
        """All workers."""
        return map(Worker.read, self._calls.pages("/v1/workers"))
