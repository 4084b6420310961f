/** The canvas that the viewer draws on: its size, and its width in side-by-side stereo. */
import { WebGLRenderer } from "three";
import type { Navigation } from "../interaction/orbit_camera";
import { StageSize } from "../render/canvas_size";
import { pixelShare } from "../render/pixel_share";

/** Largest number of device pixels per CSS pixel. Phones have up to 3, but that takes twice the time of 2 and looks alike. */
const MAX_PIXEL_RATIO = 2;

export function makeRenderer(stage: HTMLElement): WebGLRenderer {
  const renderer = new WebGLRenderer({
    antialias: false, // frames are anti-aliased in a render target of their own
    depth: false,
    powerPreference: "high-performance",
  });
  renderer.info.autoReset = false;
  stage.append(renderer.domElement);
  return renderer;
}

export class CanvasFit {
  private readonly size: StageSize;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly stage: HTMLElement,
    private readonly navigation: Navigation,
    private readonly onChange: () => void,
  ) {
    this.size = new StageSize(stage, () => this.fit());
    this.fit();
  }

  /** Sets the size of the canvas to that of the stage. */
  fit(): void {
    const { renderer, stage } = this;
    if (renderer.xr.isPresenting) return;
    const { clientWidth, clientHeight } = stage;
    if (clientWidth === 0 || clientHeight === 0) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio, MAX_PIXEL_RATIO) * pixelShare());
    renderer.setSize(clientWidth, clientHeight);
    const style = getComputedStyle(stage);
    const share = (name: string) => Number.parseFloat(style.getPropertyValue(name)) / clientHeight;
    const covered = { top: share("--over-top") || 0, bottom: share("--over-bottom") || 0 };
    const pictures = stage.dataset.stereo === "side-by-side" ? 2 : 1;
    this.navigation.fit(clientWidth / pictures / clientHeight, covered);
    this.onChange();
  }

  dispose(): void {
    this.size.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }
}
