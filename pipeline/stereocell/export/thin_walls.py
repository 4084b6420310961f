"""Name what of a solid is too thin to be printed.

A ray goes inwards from places all over a body's surface; its median length is how thick the body
is. Slicers leave out what is thinner than the line that a nozzle draws.
"""

from collections.abc import Iterator

import manifold3d
import numpy as np

from stereocell.meshes.validity import label_components

_RAYS = 33  # a body: an odd number, whose median is one of them
_NAMED = 3  # bodies that are named with their places
_MAX_BODIES = 500  # bodies that are measured, the smallest: large ones are thick


def describe_thin(
    solid: manifold3d.Manifold, name: str, *, wall_um: float, um_per_mm: float, um_per_unit: float
) -> Iterator[str]:
    """Yield a line where bodies of a solid are thinner than a wall.

    Lengths are printed in mm, places in the file's unit: there they are looked up.
    """
    mesh = solid.to_mesh()
    positions = mesh.vert_properties[:, :3].astype(np.float64)
    corners = positions[mesh.tri_verts]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(facing, axis=1)
    body_of = label_components(mesh.tri_verts.astype(np.uint32), len(positions))[
        mesh.tri_verts[:, 0]
    ]
    reach = float(np.ptp(positions, axis=0).max())
    order = np.argsort(body_of, kind="stable")
    bodies = np.split(order, np.flatnonzero(np.diff(body_of[order])) + 1)
    bodies.sort(key=lambda rows: float(areas[rows].sum()))
    thin = []
    for rows in bodies[:_MAX_BODIES]:
        # places that lie evenly over the area
        shares = (np.arange(_RAYS) + 0.5) / _RAYS * areas[rows].sum()
        picked = rows[np.searchsorted(np.cumsum(areas[rows]), shares).clip(max=len(rows) - 1)]
        picked = picked[areas[picked] > 0]
        lengths = []
        for k in picked.tolist():
            inwards = -facing[k] / areas[k]
            start = corners[k].mean(axis=0) + 1e-4 * wall_um * inwards
            hits = solid.ray_cast(start.tolist(), (start + reach * inwards).tolist())
            if hits:
                lengths.append(reach * hits[0].distance)
        if lengths and np.median(lengths) < wall_um:
            thin.append((float(np.median(lengths)), corners[rows].mean(axis=(0, 1))))
    if not thin:
        return
    thin.sort(key=lambda one: one[0])
    named = ", ".join(
        f"{um / um_per_mm:.2g} mm at ({', '.join(f'{n / um_per_unit:.3g}' for n in place)})"
        for um, place in thin[:_NAMED]
    )
    more = " ..." if len(thin) > _NAMED else ""
    yield (
        f"{name}: {len(thin)} of {len(bodies)} bodies are thinner than "
        f"{wall_um / um_per_mm:.2g} mm and may be lost in print: {named}{more}"
    )
