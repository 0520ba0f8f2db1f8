"""What is tried again, on a farm that answers as a test says."""

from __future__ import annotations

from collections.abc import Callable

import httpx
import pytest

from ovtigre.calls import Calls
from ovtigre.problem import Problem

Answers = Callable[[httpx.Request], httpx.Response]


@pytest.fixture()
def calls(monkeypatch: pytest.MonkeyPatch) -> Callable[[Answers], Calls]:
    """Calls that `answers` answers, without pauses between tries."""
    monkeypatch.setattr("time.sleep", lambda seconds: None)

    def make(answers: Answers) -> Calls:
        made = Calls("http://farm", "secret", 1.0)
        made.http = httpx.Client(
            base_url="http://farm", headers=made.http.headers, transport=httpx.MockTransport(answers)
        )
        return made

    return make


def test_a_busy_farm_is_asked_again_with_the_same_key(calls: Callable[[Answers], Calls]) -> None:
    keys = []

    def answers(request: httpx.Request) -> httpx.Response:
        keys.append(request.headers["Idempotency-Key"])
        if len(keys) == 1:
            raise httpx.ConnectError("nobody")
        if len(keys) == 2:
            return httpx.Response(429, headers={"Retry-After": "1"})
        assert request.headers["Authorization"] == "Bearer secret"
        return httpx.Response(202, json={"id": "a"})

    made = calls(answers).json("POST", "/v1/jobs", body={}, headers={"Idempotency-Key": "k"})
    assert made == {"id": "a"} and keys == ["k", "k", "k"]


def test_a_refusal_is_not_tried_again(calls: Callable[[Answers], Calls]) -> None:
    asked = []

    def answers(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        fault = {"pointer": "/samples", "detail": "must be at least 1"}
        return httpx.Response(422, json={"title": "Invalid job", "status": 422, "errors": [fault]})

    with pytest.raises(Problem, match="Invalid job: /samples: must be at least 1"):
        calls(answers).json("POST", "/v1/jobs", body={})
    assert len(asked) == 1


def test_a_list_is_followed_to_its_end(calls: Callable[[Answers], Calls]) -> None:
    def answers(request: httpx.Request) -> httpx.Response:
        if "cursor" in request.url.params:
            return httpx.Response(200, json={"items": [{"n": 2}], "next": None})
        return httpx.Response(200, json={"items": [{"n": 1}], "next": "more"})

    assert [item["n"] for item in calls(answers).pages("/v1/jobs")] == [1, 2]


def test_a_broken_stream_goes_on_after_what_was_seen(calls: Callable[[Answers], Calls]) -> None:
    class Broken(httpx.SyncByteStream):
        def __iter__(self):  # type: ignore[no-untyped-def]
            yield b'id: 1\nevent: status\ndata: {"n": 1}\n\nid: 2\nevent: sta'
            raise httpx.ReadError("gone")

    asked = []

    def answers(request: httpx.Request) -> httpx.Response:
        asked.append(request.headers.get("Last-Event-ID"))
        if len(asked) == 1:
            return httpx.Response(200, stream=Broken())
        return httpx.Response(200, content=b'id: 2\nevent: status\ndata: {"n":\ndata: 2}\n\n')

    seen = list(calls(answers).events("/v1/jobs/a/events"))
    # The id of event 2 came, its data did not: a farm that is asked from there would leave it out.
    assert seen == [("status", {"n": 1}), ("status", {"n": 2})]
    assert asked == [None, "1"]
