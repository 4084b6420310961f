/** Ours: the viewer's ray march. Setting: 1 with its light, 0 without. */
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  PerspectiveCamera,
  RedFormat,
  Scene as Room,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { cellCounts, cellRanges } from "viewer/bundle/cell_ranges";
import type { TileVolume } from "viewer/bundle/generated/volumes";
import { Cuts } from "viewer/gpu/clip_planes";
import { EncodePass } from "viewer/gpu/encode_pass";
import { Eyes } from "viewer/gpu/eyes";
import { linearTarget } from "viewer/gpu/linear_target";
import { DepthPass } from "viewer/render/depth_pass";
import { MarchPass } from "viewer/render/raymarch_pass";
import { TileMarch } from "viewer/volumes/tile_raymarch";
import { occupancyDistances } from "viewer/voxels/empty_space";
import { makeFrame } from "viewer/voxels/march_frame";
import { opacities } from "viewer/voxels/transfer_luts";
import { serve } from "./page";
import type { About, Camera, Renderer, Scene } from "./scene";

class Ours implements Renderer {
  private readonly renderer = new WebGLRenderer({ antialias: false });
  private readonly depth = new DepthPass(new Cuts());
  private readonly frame = makeFrame(this.depth.texture);
  private readonly pass = new MarchPass(this.renderer, this.frame);
  /** Not multisampled, because volumes have no edges: see viewer_gltf/src/gpu/has_edges. */
  private readonly light = linearTarget(this.renderer, { hasDepth: true });
  private readonly encode = new EncodePass();
  private readonly eyes = new Eyes();
  private readonly camera = new PerspectiveCamera();
  /** The scene that is marched, and the scene of overlays, which is otherwise empty. */
  private readonly marched = new Room();
  private readonly room = new Room();
  private march: TileMarch | null = null;

  get gl(): WebGL2RenderingContext {
    return this.renderer.getContext() as WebGL2RenderingContext;
  }

  async setup(scene: Scene, camera: Camera, setting: number, parent: HTMLElement): Promise<void> {
    const [width, height] = scene.about.size_px;
    this.renderer.setPixelRatio(1);
    this.renderer.setSize(width, height);
    parent.append(this.renderer.domElement);
    this.march = marchOf(scene, this.frame);
    if (setting === 0) this.march.mesh.material.defines.UNLIT = 1;
    this.marched.add(this.march.mesh);
    this.room.add(...this.pass.overlays);
    this.aim(camera, width / height);
  }

  private aim({ eye_um, target_um, fov_deg }: Camera, aspect: number): void {
    if (fov_deg === null) throw new Error("the viewer has no parallel projection");
    const away = Math.hypot(...eye_um.map((v, i) => v - target_um[i]));
    this.camera.fov = fov_deg;
    this.camera.aspect = aspect;
    this.camera.near = away / 10;
    this.camera.far = away * 4;
    this.camera.position.set(...eye_um);
    this.camera.lookAt(...target_um);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  /** Draw all passes of the viewer for a frame with a volume. */
  draw(): void {
    this.eyes.followScreen(this.renderer, this.camera);
    this.depth.render(this.renderer, this.room, this.eyes, this.pass.overlays);
    this.pass.render(this.marched, this.eyes, 1);
    this.light.setSize(this.eyes.width_px, this.eyes.height_px);
    this.renderer.setRenderTarget(this.light);
    this.renderer.render(this.room, this.camera);
    this.encode.render(this.renderer, this.light, null);
  }

  countSteps(): number {
    if (this.march === null) throw new Error("countSteps before setup");
    const { width, height } = this.renderer.domElement;
    const { material } = this.march.mesh;
    const target = new WebGLRenderTarget(width, height);
    material.defines.COUNT_STEPS = 1;
    material.needsUpdate = true;
    this.renderer.setRenderTarget(target);
    this.renderer.setClearColor(0, 0);
    this.renderer.clear();
    this.renderer.render(this.marched, this.camera);
    const rgba = new Uint8Array(4 * width * height);
    this.renderer.readRenderTargetPixels(target, 0, 0, width, height, rgba);
    this.renderer.setRenderTarget(null);
    target.dispose();
    delete material.defines.COUNT_STEPS;
    material.needsUpdate = true;
    this.draw();
    let [steps, rays] = [0, 0];
    for (let i = 0; i < rgba.length; i += 4) {
      if (rgba[i + 3] === 0) continue;
      steps += rgba[i] + 256 * rgba[i + 1];
      rays++;
    }
    return steps / rays;
  }
}

function marchOf({ about, voxels, bricks }: Scene, frame: ReturnType<typeof makeFrame>): TileMarch {
  const volume = volumeOf(about);
  const table = Uint8Array.from(about.table);
  const texture = new Data3DTexture(voxels, ...about.size);
  texture.format = RedFormat;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  const march = new TileMarch(volume, 1, frame);
  const cells = [cellRanges(voxels, volume.size)];
  const shown = { channels: ["A"], level: 0, texture, index: null, bricks: [bricks], cells };
  const alphas = [opacities(table)];
  march.setAppearances([{ color: about.color, table, isInDisc: false }]);
  const count = cellCounts(volume.size);
  march.skips.setCells(shown, occupancyDistances({ bricks: cells, alphas, count }), volume.size);
  march.show(shown, null, 1, 1);
  return march;
}

function volumeOf(about: About): TileVolume {
  const file = { path: "", bytes: 0, sha256: "" };
  const size: TileVolume["size"] = [...about.size];
  return {
    tile: "r0_c0",
    file,
    bricks: file,
    size,
    apron: 1,
    bounds_um: { min: [...about.low_um], max: [...about.high_um] },
    matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    levels: [{ size, offset: 0, length: 1, sha256: "" }],
  };
}

serve(() => new Ours());
