/**
 * The name of what is looked at: the tile, and the channel where a surface is met. It comes once the
 * gaze has rested: in stereo beside the point and not on it, on a flat screen in the picture's corner,
 * since the middle of the picture is what is looked at.
 */
import { Object3D, Vector3 } from "three";
import { element } from "../dom/element";
import { advanceRest, type Rest } from "../interaction/ray_at_rest";
import { Label } from "../marks/label";
import type { Sight } from "../marks/style";
import type { Ray } from "../math/vec3";
import type { Probed } from "../probe/probe";

/** Time for which the gaze rests before the name comes, s. */
export const NAME_S = 0.4;

export type Named = Readonly<{ probed: Probed; text: string }>;

export class NameMark {
  /** um, world. */
  readonly group = new Object3D();
  readonly root = element("div", { className: "name-mark", hidden: true });
  private readonly label = new Label("aside");
  private readonly at = new Vector3();
  private rest: Rest | null = null;
  private isNamed = false;

  constructor() {
    this.group.add(this.label.sprite);
  }

  get text(): string {
    return this.root.textContent ?? "";
  }

  /** What is looked at may have got another name. */
  ask(): void {
    this.isNamed = false;
  }

  /** What is looked at may have changed: wait anew. */
  forget(): void {
    this.rest = null;
    this.isNamed = false;
    this.write("");
  }

  /**
   * @param name called once, when the gaze has come to rest; null: nothing is there
   */
  follow(ray: Ray, tremble_um: number, dt_s: number, name: () => Named | null): void {
    this.rest = advanceRest(this.rest, ray, tremble_um, dt_s);
    if (this.rest.elapsed_s < NAME_S) {
      this.isNamed = false;
      this.write("");
      return;
    }
    if (this.isNamed) return;
    this.isNamed = true;
    const found = name();
    if (found === null) {
      this.write("");
      return;
    }
    this.at.set(...found.probed.point);
    this.write(found.text);
  }

  showOnScreen(): void {
    this.label.sprite.visible = false;
    this.root.hidden = this.text === "";
  }

  placeInRoom(sight: Sight): void {
    this.root.hidden = true;
    this.label.write(this.text);
    this.label.place(this.at, sight);
  }

  private write(text: string): void {
    if (text !== this.text) this.root.textContent = text;
  }

  dispose(): void {
    this.root.remove();
    this.group.removeFromParent();
    this.label.dispose();
  }
}
