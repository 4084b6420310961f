/**
 * The name of the tile that the user looks at, and of the channel if the gaze hits its surface. The name appears
 * after the gaze has rested for a moment. In stereo it stands beside the point, and on a flat screen in a corner of
 * the frame, so that it does not cover what the user looks at.
 */
import { Object3D, Vector3 } from "three";
import { element } from "../dom/element";
import { advanceRest, type Rest } from "../interaction/ray_at_rest";
import { Label } from "../marks/label";
import type { EyeView } from "../marks/style";
import type { Ray } from "../math/vec3";
import type { Probed } from "../probe/probe";

/** Time for which the gaze must rest before the name appears, in seconds. */
export const NAME_S = 0.4;

export type Named = Readonly<{ probed: Probed; text: string }>;

export class NameMark {
  /** Child of the specimen, in um. */
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

  /** Looks the name up again in the next frame, because more surfaces may have loaded under a resting gaze. */
  lookUpAgain(): void {
    this.isNamed = false;
  }

  /** Removes the name until the gaze has rested again, because the scene has changed. */
  forget(): void {
    this.rest = null;
    this.isNamed = false;
    this.write("");
  }

  /**
   * Shows the name once the gaze has rested for `NAME_S`.
   *
   * @param tremble_um largest movement of the ray that still counts as rest
   * @param name called once for each rest; returns null if the gaze hits nothing that has a name
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

  placeInStereo(eyeView: EyeView): void {
    this.root.hidden = true;
    this.label.write(this.text);
    this.label.place(this.at, eyeView);
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
