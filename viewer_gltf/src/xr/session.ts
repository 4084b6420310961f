/** The immersive session: two eyes, the specimen in front of them. */
import { PerspectiveCamera, type WebGLRenderer } from "three";

export class XrSession {
  /** three moves it with the head; its clip planes hold for both eyes. Metres. */
  readonly camera = new PerspectiveCamera(70, 1, 0.05, 20);
  private session: XRSession | null = null;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly onStart: () => void,
    private readonly onEnd: () => void,
    private readonly onSelect: () => void,
  ) {
    renderer.xr.enabled = true;
    // The origin is where the eyes are when the session starts, whatever the body's height.
    renderer.xr.setReferenceSpaceType("local");
  }

  get isRunning(): boolean {
    return this.session !== null;
  }

  /** Frames a second, where the headset tells. */
  get rate_hz(): number | undefined {
    return this.session?.frameRate;
  }

  /** Must be called from a click or a tap. Rejects if the browser or the user refuses. */
  async start(xr: XRSystem): Promise<void> {
    if (this.session !== null) return;
    const session = await xr.requestSession("immersive-vr", {
      optionalFeatures: ["local-floor"],
    });
    this.session = session;
    session.addEventListener("select", this.onSelect);
    session.addEventListener("end", () => {
      this.session = null;
      this.onEnd();
    });
    try {
      await this.renderer.xr.setSession(session);
    } catch (error) {
      this.session = null; // so that it can be tried again
      void session.end().catch(() => undefined); // it may have ended by itself: that was the fault
      throw error;
    }
    this.onStart();
  }

  async end(): Promise<void> {
    await this.session?.end();
  }
}
