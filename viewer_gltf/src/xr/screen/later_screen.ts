/** Stereo on the page's own screen. Its code is loaded when it is first shown. */
import type { PerspectiveCamera, Vector3, WebGLRenderer } from "three";
import { BundleError } from "../../bundle/errors";
import type { Eyes } from "../../gpu/eyes";
import type { ScreenStereo } from "../../state/parameters/tools";
import type { ScreenImages } from "./screen_stereo";

const NOT_LOADED =
  "The part of the page that shows stereo could not be loaded. Check the connection, load " +
  "the page again, and tap again.";

/** Throws the error for stereo code that could not be loaded. */
export function notLoaded(cause: unknown): never {
  throw new BundleError(NOT_LOADED, { cause });
}

export class LaterScreen {
  /** The images for two eyes; null until stereo is first shown on the screen. */
  private images: ScreenImages | null = null;
  private kind: ScreenStereo = "off";

  constructor(private readonly renderer: WebGLRenderer) {}

  /** Shows or stops stereo. Rejects with BundleError if its code can't be loaded. */
  async show(kind: ScreenStereo): Promise<void> {
    this.kind = kind;
    if (kind === "off" || this.images !== null) return;
    const { ScreenImages } = await import("./screen_stereo").catch(notLoaded);
    this.images ??= new ScreenImages(this.renderer);
  }

  /**
   * Places the eyes in front of the screen, looking at `focus`: two if the screen shows stereo,
   * otherwise one.
   */
  sync(eyes: Eyes, camera: PerspectiveCamera, focus: Vector3, pupils_m: number): void {
    const { images, kind } = this;
    if (images === null || kind === "off") eyes.followScreen(this.renderer, camera);
    else images.sync(eyes, camera, focus, pupils_m, kind);
  }

  /** Draws a frame, as an anaglyph if that is chosen. */
  present(draw: () => void): void {
    if (this.kind === "anaglyph" && this.images !== null) this.images.present(draw);
    else draw();
  }

  dispose(): void {
    this.images?.dispose();
  }
}
