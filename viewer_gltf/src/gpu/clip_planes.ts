/** The cuts of clip box and plane for the surfaces' shaders: planes in the room, by reference. */
import { type Matrix4, Vector3, Vector4 } from "three";
import type { Clip, ClipPlane } from "../math/clip";
import type { Vec3 } from "../math/vec3";
import { CORNER_PLANES, type MarchClip, noCorner } from "./clip_uniforms";

const MAX_PLANES = 7; // six faces of the box, and the plane
/** um; beyond any specimen, within the precision of floats. */
const FAR = 1e9;
/** A plane beyond which nothing lies. */
const NOWHERE: ClipPlane = { normal: [0, 0, 0], offset_um: 1 };

export class Cuts {
  /**
   * xyz unit normal, w offset, metres of the room: gone is where dot(xyz, p) > w; after these the planes of
   * the corner.
   */
  readonly uCuts = {
    value: Array.from({ length: MAX_PLANES + CORNER_PLANES }, () => new Vector4()),
  };
  readonly uCutCount = { value: 0 };
  /** The same for the march, um. */
  readonly march: MarchClip = {
    min: new Vector3(),
    max: new Vector3(),
    plane: new Vector4(),
    corner: noCorner(),
  };

  follow({ box, plane, corner }: Clip, specimen: Matrix4): void {
    let count = 0;
    const put = (i: number, [x, y, z]: Vec3, offset_um: number) => {
      const normal = new Vector3(x, y, z).transformDirection(specimen);
      const on = new Vector3(x, y, z).multiplyScalar(offset_um).applyMatrix4(specimen);
      this.uCuts.value[i].set(normal.x, normal.y, normal.z, normal.dot(on));
    };
    const add = (x: number, y: number, z: number, offset_um: number) =>
      put(count++, [x, y, z], offset_um);
    this.march.min.setScalar(-FAR);
    this.march.max.setScalar(FAR);
    this.march.plane.set(0, 0, 0, 1);
    if (box !== null) {
      const [a, b] = [box.min, box.max];
      add(-1, 0, 0, -a[0]);
      add(0, -1, 0, -a[1]);
      add(0, 0, -1, -a[2]);
      add(1, 0, 0, b[0]);
      add(0, 1, 0, b[1]);
      add(0, 0, 1, b[2]);
      this.march.min.set(...a);
      this.march.max.set(...b);
    }
    if (plane !== null) {
      add(...plane.normal, plane.offset_um);
      this.march.plane.set(...plane.normal, plane.offset_um);
    }
    this.uCutCount.value = count;
    this.march.corner.forEach((each, i) => {
      const { normal, offset_um } = corner?.[i] ?? NOWHERE;
      each.set(...normal, offset_um);
      put(MAX_PLANES + i, normal, offset_um);
    });
  }
}
