/**
 * Stereo for a phone in a Cardboard, in a browser without WebXR (Safari on an iPhone):
 * split screen, lens distortion, the head's turn.
 *
 * Why not a polyfill. webxr-polyfill 2.0.3 with cardboard-vr-display 1.0.19 (both Apache-2.0) were
 * run with three 0.187 on WebGL 2, the browser's own WebXR removed. three has its XRWebGLLayer path
 * still (it takes layers only where XRWebGLBinding exists), so a session starts and two eyes are
 * drawn. But:
 * - Its distorter draws with vertexAttribPointer into whatever vertex array is bound (submitFrame
 *   in cardboard-distorter.js restores program, buffers and texture only), and in WebGL 2 that is
 *   three's of the mesh drawn last. That mesh is gone from then on, in stereo and after it: 65
 *   "no buffer is bound to enabled attribute" in the second after the end. Reported to both
 *   projects in 2023 (webxr-polyfill 170, three 26166); open in one, declined by the other.
 * - It patches enable, viewport, bindFramebuffer... of the context, although three caches its
 *   state; its frame buffer has no anti-aliasing and 16 bits of depth.
 * - It never asks Safari for the orientation, so that the head stands still since iOS 13; it knows
 *   the two viewers of 2014 and 2015, and reads no code; it fetches its table of phones from
 *   another host, which our Content-Security-Policy forbids, and that table ends in 2020.
 * - 51 kB gzip; this folder, which draws through three alone, is 7.
 */
import { type ArrayCamera, Matrix4, Vector2, type WebGLRenderer, WebGLRenderTarget } from "three";
import { BundleError } from "../../bundle/errors";
import { DistortionPass } from "./distortion_pass";
import { type Eye, EyeCameras } from "./eye_cameras";
import { type Gesture, listenForFingers } from "./fingers";
import { cssPixelsPerInch, screenOf } from "./lens";
import { HeadSensor, ORIENTATION_ABSENT, ORIENTATION_REFUSED } from "./orientation";
import type { ScreenHold } from "./screen";
import { TurnSign } from "./turn_sign";
import type { Asked } from "./user_gesture";
import { CARDBOARD_V2, type Profile } from "./viewer_profile";

/** From a report to the screen's light a frame goes by, ms. */
const FRAME_MS = 1000 / 60;

export type SplitOptions = Readonly<{
  /** CSS pixels in an inch of this screen; null: guessed from the browser's name. */
  cssPixelsPerInch: number | null;
  /** Between the two pictures' points of view, m; absent: as the lenses. */
  apart_m?: number;
}>;

