"""RGL files made for tests."""

import struct
from pathlib import Path

import numpy as np

_TYPES = {"u1": 1, "u4": 5, "f4": 10}


def write_tensor_file(path: Path, fields: dict[str, np.ndarray]) -> Path:
    """Writes named arrays of uint8, uint32 and float32 in the container of RGL files."""
    head = b"tensor_file\0" + struct.pack("<BBI", 1, 0, len(fields))
    offset = len(head) + sum(13 + len(name) + 8 * a.ndim for name, a in fields.items())
    values = b""
    for name, array in fields.items():
        values += bytes(-(offset + len(values)) % 8)
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", array.ndim, _TYPES[array.dtype.str[1:]], offset + len(values))
        head += struct.pack(f"<{array.ndim}Q", *array.shape)
        values += array.tobytes()
    path.write_bytes(head + values)
    return path


def directions(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Unit vectors (.., 3) by angles in radians from n = +z and from x."""
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack([x, y, np.cos(theta) + 0 * phi], -1)


def glossy_fields(phi_i=(0.0,), elevations: int = 16, size: int = 32) -> dict[str, np.ndarray]:
    """A matte surface under a broad lobe about the half vector, the same in all azimuths."""
    x, y = np.meshgrid(np.linspace(0, 1, size), np.linspace(0, 1, size))
    theta_i = np.linspace(0, 1, elevations) ** 2 * np.pi / 2
    m = directions(x**2 * np.pi / 2, (2 * y - 1) * np.pi)
    rows = []
    for phi in phi_i:
        for theta in theta_i:
            wi = directions(theta, 0.0 if len(phi_i) == 1 else phi)
            wo = 2 * (m @ wi)[..., None] * m - wi
            lobe = 0.5 * m[..., 2].clip(0) ** 40
            rows.append([wo[..., 2] * (base / np.pi + lobe) for base in (0.5, 0.3, 0.1)])
    shape = (len(phi_i), elevations)
    return _fields(phi_i, theta_i, np.array(rows).reshape(*shape, 3, size, size)) | {
        "ndf": np.ones((2, 2), "f4"),
        "sigma": np.full((2, 2), 0.25, "f4"),
        "vndf": np.ones((*shape, 2, 2), "f4"),
    }


def spectral_fields(wavelengths: np.ndarray, spectrum: np.ndarray) -> dict[str, np.ndarray]:
    """A small glossy surface of which every direction has this spectrum; wavelengths in nm."""
    fields = glossy_fields(elevations=3, size=8)
    red = fields.pop("rgb")[:, :, :1]
    spectra = red * spectrum.astype("f4")[:, None, None]
    return fields | {"spectra": spectra, "wavelengths": wavelengths.astype("f4")}


def random_fields(phi_i=(0.0,), elevations: int = 6, seed: int = 1) -> dict[str, np.ndarray]:
    """Tables that mean nothing, to hold two readers against each other."""
    rng = np.random.default_rng(seed)

    def table(*shape: int) -> np.ndarray:
        values = rng.uniform(0.5, 2.0, shape).astype("f4")
        values[..., -1, :] = values[..., 0, :]  # the same azimuth
        return values

    theta_i = np.linspace(0, 1, elevations) ** 1.5 * np.pi / 2
    shape = (len(phi_i), elevations)
    return _fields(phi_i, theta_i, table(*shape, 3, 9, 9)) | {
        "ndf": table(12, 16),
        "sigma": table(2, 16),
        "vndf": table(*shape, 12, 16),
    }


def _fields(phi_i, theta_i: np.ndarray, rgb: np.ndarray) -> dict[str, np.ndarray]:
    description = np.frombuffer(b"made for a test", "u1")
    luminance = rgb.mean(axis=2).clip(1e-3)
    return {
        "description": description,
        "phi_i": np.array(phi_i, "f4"),
        "theta_i": theta_i.astype("f4"),
        "luminance": luminance.astype("f4"),
        "rgb": rgb.astype("f4"),
        "jacobian": np.ones(1, "u1"),
    }
