"""The client on a live farm."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import SCENE

from ovtigre import Farm, FarmUnreachable, JobFailed, Picture, Problem

SMALL = {"size": "32x18", "samples": 16, "name": "small"}


def test_a_picture_comes_with_its_error(farm: Farm, tmp_path: Path) -> None:
    job = farm.submit(SCENE, layers=["direct=L.E"], **SMALL)
    states = [status.state for status in job.watch()]
    assert states[-1] == "done"
    picture = job.picture()
    assert picture.rgb.shape == (18, 32, 3) and picture.rgb.dtype == np.float32
    assert picture.error is not None and picture.error.shape == (18, 32, 3)
    assert (picture.error >= 0).all() and picture.error.max() > 0
    direct = picture.layers["direct"]
    assert set(picture.layers) == {"direct"} and direct.error is not None
    # Words of one scattering are some of all words, sample by sample.
    assert (direct.rgb <= picture.rgb * (1 + 1e-5) + 1e-6).all() and direct.rgb.sum() > 0
    assert picture.samples == 16
    assert picture.attributes["ovtigre.job"] == job.id

    last = job.curve().rows[-1]
    assert last.samples == 16 and last.rms_error is not None
    rms = float(np.sqrt((picture.error.astype(np.float64) ** 2).mean()))
    assert rms == pytest.approx(last.rms_error, rel=1e-3)

    job.save(tmp_path / "small.exr")
    saved = Picture.read(tmp_path / "small.exr")
    np.testing.assert_array_equal(saved.rgb, picture.rgb)
    job.save(tmp_path / "small.png")
    assert (tmp_path / "small.png").read_bytes()[:4] == b"\x89PNG"
    assert job.next_picture(picture, wait=0) is None


def test_more_samples_are_the_samples_of_a_longer_job(farm: Farm) -> None:
    job = farm.submit(SCENE, **SMALL)
    job.wait()
    first = job.picture()
    job.change(samples=32)
    job.wait()
    more = job.picture()
    assert more.samples == 32 and more.etag != first.etag
    whole = farm.submit(SCENE, **{**SMALL, "samples": 32})
    whole.wait()
    np.testing.assert_array_equal(more.rgb, whole.picture().rgb)


def test_a_scene_is_brought_once(farm: Farm) -> None:
    id = farm.upload(SCENE)
    assert farm.upload(SCENE.read_bytes()) == id
    assert farm.scene(id)["triangles"] > 0


def test_a_gltf_brings_its_files(farm: Farm, tmp_path: Path) -> None:
    positions = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    (tmp_path / "a triangle.bin").write_bytes(positions)
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "a%20triangle.bin"}],
    }
    scene = tmp_path / "triangle.gltf"
    scene.write_text(json.dumps(document))
    assert farm.scene(farm.upload(scene))["triangles"] == 1

    document["buffers"] = [{"byteLength": 36, "uri": "../elsewhere.bin"}]
    scene.write_text(json.dumps(document))
    with pytest.raises(ValueError, match="/buffers/0/uri: .* outside"):
        farm.upload(scene)


def test_a_refusal_says_what_and_where(farm: Farm) -> None:
    scene = farm.upload(SCENE)
    with pytest.raises(Problem) as refused:
        farm.submit_uploaded(scene, paths="L(D|X)E")
    assert refused.value.status in (400, 422)
    assert any("/paths" in fault.pointer for fault in refused.value.errors)
    assert farm.check(scene, paths="L(D|S)E")
    with pytest.raises(Problem) as missing:
        farm.job("000000000000").status()
    assert missing.value.status == 404


def test_jobs_and_workers_are_listed(farm: Farm) -> None:
    job = farm.submit(SCENE, **SMALL)
    job.wait()
    assert job.id in {status.id for status in farm.jobs("done")}
    assert [worker.threads > 0 for worker in farm.workers()] == [True]


def test_a_cancelled_job_is_not_waited_for(farm: Farm) -> None:
    job = farm.submit(SCENE, size="640x360", samples=65536)
    assert job.pause().state == "paused"
    assert job.resume().state in ("queued", "running")
    job.cancel()
    with pytest.raises(JobFailed, match="cancelled"):
        job.wait()


def test_no_farm_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ovtigre.calls._PAUSES", (0.01,))
    with Farm("http://127.0.0.1:9") as nobody, pytest.raises(FarmUnreachable):
        nobody.upload(SCENE)


def test_the_example_plots(server: str, tmp_path: Path) -> None:
    example = Path(__file__).parents[1] / "examples" / "error_against_time.py"
    output = tmp_path / "error.png"
    arguments = [str(SCENE), "--server", server, "--size", "32x18", "--samples", "16", "-o", str(output)]
    subprocess.run([sys.executable, str(example), *arguments], check=True, timeout=120)
    assert output.stat().st_size > 10_000
