"""Write baked maps as KTX2 textures of Basis Universal, by alktx2 of the extra `maps`."""

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from stereocell.textures.map_packages import import_encoder

_ETC1S_QUALITY = 80  # quality, 1 to 100


def encode_normal_map(image: NDArray[np.uint8]) -> bytes:
    """Return a normal map with mip levels, UASTC.

    image  uint8 (y, x, 3), tangent space

    Raises ValueError unless both sides are multiples of 4 (KHR_texture_basisu), and UsageError
    without alktx2. One thread encodes, since the bytes depend on the number of threads.

    The table has size, mean error of the normals in degrees, and time. The first pair of columns is
    for maps of smooth bodies (64 to 128 texels wide), the second for noisy cells (64 to 512).

        UASTC, effort 1                 14 kB  1.3     43 kB  3.7   0.04 s
        UASTC, effort 1, lambda 2        9 kB  1.9     40 kB  4.2   0.04 s  (blocks are visible)
        UASTC, effort 3                 15 kB  0.8     44 kB  1.9   0.09 s
        UASTC, effort 3, lambda 0.5     14 kB  0.9     44 kB  1.9   0.10 s  (chosen)
        UASTC, effort 3, lambda 1       12 kB  1.1     43 kB  2.1   0.10 s
        UASTC, effort 5, lambda 0.5      -             45 kB  1.8   0.32 s
    """
    return _encode_map(
        image,
        codec="uastc",
        quality=100,
        effort=3,
        uastc_rdo_lambda=0.5,
        uastc_rdo_dict_size=256,
        srgb=False,
        linear=True,
        zstd_supercompression_level=9,
    )


def encode_occlusion_map(image: NDArray[np.uint8]) -> bytes:
    """Return an ambient-occlusion map with mip levels, ETC1S.

    image  uint8 (y, x, 3), grey

    Raises ValueError unless both sides are multiples of 4, and UsageError without alktx2. Occlusion
    varies slowly, so the blocks of ETC1S are not visible.
    """
    return _encode_map(image, codec="etc1s", quality=_ETC1S_QUALITY, srgb=False, linear=True)


def encode_color_map(image: NDArray[np.uint8]) -> bytes:
    """Return a base-colour map with mip levels, ETC1S.

    image  uint8 (y, x, 3), sRGB

    Raises ValueError unless both sides are multiples of 4, and UsageError without alktx2.
    """
    return _encode_map(image, codec="etc1s", quality=_ETC1S_QUALITY, srgb=True, linear=False)


def decode_map(ktx2: bytes) -> NDArray[np.uint8]:
    """Return the finest level of a map, uint8 (y, x, 3). Raises UsageError without alktx2."""
    png, _ = import_encoder().decode_ktx2_to_bytes(ktx2)
    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGB"))


def _encode_map(image: NDArray[np.uint8], **options: Any) -> bytes:
    height, width, components = image.shape
    if width % 4 or height % 4 or components != 3:
        raise ValueError(f"a baked map of {width} x {height} x {components}")
    opaque = np.full((height, width, 1), 255, dtype=np.uint8)
    pixels = np.concatenate([image, opaque], axis=2).tobytes()
    data: bytes = import_encoder().encode_raw_rgba_to_ktx2(
        pixels, width, height, False, mipmaps=True, threads=1, **options
    )
    return data
