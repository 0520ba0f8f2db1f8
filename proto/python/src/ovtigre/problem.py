"""What can go wrong between a program and a farm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Fault:
    """One fault of a document: where (a JSON pointer) and what."""

    pointer: str
    detail: str


class Problem(Exception):
    """The farm refused a call (RFC 9457): `status`, `type`, `title`, `detail` and the faults of the document sent."""

    def __init__(self, status: int, document: dict[str, Any]) -> None:
        self.status = status
        self.type = str(document.get("type", "about:blank"))
        self.title = str(document.get("title", f"HTTP {status}"))
        self.detail = str(document.get("detail", ""))
        self.errors = [
            Fault(str(fault.get("pointer", "")), str(fault.get("detail", "")))
            for fault in document.get("errors", [])
        ]
        told = "; ".join(f"{fault.pointer}: {fault.detail}" for fault in self.errors) or self.detail
        super().__init__(f"{self.title}: {told}" if told else self.title)


class FarmUnreachable(Exception):
    """The farm did not answer, however often it was asked."""


class JobFailed(Exception):
    """A job ended without what was waited for: it failed or was cancelled."""
