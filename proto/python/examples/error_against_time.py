"""Renders a scene by several methods and plots the error of each against worker seconds.

    python examples/error_against_time.py SCENE.glb --methods path bidirectional --samples 256 -o error.png
"""

from __future__ import annotations

import argparse

from ovtigre import Farm


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    arguments.add_argument("scene")
    arguments.add_argument("--server", default="http://127.0.0.1:7700")
    arguments.add_argument("--methods", nargs="+", default=["path", "bidirectional"])
    arguments.add_argument("--size", default="320x180")
    arguments.add_argument("--samples", type=int, default=256)
    arguments.add_argument("-o", "--output", default="error.png")
    asked = arguments.parse_args()

    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plot

    figure, axes = plot.subplots(figsize=(7, 4.5))
    with Farm(asked.server) as farm:
        scene = farm.upload(asked.scene)
        for method in asked.methods:
            job = farm.submit_uploaded(scene, method=method, size=asked.size, samples=asked.samples)
            for status in job.watch():
                told = f"{status.error.relative_error:.2%}" if status.error and status.error.relative_error else "–"
                print(f"{method}: {status.state}, {status.samples_done:.0f} samples, error {told}")
            rows = job.curve().rows
            seconds = [row.worker_seconds for row in rows]
            error = [float("nan") if row.relative_error is None else row.relative_error for row in rows]
            upper = [row.relative_error_upper or float("nan") for row in rows]
            axes.loglog(seconds, error, marker="o", label=method)
            axes.fill_between(seconds, error, upper, alpha=0.2)
    axes.set_xlabel("worker seconds")
    axes.set_ylabel("relative error (shaded: up to its upper bound)")
    axes.legend()
    axes.grid(visible=True, which="both", alpha=0.3)
    figure.tight_layout()
    figure.savefig(asked.output, dpi=120)
    print(asked.output)


if __name__ == "__main__":
    main()
