"""Report the bodies of a solid that are too thin to be printed.

Rays go inwards from points all over a body's surface. Their median length is the body's thickness.
Slicers leave out parts that are thinner than the line that a nozzle draws.
"""

from collections.abc import Iterator

import manifold3d
import numpy as np

from stereocell.meshes.validity import label_components

_RAYS = 33  # rays per body; an odd number, so that the median is the length of one ray
_NAMED = 3  # largest number of thin bodies whose positions are reported
# Largest number of bodies that are measured, smallest first; large ones are rarely thin
_MAX_BODIES = 500


def describe_thin(
    solid: manifold3d.Manifold, name: str, *, wall_um: float, um_per_mm: float, um_per_unit: float
) -> Iterator[str]:
    """Yield a message if bodies of a solid are thinner than a wall.

    name         name of the solid in the message
    wall_um      smallest thickness, um of the specimen
    um_per_mm    um of the specimen per mm of the print; thicknesses are reported in mm
    um_per_unit  um of the specimen per unit of the file; positions are reported in this unit
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
        # Choose triangles so that the rays are evenly distributed over the body's area.
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