export class SplitSession {
  /** Between the eyes: the pose in the room, metres; at first at the origin, looking along -z. */
  readonly head = new Matrix4();
  /** The undistorted pictures, the left eye's on the left, as large as the canvas's buffer. */
  readonly target: WebGLRenderTarget;
  private readonly cameras = new EyeCameras();
  private readonly pass = new DistortionPass();
  private readonly size = new Vector2();
  private profile = CARDBOARD_V2;
  private running: Running | null = null;
  private layout = "";

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly onStart: () => void,
    private readonly onEnd: () => void,
    private readonly onGesture: (gesture: Gesture) => void,
    private options: SplitOptions = { cssPixelsPerInch: null },
  ) {
    // It takes a finished picture, encoded as on the canvas.
    this.target = new WebGLRenderTarget(1, 1, { depthBuffer: false });
  }

  /** The phone is in another viewer. */
  setProfile(profile: Profile): void {
    this.profile = profile;
    this.layout = "";
  }

  /** Another screen, or other eyes than the lenses are made for. */
  set(options: SplitOptions): void {
    this.options = options;
    this.layout = "";
  }

  /** Both eyes in one, as in WebXR: render with it into `target`. */
  get camera(): ArrayCamera {
    return this.cameras.both;
  }

  get eyes(): readonly Eye[] {
    return this.cameras.eyes;
  }

  get isRunning(): boolean {
    return this.running?.hasStarted ?? false;
  }

  /** The features that this browser refused, in words; empty if there are none. */
  get problems(): readonly string[] {
    return this.running?.problems ?? [];
  }

  /** With what was asked for in a tap. Throws BundleError if the orientation is refused. */
  async start(profile: Profile, asked: Asked): Promise<void> {
    if (this.running !== null) return;
    this.profile = profile;
    this.layout = "";
    const running = new Running(asked, () => this.end(), this.onGesture);
    this.running = running;
    const [found, { problems }] = await Promise.all([asked.orientation, asked.screen]);
    if (this.running !== running) return; // ended while the browser asked
    if (found === "refused") {
      this.running = null;
      running.dispose();
      throw new BundleError(ORIENTATION_REFUSED);
    }
    running.problems = found === "absent" ? [...problems, ORIENTATION_ABSENT] : problems;
    await running.sign.turned();
    if (this.running !== running) return; // left while the phone was upright
    this.update();
    running.hasStarted = true;
    this.onStart();
  }

  end(): void {
    const { running } = this;
    if (running === null) return;
    this.running = null;
    running.dispose();
    if (running.hasStarted) this.onEnd();
  }

  /** Look along -z again, wherever the head is. */
  recentre(): void {
    this.running?.sensor.recentre();
  }

  /** Read the head's turn, and move the eyes with it. Once a frame, before anything is drawn. */
  update(): void {
    this.fit();
    this.running?.sensor.pose(this.head, performance.now() + FRAME_MS);
    this.cameras.follow(this.head);
  }

  /** Show `target` on the canvas, as the lenses need it. */
  present(): void {
    this.pass.render(this.renderer, this.target);
  }

  dispose(): void {
    this.end();
    this.target.dispose();
    this.pass.dispose();
  }

  /** Lay the pictures out anew if the canvas has another size. */
  private fit(): void {
    const { width, height } = this.renderer.getDrawingBufferSize(this.size);
    const layout = `${width} ${height} ${this.renderer.getPixelRatio()}`;
    if (layout === this.layout) return;
    this.layout = layout;
    const perInch =
      this.options.cssPixelsPerInch ?? cssPixelsPerInch(navigator.userAgent, devicePixelRatio);
    const css = this.renderer.getSize(this.size);
    const screen = screenOf(css.x, css.y, perInch);
    this.target.setSize(width, height);
    this.pass.setLens(this.profile, screen);
    const { apart_m = this.profile.interLens_m } = this.options;
    this.cameras.fit(this.profile, screen, width, height, apart_m);
  }
}

/** Changes that last as long as one session, and are undone with it. */
class Running {
  readonly sensor = new HeadSensor();
  readonly sign: TurnSign;
  problems: readonly string[] = [];
  /** False while the browser asks the user for the orientation, and while the phone is upright. */
  hasStarted = false;
  private readonly stage: HTMLElement;
  private readonly hold: Promise<ScreenHold>;
  private readonly stopped = new AbortController();
  private readonly style: string;
  /** Its own number, since a page that was loaded again keeps the state of its last session. */
  private readonly step = Math.random();

  constructor({ stage, screen }: Asked, end: () => void, onGesture: (gesture: Gesture) => void) {
    const { signal } = this.stopped;
    this.stage = stage;
    this.hold = screen;
    this.style = stage.style.cssText;
    // Over the whole page, where a browser has no full screen. What a notch hides of one eye's picture,
    // the other's leaves out too: the lenses' middle stays the screen's.
    const zIndex = "2147483647";
    const notch = "max(env(safe-area-inset-left), env(safe-area-inset-right))";
    Object.assign(stage.style, {
      position: "fixed",
      inset: 0,
      width: "100%",
      height: "100%",
      border: "0 solid #000",
      borderInlineWidth: notch,
      zIndex,
    });
    this.sign = new TurnSign(stage, end);
    listenForFingers(stage, onGesture, signal);
    const onKey = (event: KeyboardEvent) => {
      if (event.key !== "Escape") return;
      event.preventDefault(); // on the page the key means another step back
      end();
    };
    addEventListener("keydown", onKey, { signal, capture: true });
    // A step in the history, so that the back gesture leaves the viewer and not the page.
    history.pushState({ split: this.step }, "");
    addEventListener("popstate", end, { signal });
  }

  dispose(): void {
    if (this.stopped.signal.aborted) return;
    this.stopped.abort();
    this.sensor.dispose();
    this.sign.dispose();
    this.stage.style.cssText = this.style;
    void this.hold.then(({ release }) => release());
    // Not if the user went back, nor if the page has written another address over the step.
    if ((history.state as { split?: number } | null)?.split === this.step) history.back();
  }
}
