/** Runs in the page: a scene with known points, seen through a SplitSession. */
import {
  BackSide,
  BoxGeometry,
  CanvasTexture,
  Color,
  Mesh,
  MeshBasicMaterial,
  NearestFilter,
  Scene,
  SphereGeometry,
  SRGBColorSpace,
  WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import { EncodePass } from "../../../src/gpu/encode_pass";
import { linearTarget } from "../../../src/gpu/linear_target";
import { SplitSession } from "../../../src/xr/cardboard/split_session";
import { askInTap } from "../../../src/xr/cardboard/user_gesture";
import { BUILT_IN, parseProfile } from "../../../src/xr/cardboard/viewer_profile";

/** Pixels per inch of an iPhone with pixel ratio 3; the page would use those of the desktop. */
export const PIXELS_PER_INCH = 153.3;

/** Place of the mark in an image, in pixels from its lower left corner. */
export type Spot = Readonly<{ x: number; y: number; pixels: number }>;

type At = readonly [x_m: number, y_m: number, z_m: number];

class Stand {
  readonly log: string[] = [];
  private readonly renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  private readonly scene = new Scene();
  private readonly mark = new Mesh(
    new SphereGeometry(1, 24, 16),
    new MeshBasicMaterial({ color: "#00ff00" }),
  );
  private readonly room = new Mesh(
    new BoxGeometry(4, 4, 4),
    new MeshBasicMaterial({ map: checkerboard(), side: BackSide }),
  );
  private readonly split: SplitSession;
  private readonly light: WebGLRenderTarget;
  private readonly encode = new EncodePass();

  constructor(stage: HTMLElement) {
    stage.append(this.renderer.domElement);
    const fit = () => this.renderer.setSize(stage.clientWidth, stage.clientHeight);
    new ResizeObserver(fit).observe(stage);
    fit();
    this.light = linearTarget(this.renderer, { hasDepth: true, isMultisampled: true });
    this.scene.background = new Color("#123456");
    this.scene.add(this.mark, this.room);
    this.split = new SplitSession(
      this.renderer,
      () => this.log.push("start"),
      () => this.log.push("end"),
      ({ kind }) => this.log.push(kind),
      { cssPixelsPerInch: PIXELS_PER_INCH },
    );
  }

  /** @param viewer name of a built-in profile, or a code */
  async start(viewer: string): Promise<string> {
    const profile = viewer === "v1" || viewer === "v2" ? BUILT_IN[viewer] : parseProfile(viewer);
    try {
      const asked = askInTap(this.renderer.domElement, () => this.split.end());
      await this.split.start(profile, asked);
      return "started";
    } catch (error) {
      return String(error);
    }
  }

  end(): void {
    this.split.end();
  }

  status() {
    const { isRunning, problems } = this.split;
    const { geometries, textures } = this.renderer.info.memory;
    return { isRunning, problems, log: this.log, geometries, textures };
  }

  /** Returns the mark in each eye's undistorted image: left, then right, from the corner of its viewport. */
  lookAt(at: At, radius_m: number): Spot[] {
    this.draw(at, radius_m, false);
    return this.split.eyes.map(({ viewport: { x, y, z, w } }) => {
      const rgba = new Uint8Array(4 * z * w);
      this.renderer.readRenderTargetPixels(this.split.target, x, y, z, w, rgba);
      return findMark(rgba, z);
    });
  }

  /**
   * Returns the mark on the canvas, in its left and its right half; x is from the left edge of the
   * canvas.
   */
  lookThroughLens(at: At, radius_m: number): Spot[] {
    this.draw(at, radius_m, false);
    this.split.present();
    const gl = this.renderer.getContext();
    const { width, height } = this.renderer.domElement;
    return [0, width / 2].map((left) => {
      const rgba = new Uint8Array(4 * (width / 2) * height);
      gl.readPixels(left, 0, width / 2, height, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
      const spot = findMark(rgba, width / 2);
      return { ...spot, x: spot.x + left };
    });
  }

  /** Returns colours of the canvas, with the mark outside the view. */
  colorsAt(points: readonly (readonly [number, number])[], hasRoom: boolean): number[][] {
    this.draw([0, 0, 5], 0.01, hasRoom);
    this.split.present();
    const gl = this.renderer.getContext();
    return points.map(([x, y]) => {
      const rgba = new Uint8Array(4);
      gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
      return [...rgba];
    });
  }

  private draw(at: At, radius_m: number, hasRoom: boolean): void {
    this.room.visible = hasRoom;
    this.mark.position.set(...at);
    this.mark.scale.setScalar(radius_m);
    this.split.update();
    const { width, height } = this.split.target;
    this.light.setSize(width, height);
    this.renderer.setRenderTarget(this.light);
    this.renderer.render(this.scene, this.split.camera);
    this.encode.render(this.renderer, this.light, this.split.target);
    this.renderer.setRenderTarget(null);
  }
}

/** Returns the centre of the green pixels. */
function findMark(rgba: Uint8Array, width: number): Spot {
  let [x, y, pixels] = [0, 0, 0];
  for (let i = 0; i < rgba.length / 4; i++) {
    // pixels at an edge count by their share, because the frame is anti-aliased
    const share = Math.max(0, (rgba[4 * i + 1] - 0x34) / (255 - 0x34));
    if (share < 0.3 || rgba[4 * i] > 0x20) continue;
    x += share * ((i % width) + 0.5);
    y += share * (Math.floor(i / width) + 0.5);
    pixels += share;
  }
  return { x: x / pixels, y: y / pixels, pixels };
}

function checkerboard(): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 8;
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("no 2D canvas");
  for (let i = 0; i < 64; i++) {
    context.fillStyle = (i + Math.floor(i / 8)) % 2 === 0 ? "#e8e4d8" : "#30405a";
    context.fillRect(i % 8, Math.floor(i / 8), 1, 1);
  }
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = NearestFilter;
  return texture;
}

declare global {
  interface Window {
    stand: Stand;
    started: Promise<string>;
  }
}

const stage = document.querySelector<HTMLElement>("#stage");
if (stage === null) throw new Error("the page has no stage");
window.stand = new Stand(stage);
document.querySelector("button")?.addEventListener("click", ({ currentTarget }) => {
  if (!(currentTarget instanceof HTMLButtonElement)) return;
  window.started = window.stand.start(currentTarget.value);
});
