"""A path tracer in float64 and numpy, to compare the viewer's path tracer with.

Medium and scattering are those of the viewer's shader. Other parts differ on purpose: one majorant
for the whole volume (Woodcock et al. 1965), no environment sampling, and lamps by binary shadow
rays. Reads the run as JSON (viewer_gltf/test/support/pathtrace/harness.ts) on standard input, with
"paths". Prints mean and standard error of premultiplied colour and coverage over the picture.
"""

import json
import sys

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float64]


class Medium:
    """A volume's texels, with an apron of one texel beyond its box on every side.

    Positions are (n, 3) of (x, y, z), um, from the box's low corner, with y up.
    """

    def __init__(self, run: dict) -> None:
        nx, ny, nz = run["size"]
        self.texels = np.array(run["texels"], np.float64).reshape(nz, ny, nx) / 255
        self.spacing = np.array(run["spacing_um"], np.float64)
        self.edges = (np.array(run["size"]) - 3) * self.spacing
        alpha = np.minimum(np.array(run["opacities"], np.float64) / 255, 0.999)
        self.voxel = float(self.spacing.min())
        self.sigma = -np.log(1 - alpha) / self.voxel * run["settings"].get("density", 1.0)
        self.albedo = np.array(run["color"], np.float64)

    def intensity(self, p: Array) -> Array:
        """Return the trilinear intensities, 0..1, at positions; rows of texels run against y."""
        nz, ny, nx = self.texels.shape
        x = p[:, 0] / self.spacing[0] + 1
        y = (self.edges[1] - p[:, 1]) / self.spacing[1] + 1
        z = p[:, 2] / self.spacing[2] + 1
        at = np.stack([np.clip(z, 0, nz - 1), np.clip(y, 0, ny - 1), np.clip(x, 0, nx - 1)])
        return ndimage.map_coordinates(self.texels, at, order=1, mode="nearest")

    def extinction(self, p: Array) -> Array:
        return np.interp(self.intensity(p) * 255, np.arange(256), self.sigma)

    def gradient(self, p: Array) -> Array:
        """Return differences of intensity over two finest voxel spacings, along each axis."""
        parts = []
        for axis in range(3):
            step = np.zeros(3)
            step[axis] = self.voxel
            parts.append(self.intensity(p + step) - self.intensity(p - step))
        return np.stack(parts, 1)

    def exit(self, p: Array, d: Array) -> tuple[Array, Array]:
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (0 - p) / d, (self.edges - p) / d
        near = np.nanmax(np.minimum(a, b), axis=1)
        far = np.nanmin(np.maximum(a, b), axis=1)
        return np.maximum(near, 0), far


def track(medium: Medium, p: Array, d: Array, limit: Array | None, rng) -> Array:
    """Return the distance to the next collision; NaN if a ray leaves the box or passes `limit`."""
    near, far = medium.exit(p, d)
    if limit is not None:
        far = np.minimum(far, limit)
    majorant = medium.sigma.max()
    t = near.copy()
    found = np.full(len(p), np.nan)
    alive = np.flatnonzero(far > near)
    while len(alive):
        t[alive] -= np.log(1 - rng.random(len(alive))) / majorant
        alive = alive[t[alive] < far[alive]]
        sigma = medium.extinction(p[alive] + t[alive, None] * d[alive])
        hit = rng.random(len(alive)) * majorant < sigma
        found[alive[hit]] = t[alive[hit]]
        alive = alive[~hit]
    return found


