/** Runs in the page: marks on a specimen of the test, seen by a camera of the test. */
import {
  BoxGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  HemisphereLight,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Quaternion,
  Scene,
  SphereGeometry,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { Marks } from "../../../src/annotations/annotations";
import { listenForHandles } from "../../../src/annotations/handle_pointer";
import type { DecodeAnswer, DecodeRequest } from "../../../src/bundle/decode";
import type { Manifest } from "../../../src/bundle/generated/bundle";
import { labelBoxes } from "../../../src/capture/label_boxes";
import { gazeOf, type Hit } from "../../../src/interaction/ray_pointer";
import { rayAhead, rayUnder } from "../../../src/interaction/rays";
import { eyeViewOf } from "../../../src/marks/eye_view";
import type { Label } from "../../../src/marks/label";
import type { Vec3 } from "../../../src/math/vec3";
import { Reading } from "../../../src/probe/probe_reader";
import { Specimen } from "../../../src/render/specimen_pose";
import type { Action } from "../../../src/state/actions";
import { initialState } from "../../../src/state/initial_state";
import type { LevelSource, ShownSurface } from "../../../src/state/on_screen";
import { reduce } from "../../../src/state/reduce";

const FILE = { path: "x", bytes: 0, sha256: "" };

export const BOUNDS: Manifest["specimen"]["bounds_um"] = { min: [0, -400, 0], max: [1000, 0, 200] };

const MANIFEST: Manifest = {
  format: "stereocell-bundle",
  version: 1,
  generator: "test",
  specimen: { name: "test", modality: "", bounds_um: BOUNDS },
  tiles: [
    { id: "r0_c0", representation: "mesh", bounds_um: { min: [0, -400, 0], max: [500, 0, 200] } },
    {
      id: "r0_c1",
      representation: "mesh",
      bounds_um: { min: [500, -400, 0], max: [1000, 0, 200] },
    },
  ],
  channels: [
    {
      id: "CD8",
      name: "CD8 T cells",
      color: [0.1, 0.5, 0.3],
      window: [0, 65535],
      iso_value: null,
      iso_normalized: null,
      threshold_normalized: null,
      surface: "clear",
      surface_reason: "",
      level: null,
      transfer_function: "linear",
      transfer_functions: ["linear"],
      transfer_functions_2d: { names: [], file: FILE },
      lut: FILE,
      tileset: FILE,
      triangles: [1],
      volumes: FILE,
    },
  ],
  files: FILE,
};

/** All its texels are TEXEL. */
const VOLUME: LevelSource = {
  volume: {
    tile: "r0_c1",
    file: FILE,
    bricks: FILE,
    size: [8, 8, 8],
    apron: 1,
    bounds_um: { min: [500, -400, 0], max: [1000, 0, 200] },
    matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    levels: [{ size: [8, 8, 8], offset: 0, length: 1, sha256: "" }],
  },
  has: () => true,
  level: async () => new Uint8Array(1),
};
const TEXEL = 51;

/** Replaces the worker that decompresses, which cannot start in a page without an address. */
class DecodingWorker extends EventTarget {
  postMessage({ id, bytes }: DecodeRequest): void {
    const data: DecodeAnswer = { id, texels: new Uint8Array(bytes).fill(TEXEL) };
    queueMicrotask(() => this.dispatchEvent(new MessageEvent("message", { data })));
  }
}
Object.assign(window, { Worker: DecodingWorker });

type Place = Readonly<{ x: number; y: number }>;
type View = Readonly<{
  position: Vec3;
  target: Vec3;
  isStereo?: boolean;
  isPanelOpen?: boolean;
  /** Whether the user is in augmented reality, where the bar is not below the specimen. */
  isInUsersRoom?: boolean;
  dt_s?: number;
}>;

class Bench {
  private readonly renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(40, 1, 0.01, 20);
  private readonly specimen = new Specimen(BOUNDS);
  private readonly focus = new Vector3();
  private readonly reading: Reading;
  private readonly marks: Marks;
  private view: View = { position: [0, 0, 2], target: [0, 0, 0] };
  state = initialState(MANIFEST);
  announced = "";
  /** Number of pointer events that would have turned the camera. */
  leaked = 0;
  /** Whether the list of volumes has been loaded; it is loaded on demand. */
  private isKnown = false;

  constructor(
    private readonly stage: HTMLElement,
    sides?: Manifest["specimen"]["sides"],
  ) {
    const { clientWidth, clientHeight } = stage;
    const canvas = this.renderer.domElement;
    this.renderer.setSize(clientWidth, clientHeight);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.scene.background = new Color(0x0b0d12);
    const lamp = new DirectionalLight(0xffffff, 2);
    lamp.position.set(-1, 2, 2);
    this.scene.add(this.specimen.group, lamp, new HemisphereLight(0xe8eefc, 0x2a2c33, 0.9));
    const surfaces = this.addSurfaces();
    const dispatch = (action: Action) => {
      this.state = reduce(this.state, action);
      this.reading.state = this.state;
      this.marks.sync(this.state);
      this.draw();
    };
    const manifest = { ...MANIFEST, specimen: { ...MANIFEST.specimen, sides } };
    const reading = {
      manifest,
      base: location.href,
      values: null,
      surfaces: () => surfaces,
      volumes: () => [],
      source: (tile: string) => (this.isKnown && tile === "r0_c1" ? VOLUME : null),
      sourceOf: async (tile: string) => {
        this.isKnown = true;
        return tile === "r0_c1" ? VOLUME : null;
      },
      onError: (error: unknown) => {
        throw error;
      },
    };
    this.reading = new Reading(reading, this.state);
    const options = {
      manifest,
      reading: this.reading,
      surfaces: () => surfaces,
      dispatch,
      announce: (text: string) => {
        this.announced = text;
      },
      onChange: () => this.draw(),
    };
    this.marks = new Marks(options, this.state);
    this.specimen.group.add(this.marks.group);
    stage.append(canvas, ...this.marks.overlayElements);
    const rayAt = (point: Parameters<typeof rayUnder>[0]) =>
      rayUnder(point, this.camera, this.specimen.group);
    listenForHandles(
      stage,
      canvas,
      {
        pick: (point, pointing) => this.marks.pick(rayAt(point), pointing),
        drag: (id, point) => this.marks.drag(id, rayAt(point)),
        highlight: (id) => this.marks.highlight(id),
      },
      new AbortController().signal,
    );
    canvas.addEventListener("pointerdown", () => this.leaked++);
  }

  /** Number of objects on the GPU. */
  get held(): Readonly<{ geometries: number; textures: number }> {
    const { geometries, textures } = this.renderer.info.memory;
    return { geometries, textures };
  }

  dispatch(action: Action): void {
    this.state = reduce(this.state, action);
    this.reading.state = this.state;
    this.marks.sync(this.state);
    this.draw();
  }

  look(view: View): void {
    this.view = view;
    this.draw();
  }

  turn(axis: Vec3, angle_rad: number): void {
    const orientation = new Quaternion().setFromAxisAngle(new Vector3(...axis), angle_rad);
    this.specimen.moveTo({ ...this.specimen.pose, orientation }, this.camera.position);
    this.draw();
  }

  private draw(): void {
    const { camera, specimen, view } = this;
    camera.position.set(...view.position);
    camera.lookAt(this.focus.set(...view.target));
    camera.updateMatrixWorld();
    const screen = { camera, height_px: this.stage.clientHeight, focus: this.focus };
    const shown = view.isStereo ? null : screen;
    this.reading.specimen = specimen.group.matrixWorld;
    this.marks.update({
      head: camera.matrixWorld,
      specimen: specimen.group.matrixWorld,
      screen: shown,
      eyeView: eyeViewOf(camera.matrixWorld, specimen.group.matrixWorld, shown),
      gaze: rayAhead(camera.matrixWorld, specimen.group),
      disc: null,
      isPanelOpen: view.isPanelOpen ?? false,
      isBarBelow: view.isStereo === true && view.isInUsersRoom !== true,
      dt_s: view.dt_s ?? 0,
    });
    this.renderer.render(this.scene, camera);
  }

  /** Returns the place of a point (um) on the page, in CSS pixels of the stage. */
  project(point: Vec3): Place {
    const room = new Vector3(...point).applyMatrix4(this.specimen.group.matrixWorld);
    return this.projectScene(room);
  }

  private projectScene(room: Vector3): Place {
    const { x, y } = room.clone().project(this.camera);
    const { clientWidth, clientHeight } = this.stage;
    return { x: ((x + 1) / 2) * clientWidth, y: ((1 - y) / 2) * clientHeight };
  }

  /**
   * Returns the text of the scale bar, its width in pixels, and the width of the same length of the
   * specimen at the focus.
   */
  scale() {
    const bar = this.marks.scaleBar.root;
    const text = bar.textContent ?? "";
    const [value, unit] = text.split(" ");
    const length_um = Number(value) * (unit === "mm" ? 1000 : unit === "nm" ? 1e-3 : 1);
    const shown_px = bar.querySelector(".bar")?.getBoundingClientRect().width ?? 0;
    const half = new Vector3(1, 0, 0)
      .transformDirection(this.camera.matrixWorld)
      .multiplyScalar((length_um * this.specimen.scale) / 2);
    const [a, b] = [half, half.clone().negate()].map((by) =>
      this.projectScene(this.focus.clone().add(by)),
    );
    return { text, shown_px, true_px: Math.hypot(a.x - b.x, a.y - b.y) };
  }

  /** Returns the visual angle of the distance's label, its text, and how often it was drawn. */
  label() {
    const { distance } = this.marks.measured;
    return { angle_rad: this.angleOf(distance), text: distance.text, draws: distance.draws };
  }

  /** Returns the places of the labels of measurements in the view, in pixels. */
  labelBoxes() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    return labelBoxes(this.marks.measured.group, this.camera, { width, height });
  }

  private angleOf({ sprite }: Label): number {
    const eye = this.camera.position;
    const middle = new Vector3().setFromMatrixPosition(sprite.matrixWorld);
    const height_m = sprite.scale.y * this.specimen.scale;
    return 2 * Math.atan(height_m / 2 / middle.distanceTo(eye));
  }

  /** Returns the text at a measured point. */
  valuesAt(index: number): string {
    return this.marks.measured.valuesAt(index);
  }

  measure(points: readonly Vec3[]): void {
    this.dispatch({ type: "measure", points });
  }

  async measureAt(x: number, y: number): Promise<readonly Vec3[]> {
    const { clientWidth, clientHeight } = this.stage;
    const at = { x: (x / clientWidth) * 2 - 1, y: 1 - (y / clientHeight) * 2 };
    await this.marks.measure(rayUnder(new Vector2(at.x, at.y), this.camera, this.specimen.group));
    return this.state.measured;
  }

  /** Returns the handle that the gaze hits straight ahead; null: none. */
  meet(): Hit | null {
    return this.marks.target.intersect(gazeOf(this.camera.matrixWorld));
  }

  /** Drags a handle to the present direction of the gaze. */
  carry(key: string): void {
    this.marks.target.drag(key, gazeOf(this.camera.matrixWorld));
  }

  /** `up_um` is the height of the ruler's middle. */
  ruler(): { length_um: number; up_um: number; isVisible: boolean; hasAxes: boolean } {
    const { ruler, axes } = this.marks;
    const { length_um, group } = ruler;
    const up_um = group.children[0].position.y;
    return { length_um, up_um, isVisible: group.visible, hasAxes: axes.group.visible };
  }

  name(): string {
    return this.marks.name.root.hidden ? "" : this.marks.name.text;
  }

  private addSurfaces(): ShownSurface[] {
    return MANIFEST.tiles.flatMap((tile) => {
      const { min, max } = tile.bounds_um;
      const middle = min.map((v, i) => (v + max[i]) / 2);
      const material = new MeshStandardMaterial({ color: 0x2f8f6a, side: DoubleSide });
      const ball = new Mesh(new SphereGeometry(90, 64, 32), material);
      ball.position.set(middle[0], middle[1], middle[2]);
      const frame = new Mesh(
        new BoxGeometry(...max.map((v, i) => v - min[i])),
        new MeshStandardMaterial({ color: 0x445566, wireframe: true }),
      );
      frame.position.copy(ball.position);
      this.specimen.group.add(ball, frame);
      this.specimen.group.updateMatrixWorld(true);
      return [{ mesh: ball, tile: tile.id, channel: "CD8" }];
    });
  }

  /** Number of objects on the GPU. */
  memory(): { geometries: number; textures: number } {
    const { geometries, textures } = this.renderer.info.memory;
    return { geometries, textures };
  }

  dispose(): void {
    this.marks.dispose();
  }
}

declare global {
  interface Window {
    bench?: Bench;
    makeBench?: (stage: HTMLElement, sides?: Manifest["specimen"]["sides"]) => Bench;
  }
}
window.makeBench = (stage, sides) => new Bench(stage, sides);
