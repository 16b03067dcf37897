"""Writes what fuzzing starts from: make_seeds.py FOLDER.

For each target a folder of small files, fuzz_NAME, and for binary formats their words,
fuzz_NAME.dict.
"""

import struct
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "blender"))
sys.path.append(str(Path(__file__).resolve().parents[1] / "python"))
from records import plain_record, whole_record
from rgl_file import glossy_fields, random_fields, spectral_fields, write_tensor_file

_TURN = np.linspace(-np.pi, np.pi, 4)
_RGL = {
    "isotropic": random_fields(elevations=3),
    "anisotropic": random_fields(_TURN, elevations=2),
    "glossy": glossy_fields(elevations=2, size=4),
    "spectral": spectral_fields(np.linspace(360, 830, 5), np.ones(5)),
}
_RGL_WORDS = [name.encode() for fields in _RGL.values() for name in fields]
_RGL_WORDS += [b"tensor_file\0\1\0", *(struct.pack("<Q", size) for size in (0, 1, 2, 3, 4, 2**63))]
_RGL_WORDS += [struct.pack("<f", number) for number in (np.nan, np.inf, -1.0, np.pi / 2, 3.4e38)]

_PHI_STEPS = (180, 360)


def _merl(dimensions: tuple[int, ...], values: bytes = b"", order: str = "<") -> bytes:
    """A head, the first values, and the length of the file, which the target fills with zeros."""
    length = 12 + 24 * 90 * 90 * dimensions[-1]
    return struct.pack(f"{order}3i", *dimensions) + values + struct.pack("<I", length)


_MERL = {f"phi_{steps}": _merl((90, 90, steps)) for steps in _PHI_STEPS}
_MERL |= {
    "values": _merl((90, 90, 180), struct.pack("<3d", -1.0, np.nan, 1e308)),
    "big_endian": _merl((90, 90, 180), order=">"),
    "text": b"Source Measured\r\n" + struct.pack("<I", 0),
}
_MERL_WORDS = [struct.pack("<i", number) for number in (90, -1, 2**31 - 1, *_PHI_STEPS)]
_MERL_WORDS += [seed[-4:] for seed in _MERL.values()]
_MERL_WORDS += [struct.pack("<d", number) for number in (np.nan, np.inf, -1.0, 1e308)]


_LIGHTS = {
    "plain": b'{"schema":1,"pictures":[{"lights":[{"direction":[0,0,1],"irradiance":3}]}]}',
    "whole": b"""{"schema": 1, "pictures": [
 {"image": "left.png", "lights": [{"direction": [-1, 0.5, 1.2], "irradiance": [3.1, 3, 2.8]}],
  "ambient": 0.02, "exposure": 1},
 {"image": "right.png", "lights": [{"direction": [1, 0, 1], "irradiance": 2}],
  "ambient": [0, 0, 1]}]}
""",
}
_RECORD = {"plain": plain_record().to_json().encode(), "whole": whole_record()}


def _write_words(path: Path, words: list[bytes]) -> None:
    quoted = ["".join(f"\\x{byte:02x}" for byte in word) for word in dict.fromkeys(words)]
    path.write_text("".join(f'"{word}"\n' for word in quoted))


def make_seeds(folder: Path) -> None:
    """Writes the seeds and the words of every target."""
    for name in ("fuzz_rgl", "fuzz_merl", "fuzz_record", "fuzz_lights"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for name, fields in _RGL.items():
        write_tensor_file(folder / "fuzz_rgl" / name, fields)
    for name, seed in _MERL.items():
        (folder / "fuzz_merl" / name).write_bytes(seed)
    for name, seed in _LIGHTS.items():
        (folder / "fuzz_lights" / name).write_bytes(seed)
    for name, seed in _RECORD.items():
        (folder / "fuzz_record" / name).write_bytes(seed)
    _write_words(folder / "fuzz_rgl.dict", _RGL_WORDS)
    _write_words(folder / "fuzz_merl.dict", _MERL_WORDS)


if __name__ == "__main__":
    make_seeds(Path(sys.argv[1]))
