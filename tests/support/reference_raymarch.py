"""A plain and slow ray march in float64, independent of the viewer's, to compare pictures with.

It sums emission and absorption front to back (Max, Optical Models for Direct Volume Rendering,
1995). Its steps are so short that halving them changes nothing in 8 bits. There is no skipping, no
jitter, and no visible early end. World axes: x right, y up, z to the viewer; arrays (z, y, x);
lengths in um.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Values = NDArray[np.float64]
Triple = tuple[float, float, float]

RAYS = 1 << 18  # rays that are marched at a time
CLEAR = 1e-7  # a ray ends below this transmittance, far below what 8 bits show
ENTRIES = 256

# Directions to the main lamp and to the weaker one, along the camera's axes (right, up, back), and
# the light of a white surface that faces each lamp
LIGHT: Triple = (-1.2, 1.6, 2.5)
FILL: Triple = (1.8, -0.4, 1.8)
LIGHT_COLOR: Triple = (0.66, 0.62, 0.56)
FILL_COLOR: Triple = (0.08, 0.1, 0.14)
SKY: Triple = (0.33, 0.34, 0.37)
GROUND: Triple = (0.13, 0.125, 0.12)
GLOSS, EXPONENT = 0.1, 16
SCATTERED = 1.2  # factor of the light at points where the volume has no boundary
NOISE_STEP, BOUNDARY_STEP = 0.03, 0.18  # intensity over two voxels; shading fades in between them
FLAT_STEP = 1e-4  # intensity over two voxels; below it the gradient has no direction


@dataclass(frozen=True, slots=True)
class Camera:
    """Looks from eye_um at target_um; world y is up in the picture.

    Rays go through the pixels' centres. With fov_deg, the whole angle from the picture's bottom to
    its top, they leave the eye; without, they are parallel and the picture is 2 * half_height_um
    high at the target.
    """

    eye_um: Triple
    target_um: Triple
    size_px: tuple[int, int]  # width, height
    fov_deg: float | None = None
    half_height_um: float | None = None

    def axes(self) -> tuple[Values, Values, Values]:
        """Return the unit vectors right, up and back, each (3,), world axes."""
        back = np.subtract(self.eye_um, self.target_um).astype(np.float64)
        back /= np.linalg.norm(back)
        right = np.cross((0.0, 1.0, 0.0), back)
        right /= np.linalg.norm(right)
        return right, np.cross(back, right), back

    def rays(self) -> tuple[Values, Values]:
        """Return where the rays start and their unit directions, each (height * width, 3), um."""
        width, height = self.size_px
        right, up, back = self.axes()
        x = (2 * (np.arange(width) + 0.5) / width - 1) * width / height
        y = 1 - 2 * (np.arange(height) + 0.5) / height  # the first row is the top
        across = (x[None, :, None] * right + y[:, None, None] * up).reshape(-1, 3)
        eye = np.asarray(self.eye_um, np.float64)
        if self.fov_deg is not None:
            direction = across * np.tan(np.deg2rad(self.fov_deg) / 2) - back
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
            return np.broadcast_to(eye, direction.shape), direction
        if self.half_height_um is None:
            raise ValueError("a camera has either fov_deg or half_height_um, found neither")
        start = eye + across * self.half_height_um
        return start, np.broadcast_to(-back, start.shape)


@dataclass(frozen=True, slots=True)
class Block:
    """A tile's channels as the bundle holds them.

    channels: 1 to 4 arrays (z, y, x) of uint8, alike in shape, with `apron` voxels beyond the box
        on every side. The box's corners are the centres of the voxels `apron` and n - 1 - `apron`;
        rows (y) run against world y.
    low_um, high_um: corners of the box, world (x, y, z)
    tables: (channels, 256, 4) in 0..1: RGB is a factor to the colour, A the opacity of one finest
        voxel spacing; between entries it is linear
    colors: (channels, 3), linear
    """

    channels: tuple[NDArray[np.uint8], ...]
    low_um: Triple
    high_um: Triple
    tables: Values
    colors: Values
    apron: int = 1

    def spacing_um(self) -> Values:
        """Return the voxel spacing (x, y, z)."""
        intervals = [max(1, n - 1 - 2 * self.apron) for n in self.channels[0].shape[::-1]]
        spacing: Values = np.subtract(self.high_um, self.low_um) / intervals
        return spacing

    def intensities(self, points: Values) -> Values:
        """Return the trilinear intensities 0..1, (channels, n), at points (n, 3), world um."""
        x, y, z = ((points - np.asarray(self.low_um)) / self.spacing_um()).T
        rows = self.channels[0].shape[1] - 1 - 2 * self.apron
        at = np.stack([z, rows - y, x]) + self.apron
        return np.stack(
            [
                ndimage.map_coordinates(each, at, np.float64, order=1, mode="nearest") / 255
                for each in self.channels
            ]
        )


def render(
    block: Block, camera: Camera, step_voxels: float = 0.125, shading: bool = True
) -> Values:
    """Return the picture (height, width, 4): linear RGB, premultiplied, and opacity; top row first.

    step_voxels: of the finest voxel spacing; a ray's steps are equal, and no longer.
    shading: whether gradients are lit.
    """
    width, height = camera.size_px
    picture = np.zeros((height * width, 4))
    start, direction = camera.rays()
    lamps = np.array([np.divide(lamp, np.linalg.norm(lamp)) for lamp in (LIGHT, FILL)])
    light = lamps @ np.stack(camera.axes())
    for some in _chunks(len(picture)):
        lit = light if shading else None
        picture[some] = _march(block, start[some], direction[some], step_voxels, lit)
    return picture.reshape(height, width, 4)


def encode(
    picture: Values, background: Triple = (0.0, 0.0, 0.0), *, adds_light: bool = True
) -> NDArray[np.uint8]:
    """Return 8-bit sRGB (height, width, 3) of a picture from `render` over an sRGB background 0..1.

    adds_light: whether light is blended, and encoded (IEC 61966-2-1) at the end, as the viewer
    does it; else colours are encoded before they are blended, as a page's canvas does it.
    """
    alpha = picture[..., 3:]
    if adds_light:
        light = picture[..., :3] + (1 - alpha) * decoded(np.asarray(background))
        blended = encoded(light)
    else:
        clear = np.zeros_like(picture[..., :3])
        color = np.divide(picture[..., :3], alpha, out=clear, where=alpha > 0)
        blended = encoded(color) * alpha + (1 - alpha) * np.asarray(background)
    pixels: NDArray[np.uint8] = np.rint(255 * blended).astype(np.uint8)
    return pixels


def encoded(light: Values) -> Values:
    light = np.clip(light, 0.0, 1.0)
    high = 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, high)


def decoded(color: Values) -> Values:
    return np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)


def psnr(
    a: NDArray[np.uint8], b: NDArray[np.uint8], where: NDArray[np.bool_] | None = None
) -> float:
    """Return the peak signal-to-noise ratio of two 8-bit pictures in dB; inf if they are equal.

    where: (height, width), the pixels that count; all without it.
    """
    if a.shape != b.shape:
        raise ValueError(f"expected two pictures alike in shape, found {a.shape} and {b.shape}")
    error = (a.astype(np.float64) - b) ** 2
    mean = float(np.mean(error if where is None else error[where]))
    return float("inf") if mean == 0 else 10 * float(np.log10(255**2 / mean))


def path_voxels(block: Block, camera: Camera) -> Values:
    """Return how long each ray is within the box, (height, width), in finest voxel spacings."""
    start, direction = camera.rays()
    near, far = _span(block, start, direction)
    width, height = camera.size_px
    lengths: Values = np.maximum(far - near, 0) / block.spacing_um().min()
    return lengths.reshape(height, width)


def _chunks(count: int) -> Iterator[slice]:
    return (slice(a, a + RAYS) for a in range(0, count, RAYS))


def _span(block: Block, start: Values, direction: Values) -> tuple[Values, Values]:
    """Return where each ray enters and leaves the box, um along it; it misses if near > far."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a = (np.asarray(block.low_um) - start) / direction
        b = (np.asarray(block.high_um) - start) / direction
    near = np.fmin(a, b).max(axis=1)
    far = np.fmax(a, b).min(axis=1)
    return np.maximum(near, 0.0), far


