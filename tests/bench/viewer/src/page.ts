/** Functions that the driver calls in a page with one renderer. */
import { fetchScene, type Renderer } from "./scene";

export type Bench = Readonly<{
  setup(scene: string, camera: string, setting: number): Promise<void>;
  /** Mean milliseconds of a picture, over `frames` of them. */
  time(frames: number): number;
  /** RGBA, bottom row first, base64. */
  picture(): string;
  countSteps(): number | null;
}>;

declare global {
  interface Window {
    bench?: Bench;
  }
}

export function serve(make: () => Renderer): void {
  let renderer: Renderer | null = null;
  let pixels = new Uint8Array();
  let size: readonly [number, number] = [0, 0];

  const read = (): Renderer => {
    if (renderer === null) throw new Error("time before setup");
    renderer.draw();
    const { gl } = renderer;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, size[0], size[1], gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return renderer;
  };

  window.bench = {
    async setup(name, camera, setting) {
      document.body.replaceChildren();
      const scene = await fetchScene(name);
      size = scene.about.size_px;
      pixels = new Uint8Array(4 * size[0] * size[1]);
      const parent = document.createElement("div");
      parent.style.width = `${size[0]}px`;
      parent.style.height = `${size[1]}px`;
      document.body.append(parent);
      renderer = make();
      await renderer.setup(scene, scene.about.cameras[camera], setting, parent);
      const { drawingBufferWidth: w, drawingBufferHeight: h } = renderer.gl;
      if (w !== size[0] || h !== size[1]) {
        throw new Error(`expected ${size[0]} x ${size[1]} pixels, found ${w} x ${h}`);
      }
      read();
    },
    time(frames) {
      const start = performance.now();
      for (let i = 0; i < frames; i++) read();
      return (performance.now() - start) / frames;
    },
    picture() {
      read();
      let text = "";
      for (let i = 0; i < pixels.length; i += 4096) {
        text += String.fromCharCode(...pixels.subarray(i, i + 4096));
      }
      return btoa(text);
    },
    countSteps: () => renderer?.countSteps?.() ?? null,
  };
}
