/**
 * The clip box and clip plane as uniforms for the surfaces' shaders: planes in the scene, shared by
 * reference.
 */
import { type Matrix4, Vector3, Vector4 } from "three";
import type { Box } from "../math/box";
import type { Clip, ClipPlane } from "../math/clip";
import { AXES, type Vec3, withPart } from "../math/vec3";
import { CORNER_PLANES, type MarchClip, noCorner } from "./clip_uniforms";

const MAX_PLANES = 7; // six faces of the box, and the plane
/**
 * Largest coordinate, um, of a clip box that removes nothing: farther than any specimen, but within
 * the precision of floats.
 */
const FAR = 1e9;
/** A plane that removes nothing. */
const NOWHERE: ClipPlane = { normal: [0, 0, 0], offset_um: 1 };

export class Cuts {
  /**
   * xyz unit normal, w offset in metres of the scene; points with dot(xyz, p) > w are removed. The
   * planes of the corner follow at the end.
   */
  readonly uCuts = {
    value: Array.from({ length: MAX_PLANES + CORNER_PLANES }, () => new Vector4()),
  };
  readonly uCutCount = { value: 0 };
  /** Faces of the tile that is drawn as a volume among surfaces; all zeros if there is none. */
  readonly uOpen = { value: Array.from({ length: 6 }, () => new Vector4()) };
  /** The same clip for the ray march, um. */
  readonly march: MarchClip = {
    min: new Vector3(),
    max: new Vector3(),
    plane: new Vector4(),
    corner: noCorner(),
  };

  sync({ box, plane, corner }: Clip, specimen: Matrix4): void {
    let count = 0;
    const put = (i: number, normal: Vec3, offset_um: number) =>
      setPlane(this.uCuts.value[i], normal, offset_um, specimen);
    this.march.min.setScalar(-FAR);
    this.march.max.setScalar(FAR);
    this.march.plane.set(0, 0, 0, 1);
    if (box !== null) {
      const [a, b] = [box.min, box.max];
      for (const { normal, offset_um } of facesOf(box)) put(count++, normal, offset_um);
      this.march.min.set(...a);
      this.march.max.set(...b);
    }
    if (plane !== null) {
      put(count++, plane.normal, plane.offset_um);
      this.march.plane.set(...plane.normal, plane.offset_um);
    }
    this.uCutCount.value = count;
    this.march.corner.forEach((each, i) => {
      const { normal, offset_um } = corner?.[i] ?? NOWHERE;
      each.set(...normal, offset_um);
      put(MAX_PLANES + i, normal, offset_um);
    });
  }

  /** @param tile the tile that is drawn as a volume among surfaces, um, or null */
  open(tile: Box | null, specimen: Matrix4): void {
    if (tile === null) for (const plane of this.uOpen.value) plane.set(0, 0, 0, 0);
    else {
      for (const [i, { normal, offset_um }] of facesOf(tile).entries()) {
        setPlane(this.uOpen.value[i], normal, offset_um, specimen);
      }
    }
  }
}

function facesOf({ min, max }: Box): readonly ClipPlane[] {
  return AXES.flatMap((axis) => [
    { normal: withPart([0, 0, 0], axis, -1), offset_um: -min[axis] },
    { normal: withPart([0, 0, 0], axis, 1), offset_um: max[axis] },
  ]);
}

/** Converts a plane of the specimen, um, to a plane of the scene, metres. */
function setPlane(plane: Vector4, normal: Vec3, offset_um: number, specimen: Matrix4): void {
  const along = new Vector3(...normal).transformDirection(specimen);
  const on = new Vector3(...normal).multiplyScalar(offset_um).applyMatrix4(specimen);
  plane.set(along.x, along.y, along.z, along.dot(on));
}
