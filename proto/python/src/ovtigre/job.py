"""A job on a farm."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ovtigre.calls import Calls
from ovtigre.picture import Picture
from ovtigre.problem import JobFailed
from ovtigre.status import Curve, Status


class Job:
    """A job, by its id: watched, changed, and its picture fetched at any time."""

    def __init__(self, calls: Calls, id: str) -> None:
        self._calls = calls
        self.id = id

    def __repr__(self) -> str:
        return f"Job({self.id!r})"

    @property
    def _path(self) -> str:
        return f"/v1/jobs/{self.id}"

    def status(self) -> Status:
        """How it stands now."""
        return Status.read(self._calls.json("GET", self._path))

    def watch(self) -> Iterator[Status]:
        """How it stands, at every change, until it is over."""
        while True:
            for kind, data in self._calls.events(f"{self._path}/events"):
                if kind == "status":
                    status = Status.read(data)
                    yield status
                    if status.is_over:
                        return
            status = self.status()
            if status.is_over:
                yield status
                return

    def wait(self) -> Status:
        """Waits until it is done. Raises `JobFailed` where it fails or is cancelled."""
        for status in self.watch():
            last = status
        if last.state != "done":
            raise JobFailed(f"job {self.id} {last.state}: {last.reason or 'no reason given'}")
        return last

    def curve(self) -> Curve:
        """Its error against run time so far."""
        return Curve.read(self._calls.json("GET", f"{self._path}/error.json"))

    def picture(self) -> Picture:
        """The picture so far, with its error. Raises `Problem` (404) before there is one."""
        answer = self._calls.send("GET", f"{self._path}/image.exr")
        return Picture.decode(answer.content, answer.headers.get("ETag"))

    def next_picture(self, picture: Picture, wait: float = 30.0) -> Picture | None:
        """A picture after this one; `None` where none comes within `wait` seconds."""
        if picture.etag is None:
            raise ValueError("only a picture that came from a job has a next one")
        headers = {"If-None-Match": picture.etag, "Prefer": f"wait={wait:.0f}"}
        answer = self._calls.send("GET", f"{self._path}/image.exr", headers=headers)
        if answer.status_code == 304:
            return None
        return Picture.decode(answer.content, answer.headers.get("ETag"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the picture so far: an OpenEXR file, or a developed PNG where the name ends so."""
        kind = "png" if os.fspath(path).lower().endswith(".png") else "exr"
        Path(path).write_bytes(self._calls.send("GET", f"{self._path}/image.{kind}").content)

    def change(self, **changes: Any) -> Status:
        """Changes what may change: `priority`, `samples`, `error`, `weight`, `max_workers`, `state`."""
        return Status.read(self._calls.json("PATCH", self._path, body=changes))

    def pause(self) -> Status:
        """Hands out no more of its batches."""
        return self.change(state="paused")

    def resume(self) -> Status:
        """Goes on after a pause."""
        return self.change(state="running")

    def cancel(self, *, purge: bool = False) -> None:
        """Ends it; with `purge` its files go, too."""
        self._calls.send("DELETE", self._path, params={"purge": "true"} if purge else None)
