"""What a farm says of jobs and workers. Fields that a newer farm adds are in `raw`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

ENDED = frozenset({"done", "failed", "cancelled"})


@dataclass(frozen=True)
class CurveRow:
    """A checkpoint of a job: samples a pixel, what they cost, and the error then."""

    samples: int
    wall_seconds: float
    worker_seconds: float
    rays: int
    rms_error: float | None
    relative_error: float | None
    relative_error_upper: float | None

    @classmethod
    def read(cls, row: dict[str, Any]) -> CurveRow:
        """Reads a row as the farm writes it."""
        return cls(
            samples=int(row["samples"]),
            wall_seconds=float(row["wall_seconds"]),
            worker_seconds=float(row["worker_seconds"]),
            rays=int(row["rays"]),
            rms_error=row.get("rms_error"),
            relative_error=row.get("relative_error"),
            relative_error_upper=row.get("relative_error_upper"),
        )


@dataclass(frozen=True)
class Curve:
    """Error against run time. `slope` is d log(error) / d log(time); `efficiency` is 1 / (error² · worker seconds)."""

    rows: list[CurveRow]
    slope: float | None
    efficiency: float | None
    error_target: float | None
    target_expected_at_seconds: float | None
    certified: bool
    raw: dict[str, Any] = field(repr=False)

    @classmethod
    def read(cls, curve: dict[str, Any]) -> Curve:
        """Reads `error.json`."""
        return cls(
            rows=[CurveRow.read(row) for row in curve["rows"]],
            slope=curve.get("slope"),
            efficiency=curve.get("efficiency"),
            error_target=curve.get("error_target"),
            target_expected_at_seconds=curve.get("target_expected_at_seconds"),
            certified=bool(curve.get("certified", False)),
            raw=curve,
        )


@dataclass(frozen=True)
class Status:
    """How a job stands."""

    id: str
    name: str
    scene: str
    state: str
    reason: str | None
    samples_done: float
    samples_asked: int
    wall_seconds: float
    worker_seconds: float
    workers: int
    method: str
    certified: bool
    invalid_samples: int
    error: CurveRow | None
    warnings: list[str]
    raw: dict[str, Any] = field(repr=False)

    @property
    def is_over(self) -> bool:
        """Whether nothing more will come, unless more is asked for."""
        return self.state in ENDED

    @classmethod
    def read(cls, status: dict[str, Any]) -> Status:
        """Reads a job as the farm writes it."""
        error = status.get("error")
        return cls(
            id=status["id"],
            name=status.get("name", ""),
            scene=status["scene"],
            state=status["state"],
            reason=status.get("reason"),
            samples_done=float(status["samples_done"]),
            samples_asked=int(status["samples_asked"]),
            wall_seconds=float(status["wall_seconds"]),
            worker_seconds=float(status["worker_seconds"]),
            workers=int(status["workers"]),
            method=status["method"],
            certified=bool(status.get("certified", False)),
            invalid_samples=int(status.get("invalid_samples", 0)),
            error=CurveRow.read(error) if error else None,
            warnings=[str(warning) for warning in status.get("warnings", [])],
            raw=status,
        )


@dataclass(frozen=True)
class Worker:
    """A worker of the farm."""

    id: str
    name: str
    state: str
    threads: int
    batches_done: int
    failures: int
    raw: dict[str, Any] = field(repr=False)

    @classmethod
    def read(cls, worker: dict[str, Any]) -> Worker:
        """Reads a worker as the farm writes it."""
        return cls(
            id=worker["id"],
            name=worker["name"],
            state=worker["state"],
            threads=int(worker["threads"]),
            batches_done=int(worker["batches_done"]),
            failures=int(worker["failures"]),
            raw=worker,
        )
