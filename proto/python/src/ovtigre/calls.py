"""Calls to a farm: what is tried again, and what a refusal becomes."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from typing import Any

import httpx

from ovtigre.problem import FarmUnreachable, Problem

# Seconds between tries of a call that found no farm, or one that is busy.
_PAUSES = (0.2, 0.5, 1.0, 2.0, 4.0)
_BUSY = frozenset({429, 502, 503, 504})
# No call may keep a program waiting for longer than this between two tries.
_LONGEST_PAUSE = 30.0


class Calls:
    """A connection to a farm. Every call of the interface may be made twice, so all are tried again."""

    def __init__(self, server: str, token: str | None, timeout: float) -> None:
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        self.http = httpx.Client(base_url=server.rstrip("/"), headers=headers, timeout=timeout)

    def send(
        self,
        method: str,
        path: str,
        *,
        body: Any = None,
        content: bytes | None = None,
        params: Mapping[str, str] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> httpx.Response:
        """Makes a call. Raises `Problem` where it is refused and `FarmUnreachable` where nobody answers."""
        last: Exception | None = None
        for pause in (*_PAUSES, None):
            try:
                answer = self.http.request(
                    method, path, json=body, content=content, params=params, headers=headers
                )
            except httpx.TransportError as error:
                last, wait = error, pause
            else:
                if answer.status_code not in _BUSY or pause is None:
                    return _accepted(answer)
                last, wait = None, max(pause, _retry_after(answer))
            if wait is None:
                break
            time.sleep(min(wait, _LONGEST_PAUSE))
        raise FarmUnreachable(f"{self.http.base_url}: {last}") from last

    def json(self, method: str, path: str, **call: Any) -> Any:
        """Makes a call whose answer is JSON."""
        return self.send(method, path, **call).json()

    def pages(self, path: str, params: Mapping[str, str] | None = None) -> Iterator[dict[str, Any]]:
        """All items of a list, page by page."""
        cursor: str | None = None
        while True:
            more = {"cursor": cursor} if cursor else {}
            page = self.json("GET", path, params={**(params or {}), **more})
            yield from page["items"]
            cursor = page.get("next")
            if not cursor:
                return

    def events(self, path: str) -> Iterator[tuple[str, Any]]:
        """Server-sent events as (kind, data). A stream that breaks off goes on after the last event that came."""
        seen: str | None = None
        failures = 0
        while True:
            headers = {"Accept": "text/event-stream"} | ({"Last-Event-ID": seen} if seen else {})
            try:
                with self.http.stream("GET", path, headers=headers, timeout=60.0) as answer:
                    if answer.status_code != 200:
                        answer.read()
                        _accepted(answer)
                    kind, data, id = "message", [], seen
                    for line in answer.iter_lines():
                        name, _, value = line.partition(":")
                        value = value.removeprefix(" ")
                        if name == "id":
                            id = value
                        elif name == "event":
                            kind = value
                        elif name == "data":
                            data.append(value)
                        elif not line and data:
                            # An id counts once its event has come whole.
                            seen, failures = id, 0
                            yield kind, json.loads("\n".join(data))
                            kind, data = "message", []
                return
            except httpx.TransportError as error:
                if failures == len(_PAUSES):
                    raise FarmUnreachable(f"{self.http.base_url}: {error}") from error
                time.sleep(_PAUSES[failures])
                failures += 1


def _retry_after(answer: httpx.Response) -> float:
    try:
        return float(answer.headers.get("Retry-After", "0"))
    except ValueError:
        return 0.0


def _accepted(answer: httpx.Response) -> httpx.Response:
    if answer.status_code < 400:
        return answer
    try:
        document = answer.json()
    except ValueError:
        document = {"title": f"HTTP {answer.status_code}", "detail": answer.text[:200]}
    raise Problem(answer.status_code, document if isinstance(document, dict) else {})
