/**
 * NiiVue: volume rendering with the defaults of its API. There is no setting; a step is a voxel.
 *
 * These differences can't be changed by options. Projection is parallel. Colour and opacity are
 * looked up at the voxels and then interpolated. Opacities below 0.01 are ignored. Rays start at
 * random within a step, end at an opacity of 0.95, and are then scaled to 1. The picture is
 * premultiplied but blended as if it were not, which darkens translucent parts.
 */
import { Niivue, NVImage, SLICE_TYPE } from "@niivue/niivue";
import { serve } from "./page";
import { type Camera, type Renderer, type Scene, shownColor, upright } from "./scene";

class NiiVue implements Renderer {
  private readonly niivue = new Niivue({
    backColor: [0, 0, 0, 1],
    show3Dcrosshair: false,
    crosshairWidth: 0,
    isOrientationTextVisible: false,
    isOrientCube: false,
    loadingText: "",
    logLevel: "error",
    sliceType: SLICE_TYPE.RENDER,
  });

  get gl(): WebGL2RenderingContext {
    return this.niivue.gl;
  }

  async setup(scene: Scene, camera: Camera, _: number, parent: HTMLElement): Promise<void> {
    if (camera.half_height_um === null) throw new Error("NiiVue's projection is parallel");
    const { about } = scene;
    const canvas = document.createElement("canvas");
    parent.append(canvas);
    await this.niivue.attachToCanvas(canvas, false);
    const shown = shownColor(about).map((v) => Math.round(255 * v));
    const entries = Array.from({ length: 256 }, (_entry, i) => i);
    this.niivue.addColormap("bench", {
      R: entries.map(() => shown[0]),
      G: entries.map(() => shown[1]),
      B: entries.map(() => shown[2]),
      A: entries.map((i) => about.table[4 * i + 3]),
      I: entries,
    });
    const file = NVImage.createNiftiArray(...standing(scene));
    await this.niivue.loadFromArrayBuffer(file.buffer as ArrayBuffer, "bench.nii");
    const [image] = this.niivue.volumes;
    image.colormap = "bench";
    image.cal_min = 0;
    image.cal_max = 255;
    this.niivue.updateGLVolume();
    const [x, y, z] = camera.eye_um.map((v, i) => v - camera.target_um[i]);
    const away = Math.hypot(x, y, z);
    const degrees = 180 / Math.PI;
    this.niivue.setRenderAzimuthElevation(
      Math.atan2(-x, z) * degrees,
      Math.asin(y / away) * degrees,
    );
    this.niivue.setPivot3D();
    this.niivue.setScale((0.8 * this.niivue.furthestFromPivot) / camera.half_height_um);
  }

  draw(): void {
    this.niivue.drawScene();
  }
}

/** Make a NIfTI file in memory: right is x, front is -z, up is y. */
function standing(scene: Scene): [number[], number[], number[], number, Uint8Array] {
  const [nx, ny, nz] = scene.about.size;
  const [hx, hy, hz] = scene.about.spacing_um;
  const voxels = upright(scene);
  const turned = new Uint8Array(voxels.length);
  for (let z = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) {
      const from = (z * ny + y) * nx;
      turned.set(voxels.subarray(from, from + nx), (y * nz + nz - 1 - z) * nx);
    }
  }
  const matrix = [hx, 0, 0, 0, 0, hz, 0, 0, 0, 0, hy, 0, 0, 0, 0, 1];
  return [[nx, nz, ny], [hx, hz, hy], matrix, 2, turned];
}

serve(() => new NiiVue());
