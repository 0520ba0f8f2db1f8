"""A scene as one run of bytes: a `.glb` as it is, a `.gltf` with its files as a `.zip`."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any
from urllib.parse import unquote

# A zip's bytes, and so the scene's name, must not depend on when it was made.
_EPOCH = (1980, 1, 1, 0, 0, 0)


def read(path: Path) -> bytes:
    """The bytes to upload. Raises `FileNotFoundError` and `ValueError`, which name the file."""
    if path.suffix.lower() != ".gltf":
        return path.read_bytes()
    text = path.read_bytes()
    try:
        document = json.loads(text)
    except ValueError as error:
        raise ValueError(f"{path}: not JSON: {error}") from error
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        _add(archive, path.name, text)
        for name in sorted(_files(path, document)):
            _add(archive, name, (path.parent / name).read_bytes())
    return packed.getvalue()


def _add(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    archive.writestr(zipfile.ZipInfo(name, _EPOCH), data, zipfile.ZIP_DEFLATED)


def _files(path: Path, document: Any) -> set[str]:
    """The files beside a document that its buffers and images name."""
    if not isinstance(document, dict):
        raise ValueError(f"{path}: not a glTF document")
    names = set()
    for kind in ("buffers", "images"):
        for i, item in enumerate(document.get(kind, [])):
            uri = item.get("uri") if isinstance(item, dict) else None
            if not isinstance(uri, str) or uri.startswith("data:"):
                continue
            name = unquote(uri)
            folder = path.parent.resolve()
            if not (folder / name).resolve().is_relative_to(folder):
                raise ValueError(f"{path}: /{kind}/{i}/uri: {uri} is outside the scene's folder")
            names.add(name)
    return names
