/** The box round several marched tiles, um, world. */
import { Vector3 } from "three";
import type { TileMarch } from "./tile_raymarch";

export class MarchedBox {
  readonly min = new Vector3().setScalar(Number.POSITIVE_INFINITY);
  readonly max = new Vector3().setScalar(Number.NEGATIVE_INFINITY);
  count = 0;

  add(march: TileMarch): void {
    march.growBox(this.min, this.max);
    this.count++;
  }
}
