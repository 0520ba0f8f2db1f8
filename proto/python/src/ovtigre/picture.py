"""A picture with its error, as arrays."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenEXR

Pixels = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Layer:
    """Radiance in linear Rec.709, height × width × 3, and the standard error of each value (none from one replicate)."""

    rgb: Pixels
    error: Pixels | None


@dataclass(frozen=True)
class Picture:
    """A picture, its error, its layers by name, and what its file says of itself."""

    rgb: Pixels
    error: Pixels | None
    layers: dict[str, Layer]
    attributes: dict[str, Any] = field(repr=False)
    etag: str | None = None

    @property
    def samples(self) -> float:
        """Samples a pixel."""
        return float(self.attributes["ovtigre.samples"])

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Picture:
        """Reads an OpenEXR file that ovtigre wrote."""
        with OpenEXR.File(os.fspath(path), separate_channels=True) as file:
            channels = {name: np.asarray(channel.pixels) for name, channel in file.channels().items()}
            attributes = dict(file.header())
        return cls._of(channels, attributes)

    @classmethod
    def decode(cls, data: bytes, etag: str | None = None) -> Picture:
        """Reads the bytes of such a file."""
        # The library reads files, not memory.
        with tempfile.NamedTemporaryFile(suffix=".exr", delete=False) as file:
            file.write(data)
        try:
            picture = cls.read(file.name)
        finally:
            os.unlink(file.name)
        return cls(picture.rgb, picture.error, picture.layers, picture.attributes, etag)

    @classmethod
    def _of(cls, channels: dict[str, Pixels], attributes: dict[str, Any]) -> Picture:
        def plane(prefix: str) -> Pixels | None:
            names = [f"{prefix}{channel}" for channel in "RGB"]
            if not all(name in channels for name in names):
                return None
            return np.stack([channels[name] for name in names], axis=-1)

        rgb = plane("")
        if rgb is None:
            raise ValueError("this EXR has no channels R, G, B")
        names = {name.rsplit(".", 1)[0] for name in channels if name.endswith(".R")}
        layers = {}
        for name in sorted(names):
            pixels = plane(f"{name}.")
            if name == "error" or name.endswith(".error") or pixels is None:
                continue
            layers[name] = Layer(pixels, plane(f"{name}.error."))
        return cls(rgb, plane("error."), layers, attributes)
