/**
 * three's own example: `VolumeRenderShader1` of its package. Setting: step in voxels. 0 leaves the
 * shader unchanged, which shows the largest value along the ray and not the transfer function.
 *
 * The example has no blending by opacity. The plainest such loop therefore replaces the body of its
 * `cast_mip`. It looks up one value per step, front to back, to the end of the ray. Ray, steps and tables are
 * unchanged. Opacities in the table are those of a step.
 */
import {
  BackSide,
  BoxGeometry,
  Data3DTexture,
  DataTexture,
  DataUtils,
  HalfFloatType,
  LinearFilter,
  Mesh,
  OrthographicCamera,
  PerspectiveCamera,
  RedFormat,
  RGBAFormat,
  Scene as Room,
  ShaderMaterial,
  UniformsUtils,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { VolumeRenderShader1 } from "three/addons/shaders/VolumeShader.js";
import { serve } from "./page";
import { type Camera, type Renderer, type Scene, shownColor, upright } from "./scene";

const HEAD = "void cast_mip(vec3 start_loc, vec3 step, int nsteps, vec3 view_ray)";
const BLENDING = `${HEAD} {
  vec4 sum = vec4(0.0);
  vec3 loc = start_loc;
  for (int iter = 0; iter < MAX_STEPS; iter++) {
    if (iter >= nsteps) break;
    vec4 s = apply_colormap(sample1(loc));
    sum += (1.0 - sum.a) * vec4(s.rgb * s.a, s.a);
    loc += step;
  }
  gl_FragColor = sum;
}
`;

/** Return the example's shader with another body of cast_mip, and the given step. */
function blending(step: number): string {
  const text = VolumeRenderShader1.fragmentShader;
  const from = text.indexOf(`${HEAD} {`);
  const to = text.indexOf("void cast_iso(", from);
  const stepLine = "relative_step_size = 1.0";
  const discards = "gl_FragColor.a < 0.05";
  if (from < 0 || to < 0 || !text.includes(stepLine) || !text.includes(discards)) {
    throw new Error("three's VolumeRenderShader1 is not the one that this was written for");
  }
  return (text.slice(0, from) + BLENDING + text.slice(to))
    .replace(stepLine, `relative_step_size = ${step.toFixed(4)}`)
    .replace(discards, "gl_FragColor.a <= 0.0");
}

class Three implements Renderer {
  private readonly renderer = new WebGLRenderer({ antialias: false });
  private readonly room = new Room();
  private camera: PerspectiveCamera | OrthographicCamera | null = null;

  get gl(): WebGL2RenderingContext {
    return this.renderer.getContext() as WebGL2RenderingContext;
  }

  async setup(scene: Scene, camera: Camera, setting: number, parent: HTMLElement): Promise<void> {
    const { about } = scene;
    const [nx, ny, nz] = about.size;
    const volume = new Data3DTexture(upright(scene), nx, ny, nz);
    volume.format = RedFormat;
    volume.minFilter = volume.magFilter = LinearFilter;
    volume.unpackAlignment = 1;
    volume.needsUpdate = true;
    const uniforms = UniformsUtils.clone(VolumeRenderShader1.uniforms);
    uniforms.u_data.value = volume;
    uniforms.u_size.value = new Vector3(nx, ny, nz);
    uniforms.u_clim.value = new Vector2(0, 1);
    uniforms.u_cmdata.value = tableOf(scene, setting || 1);
    const material = new ShaderMaterial({
      uniforms,
      vertexShader: VolumeRenderShader1.vertexShader,
      fragmentShader: setting > 0 ? blending(setting) : VolumeRenderShader1.fragmentShader,
      side: BackSide,
      transparent: true,
      premultipliedAlpha: true,
      depthTest: false,
    });
    const box = new BoxGeometry(nx, ny, nz).translate(nx / 2 - 0.5, ny / 2 - 0.5, nz / 2 - 0.5);
    const mesh = new Mesh(box, material);
    const [hx, hy, hz] = about.spacing_um;
    mesh.scale.set(hx, hy, hz);
    // Its texture coordinates are half a voxel too low: it puts voxel 0 at coordinate 0.
    mesh.position.set(-0.5 * hx, (0.5 - ny) * hy, -0.5 * hz);
    this.room.add(mesh);
    const [width, height] = about.size_px;
    this.renderer.setPixelRatio(1);
    this.renderer.setSize(width, height);
    parent.append(this.renderer.domElement);
    const far = 4 * Math.hypot(...camera.eye_um);
    const half = camera.half_height_um ?? 0;
    this.camera =
      camera.fov_deg !== null
        ? new PerspectiveCamera(camera.fov_deg, width / height, far / 100, far)
        : new OrthographicCamera(-half, half, half, -half, far / 100, far);
    this.camera.position.set(...camera.eye_um);
    this.camera.lookAt(...camera.target_um);
  }

  draw(): void {
    if (this.camera !== null) this.renderer.render(this.room, this.camera);
  }
}

/** Return colours, and opacities of a step of this many voxels, in half floats. */
function tableOf({ about }: Scene, step: number): DataTexture {
  const rgb = shownColor(about);
  const texels = new Uint16Array(1024);
  for (let i = 0; i < 256; i++) {
    const opacity = 1 - (1 - about.table[4 * i + 3] / 255) ** step;
    [...rgb, opacity].forEach((v, k) => {
      texels[4 * i + k] = DataUtils.toHalfFloat(v);
    });
  }
  const table = new DataTexture(texels, 256, 1, RGBAFormat, HalfFloatType);
  table.minFilter = table.magFilter = LinearFilter;
  table.needsUpdate = true;
  return table;
}

serve(() => new Three());
