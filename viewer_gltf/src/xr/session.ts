/** The immersive session: two eyes, the specimen in front of them; in the user's own room a phone's one, too. */
import { PerspectiveCamera, type WebGLRenderer } from "three";

/** Wanted frames a second: 72 even ones look better than 90 or 120 of which some come late. */
const RATE_HZ = 72;
/** Foveation, 0..1, where the layer offers it: the panel's text stays legible at the side. */
const FOVEATION = 0.67;

export type ImmersiveMode = "immersive-vr" | "immersive-ar";

async function hasSpace(session: XRSession, type: XRReferenceSpaceType): Promise<boolean> {
  return session.requestReferenceSpace(type).then(
    () => true,
    () => false,
  );
}

export class XrSession {
  /** three moves it with the head; its clip planes hold for both eyes. Metres. */
  readonly camera = new PerspectiveCamera(70, 1, 0.05, 20);
  private session: XRSession | null = null;
  private mode: ImmersiveMode = "immersive-vr";
  /** Whether heights are from the floor; else from where the eyes are when it starts. */
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

  /** The session that runs, for its input sources. */
  get current(): XRSession | null {
    return this.session;
  }

  /** Frames a second, where the headset reports them. */
  get rate_hz(): number | undefined {
    return this.session?.frameRate;
  }

  /** Whether the user's own room shows behind the specimen. */
  get isInUsersRoom(): boolean {
    return this.session !== null && this.mode === "immersive-ar";
  }

  /**
   * Must be called from a click or a tap. Rejects if the browser or the user refuses, or as `prepared` does.
   *
   * @param prepared what has to be there before the first frame
   */
  async start(
    xr: XRSystem,
    mode: ImmersiveMode = "immersive-vr",
    prepared: Promise<unknown> = Promise.resolve(),
  ): Promise<void> {
    prepared.catch(() => undefined); // it is awaited once the browser has answered
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
      // the origin is where the eyes are when it starts, whatever the body's height; a table has its own
      this.hasFloor = mode === "immersive-ar" && (await hasSpace(session, "local-floor"));
      this.renderer.xr.setReferenceSpaceType(this.hasFloor ? "local-floor" : "local");
      await this.renderer.xr.setSession(session);
    } catch (error) {
      this.session = null; // so that it can be tried again
      void session.end().catch(() => undefined); // it may have ended by itself: that was the fault
      throw error;
    }
    this.tune(session);
    this.onStart();
  }

  async end(): Promise<void> {
    await this.session?.end();
  }

  /** What only some headsets offer. */
  private tune(session: XRSession): void {
    const { xr } = this.renderer;
    if (typeof xr.setFoveation === "function") xr.setFoveation(FOVEATION);
    if (!session.supportedFrameRates?.includes(RATE_HZ)) return;
    if (typeof session.updateTargetFrameRate !== "function") return;
    // A wish: the headset may refuse, and then goes on at its own rate.
    void session.updateTargetFrameRate(RATE_HZ).catch(() => undefined);
  }
}
