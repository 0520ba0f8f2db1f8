"""What README.md shows, as it stands there but for the farm's address and a smaller picture."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from conftest import SCENE

INSTEAD = {'"160x90", error=0.2': '"32x18", error=0.5'}


def test_the_readme_runs(server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    shown = re.findall(r"^```python\n(.*?)^```", (Path(__file__).parents[1] / "README.md").read_text(), re.M | re.S)
    assert len(shown) == 1
    code = shown[0]
    for said, run in {"http://127.0.0.1:7700": server, **INSTEAD}.items():
        assert said in code
        code = code.replace(said, run)
    shutil.copy(SCENE, tmp_path / "scene.glb")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(code, names)
    assert names["picture"].rgb.shape == (18, 32, 3)
    assert "done" in capsys.readouterr().out