def frame(axis: Array) -> tuple[Array, Array]:
    other = np.where(np.abs(axis[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    u = np.cross(axis, other)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(axis, u)


def around(axis: Array, cosine: Array, rng) -> Array:
    u, v = frame(axis)
    phi = 2 * np.pi * rng.random(len(axis))
    sine = np.sqrt(np.maximum(0, 1 - cosine**2))
    return (
        (sine * np.cos(phi))[:, None] * u
        + (sine * np.sin(phi))[:, None] * v
        + cosine[:, None] * axis
    )


PHASE, DIFFUSE, GLOSSY = range(3)
GLOSS = 60.0


def density_of(way, normal, mirrored, g, before: Array, after: Array) -> Array:
    """Return the probability density of scattering from `before` into `after`.

    way  PHASE, DIFFUSE or GLOSSY of each ray: the lobe from which it is sampled
    """
    k = 1 + g * g - 2 * g * np.sum(before * after, 1)
    phase = (1 - g * g) / (4 * np.pi * k**1.5)
    height = np.sum(after * normal, 1)
    folded = after - 2 * height[:, None] * normal
    lobes = sum(np.maximum(np.sum(each * mirrored, 1), 0) ** GLOSS for each in (after, folded))
    glossy = (GLOSS + 1) / (2 * np.pi) * lobes
    surface = np.where(way == DIFFUSE, height / np.pi, glossy)
    return np.where(way == PHASE, phase, np.where(height > 0, surface, 0))


def sample(way, normal, mirrored, g, before: Array, rng) -> Array:
    x = rng.random(len(before))
    if abs(g) < 1e-3:
        cosine = 1 - 2 * x
    else:
        cosine = (1 + g * g - ((1 - g * g) / (1 - g + 2 * g * x)) ** 2) / (2 * g)
    after = around(before, cosine, rng)
    safe = np.where((way == PHASE)[:, None], before, normal)
    after = np.where((way == DIFFUSE)[:, None], around(safe, np.sqrt(1 - x), rng), after)
    safe = np.where((way == PHASE)[:, None], before, mirrored)
    lobe = around(safe, (1 - x) ** (1 / (GLOSS + 1)), rng)
    height = np.sum(lobe * normal, 1)
    lobe = np.where((height < 0)[:, None], lobe - 2 * height[:, None] * normal, lobe)
    return np.where((way == GLOSSY)[:, None], lobe, after)


def trace(run: dict) -> dict:
    rng = np.random.default_rng(run["seed"])
    medium, settings, count = Medium(run), run["settings"], run["paths"]
    g = settings.get("anisotropy", 0.0)
    # camera
    low = np.array([0.0, -medium.edges[1], 0.0])  # the box's low corner in the world
    eye = np.array(run["camera"]["eye"], float) - low
    ahead = np.array(run["camera"]["target"], float) - low - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 1.0, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    half = np.tan(np.radians(run["camera"]["fov_deg"]) / 2)
    xy = (2 * rng.random((count, 2)) - 1) * half
    d = ahead + xy[:, :1] * right + xy[:, 1:] * up
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    p = np.broadcast_to(eye, d.shape).copy()

    env = run["environment"]
    radiance = np.array(env["rgb"], float).reshape(env["height"], env["width"], 3)

    def environment(v: Array) -> Array:
        u = np.arctan2(v[:, 0], -v[:, 2]) / (2 * np.pi) % 1.0
        w = np.arccos(np.clip(v[:, 1], -1, 1)) / np.pi
        row = np.minimum((w * env["height"]).astype(int), env["height"] - 1)
        column = np.minimum((u * env["width"]).astype(int), env["width"] - 1)
        return radiance[row, column] * settings.get("environmentLight", 1.0)

    sums = np.zeros((count, 4))
    t = track(medium, p, d, None, rng)
    live = np.flatnonzero(~np.isnan(t))
    sums[live, 3] = 1
    p[live] += t[live, None] * d[live]
    weight = np.ones((count, 3))
    edge = medium.edges.max()
    scatters = 512 if settings.get("isMultiple", True) else 1
    for _ in range(scatters):
        if not len(live):
            break
        q, before = p[live], d[live]
        gradient = medium.gradient(q)
        steep = np.linalg.norm(gradient, axis=1)
        share = 1 - np.exp(-25 * settings["surface"] ** 3 * steep)
        is_surface = (steep >= 1e-4) & (rng.random(len(live)) < share)
        normal = gradient / np.maximum(steep, 1e-12)[:, None]
        normal *= np.where(np.sum(normal * before, 1) > 0, -1, 1)[:, None]
        cosine = np.sum(before * normal, 1)
        mirrored = before - 2 * cosine[:, None] * normal
        straight = 0.08 * settings["shine"]
        fresnel = (straight + (1 - straight) * (1 + cosine) ** 5) * (settings["shine"] > 0)
        way = np.where(
            is_surface, np.where(rng.random(len(live)) < fresnel, GLOSSY, DIFFUSE), PHASE
        )
        weight[live] *= np.where((way == GLOSSY)[:, None], 1.0, medium.albedo)
        for lamp in settings.get("lamps", []):
            if not lamp["isOn"]:
                continue
            aside = np.array([lamp["x"], lamp["y"], lamp["z"]]) * edge
            center = medium.edges / 2 + aside
            radius = 0.08 * edge
            intensity = lamp["strength"] * np.pi * max(aside @ aside, (edge / 4) ** 2)
            # A point anywhere on the sphere's surface; only the half that faces `q` lights it.
            n = rng.normal(size=(len(live), 3))
            n /= np.linalg.norm(n, axis=1, keepdims=True)
            to = center + radius * n - q
            away = np.linalg.norm(to, axis=1)
            to /= away[:, None]
            facing = np.maximum(-np.sum(n * to, 1), 0)
            geometry = facing * 4 * np.pi * radius**2 / away**2
            lit = intensity / (np.pi * radius**2) * geometry
            lit *= density_of(way, normal, mirrored, g, before, to)
            open_ = np.isnan(track(medium, q, to, away, rng))
            sums[live, :3] += weight[live] * (lit * open_)[:, None] * np.array(lamp["color"])
        after = sample(way, normal, mirrored, g, before, rng)
        after[after == 0] = 1e-12
        d[live] = after
        t = track(medium, q, after, None, rng)
        left = np.isnan(t)
        out = live[left]
        sums[out, :3] += weight[out] * environment(after[left])
        live, t = live[~left], t[~left]
        p[live] += t[:, None] * d[live]
        # Russian roulette
        survives = np.minimum(1, weight[live].max(1))
        stays = rng.random(len(live)) < survives
        weight[live[stays]] /= survives[stays, None]
        live = live[stays]
    return {
        "mean": sums.mean(0).tolist(),
        "error": (sums.std(0) / np.sqrt(count)).tolist(),
    }


if __name__ == "__main__":
    json.dump(trace(json.load(sys.stdin)), sys.stdout)
