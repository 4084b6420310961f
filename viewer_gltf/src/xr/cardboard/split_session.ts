/**
 * Stereo on a phone in a Cardboard, for browsers without WebXR (Safari on an iPhone): a split
 * screen, lens distortion, and a view that follows the head.
 *
 * Why no polyfill is used: webxr-polyfill 2.0.3 with cardboard-vr-display 1.0.19 (both Apache-2.0)
 * were tried with three.js 0.187 on WebGL 2, with the browser's own WebXR removed. A session starts
 * and both eyes are drawn, because three.js uses XRWebGLLayer where XRWebGLBinding is absent. But:
 * - Its distorter sets vertex attributes without binding a vertex array of its own: submitFrame in
 *   cardboard-distorter.js restores the program, buffers and texture only. In WebGL 2 it overwrites
 *   the vertex array of the mesh that three.js drew last.
 * - That mesh is no longer drawn, in stereo and after it. The second after the session logged 65
 *   times "no buffer is bound to enabled attribute". The fault was reported to both projects in
 *   2023 (webxr-polyfill 170, three.js 26166). One issue is open, the other was declined.
 * - It patches enable, viewport, bindFramebuffer and others of the context, although three.js
 *   caches its state. Its frame buffer has no anti-aliasing and 16 bits of depth.
 * - It does not ask Safari for the orientation, so the view has not followed the head since iOS 13.
 * - It knows the two Cardboard viewers of 2014 and 2015, and does not read QR codes. It fetches a
 *   table of phones, which ends in 2020, from a host that our Content-Security-Policy forbids.
 * - Its gzipped code has 51 kB; this folder has 7 kB.
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
import type { StereoPermissions } from "./user_gesture";
import { CARDBOARD_V2, type Profile } from "./viewer_profile";

/** Milliseconds from reading the sensor until the frame is seen: one frame. */
const FRAME_MS = 1000 / 60;

export type SplitOptions = Readonly<{
  /** CSS pixels per inch of this screen; null: estimated from the browser's name. */
  cssPixelsPerInch: number | null;
  /** Distance between the two cameras, metres; absent: the distance between the lenses. */
  apart_m?: number;
}>;

export class SplitSession {
  /**
   * Pose of the point between the eyes in the scene, metres; at first at the origin, looking along
   * -z.
   */
  readonly head = new Matrix4();
  /** The undistorted images, the left eye's in the left half; as large as the canvas's buffer. */
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
    // The target gets a finished frame, whose colours are encoded like the canvas's, so it needs no
    // depth.
    this.target = new WebGLRenderTarget(1, 1, { depthBuffer: false });
  }

  setProfile(profile: Profile): void {
    this.profile = profile;
    this.layout = "";
  }

  /** Changes the size of the screen or the distance between the eyes. */
  set(options: SplitOptions): void {
    this.options = options;
    this.layout = "";
  }

  /** Camera of both eyes, as in WebXR; render with it into `target`. */
  get camera(): ArrayCamera {
    return this.cameras.both;
  }

  get eyes(): readonly Eye[] {
    return this.cameras.eyes;
  }

  get isRunning(): boolean {
    return this.running?.hasStarted ?? false;
  }

  /** A message for each feature that the browser refused. */
  get problems(): readonly string[] {
    return this.running?.problems ?? [];
  }

  /**
   * Starts the session with the permissions that were asked for in a tap. Throws BundleError if the
   * orientation is refused.
   */
  async start(profile: Profile, asked: StereoPermissions): Promise<void> {
    if (this.running !== null) return;
    this.profile = profile;
    this.layout = "";
    const running = new Running(asked, () => this.end(), this.onGesture);
    this.running = running;
    const [found, { problems }] = await Promise.all([asked.orientation, asked.screen]);
    if (this.running !== running) return; // ended while the browser was asking the user
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

  /** Makes the direction in which the head looks now the direction ahead, along -z. */
  recentre(): void {
    this.running?.sensor.recentre();
  }

  /**
   * Reads the orientation of the head and moves the eyes' cameras. Call it once a frame, before
   * drawing.
   */
  update(): void {
    this.fit();
    this.running?.sensor.pose(this.head, performance.now() + FRAME_MS);
    this.cameras.follow(this.head);
  }

  /** Draws `target` on the canvas, distorted for the lenses. */
  present(): void {
    this.pass.render(this.renderer, this.target);
  }

  dispose(): void {
    this.end();
    this.target.dispose();
    this.pass.dispose();
  }

  /** Computes the layout of the two images again if the canvas has another size. */
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

/** The state of one session, and the changes to the page that end with it. */
class Running {
  readonly sensor = new HeadSensor();
  readonly sign: TurnSign;
  problems: readonly string[] = [];
  /** False while the browser asks the user for permission, and while the phone is upright. */
  hasStarted = false;
  private readonly stage: HTMLElement;
  private readonly hold: Promise<ScreenHold>;
  private readonly stopped = new AbortController();
  private readonly style: string;
  /**
   * Number of this session's step in the history. It is random because a reloaded page keeps the
   * step of its last session.
   */
  private readonly step = Math.random();

  constructor(
    { stage, screen }: StereoPermissions,
    end: () => void,
    onGesture: (gesture: Gesture) => void,
  ) {
    const { signal } = this.stopped;
    this.stage = stage;
    this.hold = screen;
    this.style = stage.style.cssText;
    // Covers the page even if the browser has no full screen. Both sides get the border that the
    // wider notch needs, so that the middle between the lenses stays the middle of the screen.
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
      event.preventDefault(); // on the page, Escape would also leave the selected tile
      end();
    };
    addEventListener("keydown", onKey, { signal, capture: true });
    // A step in the history lets the back gesture leave stereo instead of the page.
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
    // The step is left alone if the user went back, or if the page has written another address over
    // it.
    if ((history.state as { split?: number } | null)?.split === this.step) history.back();
  }
}
