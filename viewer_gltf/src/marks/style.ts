/**
 * The style of marks. Their lengths are angles, so that a mark looks equally large at every distance; on a flat screen
 * an angle is a number of pixels. A mark behind a surface shows faintly.
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
/** Render order of marks: after the marched volumes, which are drawn after everything else. */
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
/** Colours of x, y and z. Colour-blind users can tell them apart, too (after Okabe & Ito), and axes are labelled. */
export const AXIS_COLORS = ["#e8743b", "#35b98c", "#6cb8f0"] as const;

/** Radii of marks in a headset, radians. */
export const HANDLE_RADIUS = 0.7 * RADIANS;
/** Factor by which a handle grows while it is pointed at or held. */
export const HIGHLIGHT_SCALE = 1.35;
export const POINT_RADIUS = 0.28 * RADIANS;
export const LINE_RADIUS = 0.06 * RADIANS;
/** Height of a label's line in a headset, radians. */
export const LABEL_HEIGHT = 1.15 * RADIANS;

/** Height of a label's line on a flat screen, CSS pixels; other sizes of marks are in proportion. */
export const LABEL_PX = 20;

/** The eye's position in um, its up direction of any length, and factors to the angles of marks in a headset. */
export type EyeView = Readonly<{
  eye_um: Vector3;
  up: Vector3;
  /** Factor to the angles of marks. */
  zoom: number;
  /** Factor to the angles of labels; letters are larger in stereo, since a phone has few pixels for each eye. */
  textZoom: number;
}>;
/** Factor to the angles of labels in stereo: their letters are 32 mm high at 1 m, as on the panel. */
export const STEREO_TEXT = 2.25;

/**
 * Returns the factor by which the angles of marks are multiplied on a flat screen, from its CSS
 * pixels for each radian.
 */
export function screenZoom(px_per_rad: number): number {
  return LABEL_PX / px_per_rad / LABEL_HEIGHT;
}

/** Returns the length, um, that appears under an angle at a point. */
export function lengthAt(
  point: Vector3,
  { eye_um, zoom }: Pick<EyeView, "eye_um" | "zoom">,
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

/** A part of a mark, which takes over `geometry` and disposes of it. */
export type Piece = Readonly<{
  geometry: BufferGeometry;
  color: ColorRepresentation;
  opacity?: number;
}>;

/** Merges parts with their own colours into one mark, which takes one draw call instead of one for each part. */
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

/** Adds a faint copy of a mark, which shows where the mark is behind something. */
function ghosted<
  T extends Mesh<BufferGeometry, MeshBasicMaterial> | Line<BufferGeometry, LineBasicMaterial>,
>(mark: T, ghost: T): T {
  ghost.material.depthFunc = GreaterDepth;
  ghost.material.opacity *= GHOST;
  ghost.material.color = mark.material.color; // a change of either material's colour changes both
  for (const each of [mark, ghost]) {
    each.renderOrder = MARKS_ORDER;
    each.frustumCulled = false;
  }
  mark.add(ghost);
  return mark;
}

/** Adds a dark rim around a mark, which may lie on something equally bright. */
export function rimmed(mark: MarkMesh): MarkMesh {
  const material = new MeshBasicMaterial({ color: RIM, side: BackSide, ...MATERIAL });
  const rim = new Mesh(mark.geometry, material);
  rim.scale.setScalar(RIM_SCALE);
  rim.renderOrder = MARKS_ORDER - 0.5;
  rim.frustumCulled = false;
  mark.add(rim);
  return mark;
}

/** Disposes of geometry and materials of all meshes and lines below an object; shared ones may be disposed of twice. */
export function disposeMarks(root: Object3D): void {
  root.traverse((object) => {
    const { geometry, material } = object as Partial<MarkMesh>;
    geometry?.dispose();
    material?.dispose();
  });
}
