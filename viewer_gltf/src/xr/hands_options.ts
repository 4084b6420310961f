import type { Scene, WebXRManager } from "three";
import type { Target } from "../interaction/ray_pointer";
import type { BoxedTile } from "../math/pick";
import type { Ray } from "../math/vec3";
import type { Layout, Lenses, PanelView } from "../panel/controls";
import type { Specimen } from "../render/specimen_pose";
import type { Action } from "../state/actions";
import type { Command } from "../state/commands";

export type HandsOptions = Readonly<{
  xr: Pick<WebXRManager, "getFrame" | "getReferenceSpace">;
  scene: Scene;
  specimen: Specimen;
  tiles: readonly BoxedTile[];
  /** Draggable targets between the panel and the tiles, such as the handles of a clip plane. */
  handles?: () => readonly Target[];
  buildPanel: (view: PanelView) => Layout;
  onAction: (action: Action) => void;
  onCommand: (command: Command) => void;
  /**
   * Called when a tile is chosen by dwell (`isByGaze`) or button; the ray is in um of the specimen.
   */
  onChoose: (ray: Ray, tile: string, isByGaze: boolean) => void;
  /**
   * Returns the name and distance of the object along a ray in um of the specimen, or null. Absent
   * if there are no objects.
   */
  objectAlong?: (ray: Ray) => Readonly<{ id: string; distance: number }> | null;
  onLeave: () => void;
  onLenses?: (lenses: Lenses) => void;
  /** False: panel and notices are not drawn, as in tests without a screen. Absent: true. */
  isPainted?: boolean;
  /** Clock of the page's events, ms; absent: the page's own. */
  now_ms?: () => number;
}>;