def _march(
    block: Block, start: Values, direction: Values, step_voxels: float, light: Values | None
) -> Values:
    """Return the premultiplied sums (n, 4) of rays (n, 3)."""
    voxel = float(block.spacing_um().min())
    near, far = _span(block, start, direction)
    length = np.maximum(far - near, 0.0)
    steps = np.ceil(length / (step_voxels * voxel)).astype(np.int64)
    step = np.divide(length, steps, out=np.zeros_like(length), where=steps > 0)
    sums = np.zeros((len(start), 4))
    faces = _faces(block, start + near[:, None] * direction) * (near > 0)[:, None]
    rays = np.flatnonzero(steps)  # rays that still march
    for k in range(int(steps.max(initial=0))):
        rays = rays[(k < steps[rays]) & (sums[rays, 3] < 1 - CLEAR)]
        points = start[rays] + (near[rays] + (k + 0.5) * step[rays])[:, None] * direction[rays]
        in_face = np.clip(voxel / step[rays] - k, 0.0, 1.0)  # share of the step in the first voxel
        color, opacity, shares = _classify(block, block.intensities(points), step[rays] / voxel)
        seen = opacity > 0
        rays_seen, opacity = rays[seen], opacity[seen]
        color = color[seen]
        if light is not None:
            cut = in_face[seen, None] * faces[rays_seen]
            toward = direction[rays_seen]
            color = _shade(block, points[seen], toward, light, color, shares[:, seen], cut)
        weight = (1 - sums[rays_seen, 3]) * opacity
        sums[rays_seen, :3] += weight[:, None] * color
        sums[rays_seen, 3] += weight
    return sums


