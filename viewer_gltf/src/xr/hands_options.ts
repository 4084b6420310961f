/** Options of the hands in stereo. */
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
  /** Targets between the panel and the tiles that can be dragged, such as a cut's handles. */
  handles?: () => readonly Target[];
  buildPanel: (view: PanelView) => Layout;
  onAction: (action: Action) => void;
  onCommand: (command: Command) => void;
  /** A tile was chosen by dwell (`isByGaze`) or button; the ray is in um of the specimen. */
  onChoose: (ray: Ray, tile: string, isByGaze: boolean) => void;
  /** The object along a ray in um of the specimen: its name, and where; null: none. Absent: there are none. */
  objectAlong?: (ray: Ray) => Readonly<{ id: string; distance: number }> | null;
  /** The user asks to leave stereo. */
  onLeave: () => void;
  /** The user has chosen another lens profile. */
  onLenses?: (lenses: Lenses) => void;
  /** Absent: true. False: panel and notices are not painted, as in a program without a screen. */
  isPainted?: boolean;
  /** The clock of the page's events, ms; absent: the page's own. */
  now_ms?: () => number;
}>;
