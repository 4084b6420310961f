/**
 * A faint grid on the ground of the dark scene in stereo. A user who turns or tilts the head sees
 * by it that the scene stands still. The grid fades towards the horizon and is drawn behind
 * everything.
 */
import { BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineSegments } from "three";

/** Metres below the eyes when stereo begins: about the height of a standing user's eyes. */
const UNDER_EYES_M = 1.45;
/** Metres between two lines, and from the middle to the farthest line. */
const STEP_M = 0.75;
const REACH_M = 9;
const COLOR = new Color(0x5a6f96);
const OPACITY = 0.55;
/** The ground is drawn first, so that everything else covers it. */
const RENDER_ORDER = -1;

export class Ground {
  readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;

  constructor() {
    const material = new LineBasicMaterial({
      vertexColors: true,
      transparent: true,
      depthWrite: false,
      toneMapped: false,
    });
    this.lines = new LineSegments(grid(), material);
    this.lines.name = "ground";
    this.lines.renderOrder = RENDER_ORDER;
    this.lines.position.y = -UNDER_EYES_M;
    this.lines.visible = false;
  }

  /** @param isShown false in augmented reality, where the user's own room has a ground */
  show(isShown: boolean): void {
    this.lines.visible = isShown;
  }

  dispose(): void {
    this.lines.geometry.dispose();
    this.lines.material.dispose();
    this.lines.removeFromParent();
  }
}

/** Lines along x and z in pieces; the opacity of each end falls with its distance. */
function grid(): BufferGeometry {
  const count = Math.round(REACH_M / STEP_M);
  const steps = Array.from({ length: 2 * count + 1 }, (_, i) => (i - count) * STEP_M);
  const positions: number[] = [];
  const colors: number[] = [];
  const add = (x: number, z: number) => {
    const share = Math.max(0, 1 - Math.hypot(x, z) / REACH_M);
    positions.push(x, 0, z);
    colors.push(COLOR.r, COLOR.g, COLOR.b, OPACITY * share ** 2);
  };
  for (const across of steps) {
    for (const along of steps.slice(0, -1)) {
      if (Math.hypot(across, along) > REACH_M) continue;
      add(across, along);
      add(across, along + STEP_M);
      add(along, across);
      add(along + STEP_M, across);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute("color", new BufferAttribute(new Float32Array(colors), 4));
  return geometry;
}
