/**
 * The WebXR session: two eyes with the specimen in front of them, or augmented reality in a headset
 * or on a phone's screen.
 */
import { PerspectiveCamera, type WebGLRenderer } from "three";

/** Wanted frames per second: 72 steady ones look better than 90 or 120 of which some come late. */
const RATE_HZ = 72;
/**
 * Foveation, 0 to 1, if the layer offers it; at this value the panel's text stays legible at the
 * side.
 */
const FOVEATION = 0.67;

export type ImmersiveMode = "immersive-vr" | "immersive-ar";

async function hasSpace(session: XRSession, type: XRReferenceSpaceType): Promise<boolean> {
  return session.requestReferenceSpace(type).then(
    () => true,
    () => false,
  );
}

export class XrSession {
  /** Camera that three.js moves with the head; near and far planes of both eyes, metres. */
  readonly camera = new PerspectiveCamera(70, 1, 0.05, 20);
  private session: XRSession | null = null;
  private mode: ImmersiveMode = "immersive-vr";
  /** Whether heights are measured from the floor; otherwise from the eyes' height at the start. */
  hasFloor = false;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly onStart: () => void,
    private readonly onEnd: () => void,
  ) {
    renderer.xr.enabled = true;
  }

  get isRunning(): boolean {
    return this.session !== null;
  }

  get current(): XRSession | null {
    return this.session;
  }

  /** Frames per second, if the headset reports them. */
  get rate_hz(): number | undefined {
    return this.session?.frameRate;
  }

  /** Whether the user's own room is visible behind the specimen. */
  get isInUsersRoom(): boolean {
    return this.session !== null && this.mode === "immersive-ar";
  }

  /**
   * Starts a session. Must be called from a click or a tap. Rejects if the browser or the user
   * refuses, or if `prepared` rejects.
   *
   * @param prepared resolves when everything for the first frame is loaded
   */
  async start(
    xr: XRSystem,
    mode: ImmersiveMode = "immersive-vr",
    prepared: Promise<unknown> = Promise.resolve(),
  ): Promise<void> {
    prepared.catch(() => undefined); // a rejection is reported where `prepared` is awaited below
    if (this.session !== null) return;
    const session = await xr.requestSession(mode, { optionalFeatures: ["local-floor"] });
    this.session = session;
    this.mode = mode;
    session.addEventListener("end", () => {
      this.session = null;
      this.onEnd();
    });
    try {
      await prepared;
      // The origin is at the eyes at the start, for any body height. In augmented reality it is on
      // the floor if that is known.
      this.hasFloor = mode === "immersive-ar" && (await hasSpace(session, "local-floor"));
      this.renderer.xr.setReferenceSpaceType(this.hasFloor ? "local-floor" : "local");
      await this.renderer.xr.setSession(session);
    } catch (error) {
      this.session = null; // allows the user to start another session
      void session.end().catch(() => undefined); // fails if the session has ended by itself
      throw error;
    }
    this.tune(session);
    this.onStart();
  }

  async end(): Promise<void> {
    await this.session?.end();
  }

  /** Sets features that only some headsets offer. */
  private tune(session: XRSession): void {
    const { xr } = this.renderer;
    if (typeof xr.setFoveation === "function") xr.setFoveation(FOVEATION);
    if (!session.supportedFrameRates?.includes(RATE_HZ)) return;
    if (typeof session.updateTargetFrameRate !== "function") return;
    // The headset may refuse, and then keeps its own rate.
    void session.updateTargetFrameRate(RATE_HZ).catch(() => undefined);
  }
}
