/** Stereo on the page's own screen. Its code comes when it is first wanted. */
import type { PerspectiveCamera, Vector3, WebGLRenderer } from "three";
import { BundleError } from "../../bundle/errors";
import type { Eyes } from "../../gpu/eyes";
import type { ScreenStereo } from "../../state/parameters/tools";
import type { ScreenPictures } from "./screen_stereo";

const NOT_LOADED =
  "The part of the page that shows stereo could not be loaded. Check the connection, load " +
  "the page again, and tap again.";

/** The error for a part of the page that did not load. */
export function notLoaded(cause: unknown): never {
  throw new BundleError(NOT_LOADED, { cause });
}

export class LaterScreen {
  /** The pictures for two eyes on the screen; null until stereo there is first wanted. */
  private pictures: ScreenPictures | null = null;
  private kind: ScreenStereo = "off";

  constructor(private readonly renderer: WebGLRenderer) {}

  /** Show stereo, or stop. Rejects with a BundleError where its code could not be loaded. */
  async show(kind: ScreenStereo): Promise<void> {
    this.kind = kind;
    if (kind === "off" || this.pictures !== null) return;
    const { ScreenPictures } = await import("./screen_stereo").catch(notLoaded);
    this.pictures ??= new ScreenPictures(this.renderer);
  }

  /** The eyes before the screen, which look at `focus`: two, where it shows stereo. */
  follow(eyes: Eyes, camera: PerspectiveCamera, focus: Vector3, pupils_m: number): void {
    const { pictures, kind } = this;
    if (pictures === null || kind === "off") eyes.followScreen(this.renderer, camera);
    else pictures.follow(eyes, camera, focus, pupils_m, kind);
  }

  /** Draw a frame, of which an anaglyph is made where it is wanted. */
  present(draw: () => void): void {
    if (this.kind === "anaglyph" && this.pictures !== null) this.pictures.present(draw);
    else draw();
  }

  dispose(): void {
    this.pictures?.dispose();
  }
}
