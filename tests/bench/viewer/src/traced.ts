/** Ours with path tracing: one more sample of every pixel, with all passes that follow. */
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  Matrix4,
  PerspectiveCamera,
  RedFormat,
  Scene as Room,
  Vector3,
  Vector4,
  WebGLRenderer,
} from "three";
import { Cuts } from "viewer/gpu/clip_planes";
import { noCorner } from "viewer/gpu/clip_uniforms";
import { LAST, Overlay } from "viewer/gpu/composite_pass";
import { EncodePass } from "viewer/gpu/encode_pass";
import { Eyes } from "viewer/gpu/eyes";
import { linearTarget } from "viewer/gpu/linear_target";
import { environmentTables } from "viewer/pathtrace/environment_sampling";
import { Tracer } from "viewer/pathtrace/path_tracer";
import { DepthPass } from "viewer/render/depth_pass";
import { START_TRACE } from "viewer/state/path_trace_settings";
import { serve } from "./page";
import type { Camera, Renderer, Scene } from "./scene";

const WHITE = { width: 2, height: 1, rgb: new Float32Array(6).fill(1) };
const NO_CLIP = {
  min: new Vector3().setScalar(-1e9),
  max: new Vector3().setScalar(1e9),
  plane: new Vector4(0, 0, 0, 1),
  corner: noCorner(),
};

class Traced implements Renderer {
  private readonly renderer = new WebGLRenderer({ antialias: false });
  private readonly depth = new DepthPass(new Cuts());
  private readonly sceneDepth = { value: this.depth.texture };
  private readonly tracer = new Tracer(this.sceneDepth);
  private readonly overlay = new Overlay(this.tracer.picture.texture, this.sceneDepth, {
    order: LAST,
    isEncoded: true,
  });
  private readonly light = linearTarget(this.renderer, { hasDepth: true, isMultisampled: true });
  private readonly encode = new EncodePass();
  private readonly eyes = new Eyes();
  private readonly camera = new PerspectiveCamera();
  private readonly room = new Room();
  private bounds: { min: [number, number, number]; max: [number, number, number] } = {
    min: [0, 0, 0],
    max: [1, 1, 1],
  };
  private settings = START_TRACE;

  get gl(): WebGL2RenderingContext {
    return this.renderer.getContext() as WebGL2RenderingContext;
  }

  /** Setting: 1 for multiple scattering, 0 for single scattering. */
  async setup(scene: Scene, camera: Camera, setting: number, parent: HTMLElement): Promise<void> {
    const { about, voxels, bricks } = scene;
    const [width, height] = about.size_px;
    this.renderer.setPixelRatio(1);
    this.renderer.setSize(width, height);
    parent.append(this.renderer.domElement);
    const texture = new Data3DTexture(voxels, ...about.size);
    texture.format = RedFormat;
    texture.minFilter = texture.magFilter = LinearFilter;
    texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
    texture.unpackAlignment = 1;
    texture.needsUpdate = true;
    const [min, max] = [about.low_um, about.high_um];
    this.bounds = { min: [...min], max: [...max] };
    this.settings = { ...START_TRACE, isMultiple: setting === 1 };
    this.tracer.fill({
      channels: ["A"],
      frame: {
        min: [...min],
        max: [...max],
        spacing_um: [...about.spacing_um],
        matrix: new Matrix4().toArray(),
        size: [...about.size],
        apron: 1,
        places: new Map(),
      },
      level: 0,
      size: [...about.size],
      texture,
      index: null,
      bricks: [bricks],
      release: () => texture.dispose(),
    });
    this.tracer.setAppearances(
      [{ color: about.color, table: Uint8Array.from(about.table) }],
      this.settings,
    );
    this.tracer.lightBy(environmentTables(WHITE));
    this.room.add(this.overlay.mesh);
    const away = Math.hypot(...camera.eye_um.map((v, i) => v - camera.target_um[i]));
    if (camera.fov_deg === null) throw new Error("the viewer has no parallel projection");
    this.camera.fov = camera.fov_deg;
    this.camera.aspect = width / height;
    this.camera.near = away / 10;
    this.camera.far = away * 4;
    this.camera.position.set(...camera.eye_um);
    this.camera.lookAt(...camera.target_um);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  draw(): void {
    this.eyes.followScreen(this.renderer, this.camera);
    this.overlay.hide();
    this.depth.render(this.renderer, this.room, this.eyes, []);
    const scene = { specimen: new Matrix4(), clip: NO_CLIP, solids: 0, bounds: this.bounds };
    this.tracer.render(this.renderer, this.eyes, scene, this.settings, {
      scale: 1,
      passes: 1,
      mayTremble: false,
      isDraft: false,
    });
    this.overlay.show(this.eyes, 1);
    this.light.setSize(this.eyes.width_px, this.eyes.height_px);
    this.renderer.setRenderTarget(this.light);
    this.renderer.render(this.room, this.camera);
    this.encode.render(this.renderer, this.light, null);
  }
}

serve(() => new Traced());
