/** One frame of the scene: poses the eyes, advances motions, and draws. */
import { type Camera, type Matrix4, Vector3, type WebGLRenderer } from "three";
import type { Bounds } from "../bundle/generated/bundle";
import { rayAhead } from "../interaction/rays";
import { eyeViewOf } from "../marks/eye_view";
import type { Vec3 } from "../math/vec3";
import { type FramePace, FrameRenderer } from "../render/frame_renderer";
import type { GazeFocus } from "../render/gaze_focus";
import type { SpecimenScene } from "../render/specimen_scene";
import { marchedTile } from "../state/representation";
import type { ViewerState } from "../state/viewer_state";
import type { Stereo } from "../xr/stereo";
import type { Forms } from "./forms";
import type { FrameView } from "./part";
import type { Parts } from "./parts";
import type { Viewpoint } from "./viewpoint";

export type SceneFrameOptions = Readonly<{
  renderer: WebGLRenderer;
  stage: HTMLElement;
  specimenScene: SpecimenScene;
  hybrid: GazeFocus;
  /** Box of the specimen, um. */
  bounds: Bounds;
  /** Content of the frames. It is made after the renderer of frames, whose uniforms its shaders use. */
  shown: () => Readonly<{
    forms: Forms;
    parts: Parts;
    stereo: Stereo;
    viewpoint: Viewpoint;
    state: ViewerState;
  }>;
  /** Called with the view of the frame before it is drawn. */
  onAdvance: (frame: FrameView) => void;
  /** Called when the gaze has moved to another tile, so that other forms are shown. */
  onFocus: () => void;
}>;

export class SceneFrame {
  readonly picture: FrameRenderer;
  private readonly eye = new Vector3();

  constructor(private readonly options: SceneFrameOptions) {
    const { renderer, specimenScene, hybrid } = options;
    this.picture = new FrameRenderer(renderer, specimenScene, hybrid);
  }

  /** Poses the flat camera, and returns it. */
  poseMono(dt_s: number): Camera {
    const { viewpoint, forms, state } = this.options.shown();
    const { navigation } = viewpoint;
    const outline = forms.outline(state);
    if (outline !== null) navigation.setOccupied(outline);
    const shown = forms.shownPoints(state);
    if (shown !== null) this.options.specimenScene.fitBackdrop(navigation.toScene(shown));
    navigation.update(dt_s);
    this.followScreen();
    return navigation.camera;
  }

  /** Poses the eyes for stereo on the page's own screen. */
  followScreen(): void {
    const { stereo, viewpoint } = this.options.shown();
    const { camera, controls } = viewpoint.navigation;
    stereo.followScreen(this.picture.eyes, camera, controls.target);
  }

  /**
   * Chooses volumes by the gaze, and advances motions and fades by some seconds. Returns whether
   * the specimen or the focus disc still moves (`isChanging`), and whether anything still fades
   * (`isFading`).
   */
  advance(dt_s: number, fade_s = dt_s): Readonly<{ isChanging: boolean; isFading: boolean }> {
    const { hybrid, specimenScene, onFocus } = this.options;
    const { forms, stereo, viewpoint, state } = this.options.shown();
    const { head } = viewpoint;
    const { specimen } = specimenScene;
    const isMoving = specimen.advance(dt_s);
    this.picture.fade.advance(fade_s);
    if (specimen.takeJump() && stereo.kind !== null) this.picture.fade.begin();
    const isReady = (tile: string) => forms.marched?.isReady(tile) ?? false;
    if (hybrid.look(state, head, specimen.group.matrixWorld, isReady, dt_s)) onFocus();
    const isFading = forms.fade(fade_s);
    this.options.onAdvance(this.viewOf(head, dt_s));
    return { isChanging: isMoving || hybrid.isChanging(state), isFading };
  }

  private viewOf(head: Matrix4, dt_s: number): FrameView {
    const { hybrid, specimenScene, stage } = this.options;
    const { stereo, viewpoint } = this.options.shown();
    const { group } = specimenScene.specimen;
    const { camera, controls } = viewpoint.navigation;
    const flat = { camera, height_px: stage.clientHeight, focus: controls.target };
    const screen = stereo.kind === null ? flat : null;
    return {
      head,
      specimen: group.matrixWorld,
      screen,
      gaze: rayAhead(head, group),
      disc: { apex_um: hybrid.apex_um, axis_um: hybrid.axis_um, cosine: hybrid.cosines[1] },
      isPanelOpen: stereo.isPanelOpen,
      isBarBelow: !stereo.isInUsersRoom,
      eyeView: eyeViewOf(head, group.matrixWorld, screen),
      dt_s,
    };
  }

  draw(pace: FramePace): void {
    const { forms, parts, stereo, viewpoint, state } = this.options.shown();
    const { head } = viewpoint;
    const drawn = {
      volumes: forms.marched,
      traced: forms.traced,
      panes: forms.panes,
      overlays: [...parts.overlays, ...stereo.overlays],
      bounds: this.options.bounds,
      openTile: this.openTile(state),
      solids: forms.triangles + parts.solid,
    };
    const clip = { ...state.clip, corner: parts.cutBefore(this.eyeOnSpecimen(head)) };
    stereo.present(() => this.picture.draw(head, drawn, clip, pace));
  }

  private openTile(state: ViewerState): Bounds | null {
    const { specimenScene, hybrid } = this.options;
    return specimenScene.boundsOf(marchedTile(state, hybrid.focusTiles));
  }

  /** Returns the place of the eye, um, world. */
  private eyeOnSpecimen(head: Matrix4): Vec3 {
    const { group } = this.options.specimenScene.specimen;
    return group.worldToLocal(this.eye.setFromMatrixPosition(head)).toArray();
  }

  dispose(): void {
    this.picture.dispose();
  }
}