def _faces(block: Block, points: Values) -> Values:
    """Return the normals (n, 3) of the faces on which points (n, 3) lie, world um; 0 for others."""
    slack = 0.05 * float(block.spacing_um().min())
    low = np.abs(points - np.asarray(block.low_um)) < slack
    high = np.abs(points - np.asarray(block.high_um)) < slack
    normals = high.astype(np.float64) - low
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)


def _classify(block: Block, intensities: Values, voxels: Values) -> tuple[Values, Values, Values]:
    """Return colour (n, 3), not premultiplied, and opacity (n,) of steps that are `voxels` long.

    The third value is each channel's share (channels, n) in the colour. Channels absorb together,
    and share the colour in proportion to their opacities.
    """
    count = intensities.shape[1]
    shares = np.zeros_like(intensities)
    color, weight, clear = np.zeros((count, 3)), np.zeros(count), np.ones(count)
    entries = np.arange(ENTRIES) / (ENTRIES - 1)
    for c, (v, table, tint) in enumerate(zip(intensities, block.tables, block.colors, strict=True)):
        a = 1 - (1 - np.minimum(np.interp(v, entries, table[:, 3]), 0.999)) ** voxels
        look = np.stack([np.interp(v, entries, table[:, i]) for i in range(3)], axis=1)
        color += look * tint * a[:, None]
        weight += a
        shares[c] = a
        clear *= 1 - a
    whole = np.maximum(weight, 1e-300)
    return color / whole[:, None], 1 - clear, shares / whole


def _contrast(block: Block) -> Values:
    """Return the factor (channels, 1) to the gradients by which each channel is shaded.

    If a table's opacity rises to half of its maximum within less than 0.12 of the intensities,
    boundaries span only a few intensities. Such gradients are scaled up, by a factor of 3 at most.
    """
    factors = []
    for alphas in block.tables[:, :, 3]:
        first, half = int(np.argmax(alphas > 0)), int(np.argmax(2 * alphas >= alphas.max()))
        is_plain = alphas.max() == 0 or alphas[0] > 0
        rise = (half - first + 1) / (ENTRIES - 1)
        factors.append(1.0 if is_plain else float(np.clip(0.12 / rise, 1.0, 3.0)))
    return np.array(factors)[:, np.newaxis]


def _shade(
    block: Block,
    points: Values,
    direction: Values,
    lamps: Values,
    color: Values,
    shares: Values,
    cut: Values,
) -> Values:
    """Return the light (n, 3) that is seen at points (n, 3) of a colour (n, 3).

    The gradient is the difference of intensities at the corners of a cube of two voxels, with
    channels weighted by their shares. Surfaces are lit from both sides (Levoy, Display of Surfaces
    from Volume Data, 1988). Points without a gradient are lit as if they faced the eye.

    lamps: (2, 3), directions to the lamp and to the weaker one
    cut: (n, 3), normal of the face through which the ray entered, times the face's share of light
    """
    h = float(block.spacing_um().min())
    weights = shares * _contrast(block)
    gradient = np.zeros(points.shape)
    for side in itertools.product((-1.0, 1.0), repeat=3):
        value = (block.intensities(points + h * np.array(side)) * weights).sum(axis=0)
        gradient += 0.25 * value[:, None] * np.array(side)
    steepness = np.linalg.norm(gradient, axis=1)
    flat = steepness < FLAT_STEP
    normal = -gradient / np.where(flat, 1.0, steepness)[:, None]
    normal *= np.where((normal * direction).sum(axis=1) > 0, -1.0, 1.0)[:, None]
    half = lamps[0] - direction
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    gloss = GLOSS * np.maximum((normal * half).sum(axis=1), 0.0) ** EXPONENT
    lit = color * _light_on(normal, lamps) + gloss[:, None] * np.asarray(LIGHT_COLOR)
    unlit = SCATTERED * color * _light_on(-direction, lamps)
    fade = np.clip((steepness - NOISE_STEP) / (BOUNDARY_STEP - NOISE_STEP), 0.0, 1.0)
    fade = np.where(flat, 0.0, fade**2 * (3 - 2 * fade))
    shaded = unlit + fade[:, None] * (lit - unlit)
    share = np.linalg.norm(cut, axis=1, keepdims=True)
    face = np.divide(cut, share, out=np.zeros_like(cut), where=share > 0)
    gloss = GLOSS * np.maximum((face * half).sum(axis=1), 0.0) ** EXPONENT
    on_face = color * _light_on(face, lamps) + gloss[:, None] * np.asarray(LIGHT_COLOR)
    return shaded + share * (on_face - shaded)


def _light_on(normal: Values, lamps: Values) -> Values:
    key, fill = (np.maximum(normal @ lamp, 0.0)[:, None] for lamp in lamps)
    up = 0.5 + 0.5 * normal[:, 1:2]
    sky = up * np.asarray(SKY) + (1 - up) * np.asarray(GROUND)
    return key * np.asarray(LIGHT_COLOR) + fill * np.asarray(FILL_COLOR) + sky
