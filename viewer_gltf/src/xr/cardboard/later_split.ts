/** The split screen of a phone. Its code is loaded when stereo is first started. */
import type { WebGLRenderer } from "three";
import { notLoaded } from "../screen/later_screen";
import type { Gesture } from "./fingers";
import type { SplitOptions, SplitSession } from "./split_session";
import { askInTap } from "./user_gesture";
import type { Profile } from "./viewer_profile";

export type SplitHandlers = Readonly<{
  /** Loads the code that draws stereo and handles input. */
  prepare: () => Promise<unknown>;
  onStart: () => void;
  onEnd: () => void;
  onGesture: (gesture: Gesture) => void;
}>;

export class LaterSplit {
  private session: SplitSession | null = null;
  /** A split screen that is starting: the browser may be asking the user. */
  private starting: Promise<readonly string[]> | null = null;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly handlers: SplitHandlers,
    private options: SplitOptions,
  ) {}

  /** The session that is shown, or null if the screen is not split. */
  get running(): SplitSession | null {
    return this.session?.isRunning ? this.session : null;
  }

  /**
   * Starts the split screen. Must be called from a tap. Returns a message for each feature that the
   * browser refused. Throws BundleError if it refuses one that stereo needs.
   */
  start(profile: Profile): Promise<readonly string[]> {
    this.starting ??= this.askAndSplit(profile).finally(() => {
      this.starting = null;
    });
    return this.starting;
  }

  private async askAndSplit(profile: Profile): Promise<readonly string[]> {
    const { renderer, handlers } = this;
    const asked = askInTap(renderer.domElement, () => this.end());
    try {
      const [session] = await Promise.all([this.session ?? this.load(), handlers.prepare()]);
      this.session = session;
    } catch (error) {
      void asked.screen.then(({ release }) => release());
      throw error;
    }
    await this.session.start(profile, asked);
    return this.session.problems;
  }

  private async load(): Promise<SplitSession> {
    const { SplitSession } = await import("./split_session").catch(notLoaded);
    const { onStart, onEnd, onGesture } = this.handlers;
    return new SplitSession(this.renderer, onStart, onEnd, onGesture, this.options);
  }

  /** Changes the size of the screen or the distance between the eyes. */
  set(options: SplitOptions): void {
    this.options = options;
    this.session?.set(options);
  }

  setProfile(profile: Profile): void {
    this.session?.setProfile(profile);
  }

  end(): void {
    this.session?.end();
  }

  dispose(): void {
    this.session?.dispose();
  }
}
