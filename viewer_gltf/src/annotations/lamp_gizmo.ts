/** The lamps of path tracing as balls in the scene that users can drag. Children of the specimen, in um. */
import { Object3D, SphereGeometry, Vector3 } from "three";
import type { HandleId } from "../marks/clip_handles";
import { Label } from "../marks/label";
import { LAMP_HANDLES, type LampHandleId, type LitState, lampHandles } from "../marks/lamp_handles";
import {
  BRIGHT,
  disposeMarks,
  type EyeView,
  HANDLE_RADIUS,
  HIGHLIGHT_SCALE,
  lengthAt,
  type MarkMesh,
  markMesh,
  rimmed,
} from "../marks/style";
import { type Box, boxSpan } from "../math/box";

/** Opacity of a lamp behind the specimen, 0..1. A path-traced frame has no depth that could hide the lamp. */
const BEHIND = 0.4;

type Ball = Readonly<{ mesh: MarkMesh; label: Label }>;

export class LampMark {
  readonly group = new Object3D();
  private readonly balls = new Map<LampHandleId, Ball>();
  private highlighted: HandleId | null = null;
  private specimen: Box = { min: [0, 0, 0], max: [0, 0, 0] };
  private readonly way = new Vector3();

  constructor() {
    const shape = new SphereGeometry(0.5, 20, 12);
    LAMP_HANDLES.forEach((id, i) => {
      const ball = { mesh: rimmed(markMesh(shape, BRIGHT)), label: new Label("aside") };
      ball.label.write(`${i + 1}`);
      this.balls.set(id, ball);
      this.group.add(ball.mesh, ball.label.sprite);
    });
  }

  /** @param specimen box of the whole specimen, um; lamps are placed around it even if one tile is isolated */
  show(state: LitState, specimen: Box): void {
    this.specimen = specimen;
    const handles = new Map(lampHandles(state, specimen).map((each) => [each.id, each.position]));
    this.group.visible = handles.size > 0;
    LAMP_HANDLES.forEach((id, i) => {
      const ball = this.balls.get(id);
      const position = handles.get(id);
      if (ball === undefined) return;
      ball.mesh.visible = ball.label.sprite.visible = position !== undefined;
      if (position === undefined) return;
      ball.mesh.position.set(...position);
      if (id === this.highlighted) ball.mesh.material.color.setHex(BRIGHT);
      else ball.mesh.material.color.setRGB(...state.trace.lamps[i].color);
    });
  }

  /** Sets the handle that is pointed at or held. The next `show` changes its colour. */
  highlight(id: HandleId | null): void {
    this.highlighted = id;
  }

  update(eyeView: EyeView): void {
    const { eye_um } = eyeView;
    for (const [id, { mesh, label }] of this.balls) {
      if (!mesh.visible) continue;
      const size = lengthAt(mesh.position, eyeView, 2 * HANDLE_RADIUS);
      mesh.scale.setScalar(id === this.highlighted ? HIGHLIGHT_SCALE * size : size);
      const direction = this.way.subVectors(mesh.position, eye_um).toArray();
      const ray = { origin: eye_um.toArray(), direction };
      mesh.material.opacity = boxSpan([0, 1], ray, this.specimen) === null ? 1 : BEHIND;
      label.place(mesh.position, eyeView);
    }
  }

  dispose(): void {
    this.group.removeFromParent();
    for (const { label } of this.balls.values()) label.dispose();
    disposeMarks(this.group);
  }
}
