"""What other programs see in a farm's pictures, and what the documents promise of them."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from conftest import SCENE

from ovtigre import Farm

ROOT = Path(__file__).parents[3]
READER = shutil.which("oiiotool")


@pytest.mark.skipif(READER is None, reason="needs Debian's package openimageio-tools")
def test_openimageio_reads_the_layers_and_their_attributes(farm: Farm, tmp_path: Path) -> None:
    file = tmp_path / "picture.exr"
    job = farm.submit(SCENE, size="32x18", samples=16, seed=5, method="path", layers=["direct=L.E", "rest=L.{2,}E"])
    job.wait()
    job.save(file)
    assert READER
    told = subprocess.run([READER, "--info", "-v", "--stats", file], capture_output=True, text=True, check=True).stdout
    assert re.search(r"32 x +18, 18 channel, float openexr", told), told
    [channels] = re.findall(r"channel list: (.*)", told)
    planes = ["", "error.", "direct.", "direct.error.", "rest.", "rest.error."]
    assert sorted(channels.split(", ")) == sorted(plane + c for plane in planes for c in "RGB")
    said = dict(re.findall(r"^ +([\w.:]+): (.*)$", told, re.MULTILINE))
    # Numbers and texts that REFERENCE.md names.
    table = (ROOT / "docs" / "REFERENCE.md").read_text().split("| attribute | says |")[1].split("\n\n")[0]
    for name in re.findall(r"`(ovtigre\.[\w.]+|samplesPerPixel|software)`", table.replace("layer.NAME", "layer.direct")):
        assert any(name.lower() == key.lower() for key in said), f"{name} is not in {said}"
    assert said["ovtigre.job"] == f'"{job.id}"'
    assert said["ovtigre.method"] == '"path"' and said["ovtigre.layer.direct"] == '"L.E"'
    assert float(said["ovtigre.samples"]) == 16
    assert "0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329" in said["chromaticities"]
    for count in ("NanCount", "InfCount"):
        assert re.search(rf"Stats {count}:( 0){{18}} *$", told, re.MULTILINE), told


def test_the_example_of_the_read_me_runs(server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    [example] = re.findall(r"^```python\n(.*?)^```", (ROOT / "proto/python/README.md").read_text(), re.M | re.S)
    assert "http://127.0.0.1:7700" in example
    shutil.copy(SCENE, tmp_path / "scene.glb")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(example.replace("http://127.0.0.1:7700", server), names)
    picture = names["picture"]
    assert getattr(picture, "rgb").shape == (90, 160, 3) and getattr(picture, "error").shape == (90, 160, 3)
