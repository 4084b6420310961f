/**
 * How marks look: lengths are angles, so that a mark is as large to the eye near by as far away, and
 * what covers a mark lets it through as a ghost. On a flat screen an angle is so many pixels.
 */
import {
  BackSide,
  BufferAttribute,
  type BufferGeometry,
  Color,
  type ColorRepresentation,
  GreaterDepth,
  type Line,
  LineBasicMaterial,
  LineLoop,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  type Object3D,
  type Vector3,
} from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";

const RADIANS = Math.PI / 180;
/** Render order: after the marched volumes, which lie over everything else. */
export const MARKS_ORDER = 1001;
/** Opacity of marks behind a surface, 0..1. */
const GHOST = 0.35;

export const ACCENT = 0x5aa9ff;
export const BRIGHT = 0xffffff;
export const DIM = 0x9fb0c8;
export const MEASURE = 0xffd24a;
export const PLANE = 0xc792ff;
const RIM = 0x0b0d12;
const RIM_SCALE = 1.3;
/** x, y, z: distinct to colour-blind eyes too (after Okabe & Ito), and labelled. */
export const AXIS_COLORS = ["#e8743b", "#35b98c", "#6cb8f0"] as const;

/** Radii of marks in a headset, radians. */
export const HANDLE_RADIUS = 0.7 * RADIANS;
/** Factor by which a handle grows while it is pointed at or held. */
export const HIGHLIGHT_SCALE = 1.35;
export const POINT_RADIUS = 0.28 * RADIANS;
export const LINE_RADIUS = 0.06 * RADIANS;
/** Height of a label's line in a headset, radians. */
export const LABEL_HEIGHT = 1.15 * RADIANS;

/** Height of a label's line on a flat screen, CSS pixels; all else in proportion. */
export const LABEL_PX = 20;

/** Where the eye is, um; where up is to it, of any length; how much larger than in a headset angles are. */
export type Sight = Readonly<{
  eye_um: Vector3;
  up: Vector3;
  /** Factor to the angles of marks. */
  zoom: number;
  /** Factor to the angles of labels: in stereo a phone's few pixels need large letters. */
  textZoom: number;
}>;
/** Factor to the angles of labels in stereo: their letters are 32 mm high at 1 m, as on the panel. */
export const STEREO_TEXT = 2.25;

/** Of a flat screen: how much larger angles are, at so many CSS pixels to a radian. */
export function screenZoom(px_per_rad: number): number {
  return LABEL_PX / px_per_rad / LABEL_HEIGHT;
}

/** The length, um, that is seen under an angle at a point. */
export function lengthAt(
  point: Vector3,
  { eye_um, zoom }: Pick<Sight, "eye_um" | "zoom">,
  angle_rad: number,
): number {
  return 2 * Math.tan((zoom * angle_rad) / 2) * point.distanceTo(eye_um);
}

export type MarkMesh = Mesh<BufferGeometry, MeshBasicMaterial>;

export function markMesh(
  geometry: BufferGeometry,
  color: ColorRepresentation,
  opacity = 1,
): MarkMesh {
  const material = new MeshBasicMaterial({ color, opacity, ...MATERIAL });
  return ghosted(new Mesh(geometry, material), new Mesh(geometry, material.clone()));
}

/** A part of a mark; `geometry` is the mark's from here on. */
export type Piece = Readonly<{
  geometry: BufferGeometry;
  color: ColorRepresentation;
  opacity?: number;
}>;

/** One mark of several parts, each in its colour: a mark of many meshes is drawn as often. */
export function markOf(pieces: readonly Piece[]): MarkMesh {
  const geometries = pieces.map(({ geometry, color, opacity = 1 }) => {
    const rgba = [...new Color(color).toArray(), opacity];
    const { count } = geometry.attributes.position;
    const colors = Float32Array.from({ length: 4 * count }, (_, i) => rgba[i % 4]);
    return geometry.setAttribute("color", new BufferAttribute(colors, 4));
  });
  const material = new MeshBasicMaterial({ vertexColors: true, ...MATERIAL });
  const merged = mergeGeometries(geometries);
  return ghosted(new Mesh(merged, material), new Mesh(merged, material.clone()));
}

export function markLine(
  geometry: BufferGeometry,
  color: ColorRepresentation,
  { isLoop = false, opacity = 1 } = {},
): Line<BufferGeometry, LineBasicMaterial> {
  const material = new LineBasicMaterial({ color, opacity, ...MATERIAL });
  const make = isLoop ? LineLoop : LineSegments;
  return ghosted(new make(geometry, material), new make(geometry, material.clone()));
}

const MATERIAL = { transparent: true, depthWrite: false, toneMapped: false, fog: false } as const;

/** The same once more, faintly, where it lies behind something. */
function ghosted<
  T extends Mesh<BufferGeometry, MeshBasicMaterial> | Line<BufferGeometry, LineBasicMaterial>,
>(mark: T, ghost: T): T {
  ghost.material.depthFunc = GreaterDepth;
  ghost.material.opacity *= GHOST;
  ghost.material.color = mark.material.color; // one colour, by either material
  for (const each of [mark, ghost]) {
    each.renderOrder = MARKS_ORDER;
    each.frustumCulled = false;
  }
  mark.add(ghost);
  return mark;
}

/** A dark rim round a mark, which may lie on something as bright. */
export function rimmed(mark: MarkMesh): MarkMesh {
  const material = new MeshBasicMaterial({ color: RIM, side: BackSide, ...MATERIAL });
  const rim = new Mesh(mark.geometry, material);
  rim.scale.setScalar(RIM_SCALE);
  rim.renderOrder = MARKS_ORDER - 0.5;
  rim.frustumCulled = false;
  mark.add(rim);
  return mark;
}

/** Free what the meshes and lines below an object hold; shared geometry may go more than once. */
export function disposeMarks(root: Object3D): void {
  root.traverse((object) => {
    const { geometry, material } = object as Partial<MarkMesh>;
    geometry?.dispose();
    material?.dispose();
  });
}
