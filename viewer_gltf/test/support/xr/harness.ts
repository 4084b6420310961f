/** Runs in the page: an emulated headset, a specimen of boxes, and the hands, without a viewer. */
import { metaQuest3, XRDevice } from "iwer";
import {
  BoxGeometry,
  Color,
  HemisphereLight,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  OrthographicCamera,
  PlaneGeometry,
  Quaternion,
  Scene,
  Vector3,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { BothEyes } from "../../../src/gpu/both_eyes";
import { Cuts } from "../../../src/gpu/clip_planes";
import { keepUnclipped } from "../../../src/gpu/unclipped_material";
import type { Target } from "../../../src/interaction/ray_pointer";
import type { Ray } from "../../../src/math/vec3";
import { depthMaterial } from "../../../src/render/blend_material";
import { XR_DISTANCE_M } from "../../../src/render/placement";
import { Specimen } from "../../../src/render/specimen_pose";
import type { Action } from "../../../src/state/actions";
import { chosenTile } from "../../../src/state/chosen_tile";
import { initialState } from "../../../src/state/initial_state";
import { reduce } from "../../../src/state/reduce";
import { betweenEyes } from "../../../src/xr/head_pose";
import { Hands } from "../../../src/xr/interaction";
import { XrSession } from "../../../src/xr/session";
import { STEREO_FACTS } from "../fixture/facts";
import { sampleManifest } from "../fixture/manifest";
import { buildPanel, type Facts } from "../panel/whole_panel";

type At = readonly [number, number, number];
type Side = "left" | "right";

const FACTS: Facts = {
  ...STEREO_FACTS,
  title: "Sample",
  ranges: new Map([["c0", [100, 1120]]]),
  focusTile: null,
  frame_ms: null,
  triangles: 123_456,
};
/** Place of the handle, in front of the upper edge of the specimen. */
export const HANDLE_m: At = [0, 0.45, -1.2];
const HANDLE_RADIUS_m = 0.04;
const HEAD_m: At = [0, 1.6, 0];
const TINTS = [0x3a6ea5, 0x5b8c5a, 0x8c6a5b, 0x7a5b8c, 0x8c8a5b];

class Stand {
  readonly device = new XRDevice(metaQuest3, { stereoEnabled: true });
  readonly actions: Action[] = [];
  readonly commands: string[] = [];
  readonly chosen: { ray: Ray; tile: string }[] = [];
  state = initialState(sampleManifest(6));
  leaves = 0;
  /** Directions to which the handle was dragged. */
  readonly drags: At[] = [];
  private readonly handle: Target = {
    isOnTop: true,
    intersect: ({ origin, direction }) => {
      const toHandle = new Vector3(...HANDLE_m).sub(origin);
      const distance_m = toHandle.dot(direction);
      const beside = Math.sqrt(Math.max(0, toHandle.lengthSq() - distance_m ** 2));
      if (distance_m < 0 || beside > HANDLE_RADIUS_m) return null;
      return { key: "handle", distance_m, hold: "carry" };
    },
    choose: () => undefined,
    drag: (_key, { direction }) => this.drags.push(direction.toArray()),
  };
  /** Distance between the hands according to WebXR. */
  apart_m = Number.NaN;
  changes = 0;
  private readonly renderer = new WebGLRenderer({ antialias: true });
  private readonly scene = new Scene();
  private readonly specimen = new Specimen(sampleManifest(6).specimen.bounds_um);
  private readonly hands: Hands;
  private readonly xr: XrSession;
  /** Times of the requested frames; time advances only by these. */
  private readonly times: number[] = [];
  private waiting: (() => void) | null = null;
  private settling = 0;

  constructor(stage: HTMLElement) {
    this.device.installRuntime({ forceInstall: true });
    this.device.position.set(...HEAD_m);
    stage.append(this.renderer.domElement);
    this.renderer.setSize(stage.clientWidth, stage.clientHeight);
    this.scene.background = new Color(0x0b0d12);
    this.scene.add(new HemisphereLight(0xffffff, 0x404040, 2), this.specimen.group);
    sampleManifest(6).tiles.forEach(({ bounds_um: { min, max } }, i) => {
      const edge = (axis: 0 | 1 | 2) => 0.98 * (max[axis] - min[axis]);
      const box = new Mesh(
        new BoxGeometry(edge(0), edge(1), edge(2)),
        new MeshLambertMaterial({ color: TINTS[i % TINTS.length] }),
      );
      box.position.set((min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2);
      this.specimen.group.add(box);
    });
    this.hands = new Hands({
      xr: this.renderer.xr,
      scene: this.scene,
      specimen: this.specimen,
      tiles: sampleManifest(6).tiles,
      handles: () => [this.handle],
      buildPanel: (view) => buildPanel(this.state, FACTS, view),
      onAction: (action) => this.dispatch(action),
      onCommand: (command) => {
        this.commands.push(command);
        this.hands.run(command, this.state);
      },
      onChoose: (ray, tile) => {
        this.chosen.push({ ray, tile });
        this.dispatch(chosenTile(this.state, tile));
      },
      onLeave: () => this.leaves++,
    });
    this.xr = new XrSession(
      this.renderer,
      () => {
        this.specimen.anchorAt(new Vector3(0, 0, -XR_DISTANCE_M));
        this.hands.start(this.xr.current);
      },
      () => this.hands.stop(),
    );
    this.renderer.setAnimationLoop(() => this.frame());
  }

  async start(): Promise<void> {
    if (navigator.xr === undefined) throw new Error("no headset");
    await this.xr.start(navigator.xr);
    await this.step([0, 0]);
  }

  end(): Promise<void> {
    return this.xr.end();
  }

  /** Draws a frame for each time, and one more without a step, so that presses have arrived. */
  step(times_s: readonly number[]): Promise<void> {
    this.times.push(...times_s, 0);
    return new Promise((resolve) => {
      this.waiting = resolve;
    });
  }

  /** Looks from the head at a point of the scene. */
  lookAt(at: At): Promise<void> {
    const { quaternion } = this.device;
    const q = facing(new Vector3(...at));
    quaternion.set(q.x, q.y, q.z, q.w);
    return this.step([0]);
  }

  /**
   * Looks at a control of the panel, or away from everything (null), for some seconds. The frames
   * of 0.1 s are not drawn: only the gaze of a head without a session is tested.
   */
  gazeFor(id: string | null, seconds: number): void {
    const at = id === null ? new Vector3(0, 5, -1) : new Vector3(...this.controlAt(id));
    const head = new Matrix4().makeRotationFromQuaternion(facing(at));
    for (let k = 0; k <= Math.round(10 * seconds); k++) {
      this.hands.update(k === 0 ? 0 : 0.1, head, this.state);
    }
  }

  /** Puts a controller at a point of the scene, pointing at another point. */
  point(side: Side, from: At, at: At): Promise<void> {
    const controller = this.device.controllers[side];
    if (controller === undefined) throw new Error("no controller");
    const [x, y, z] = from.map((v, i) => v + HEAD_m[i]);
    controller.position.set(x, y, z);
    const q = facing(new Vector3(...at).sub(new Vector3(...from)));
    controller.quaternion.set(q.x, q.y, q.z, q.w);
    return this.step([0]);
  }

  /** Turns the right controller into one with only a trigger. */
  useRemote(): void {
    const profiles = this.device.controllers.right?.inputSource.profiles;
    profiles?.splice(0, profiles.length, "oculus-go", "generic-trigger-touchpad");
  }

  connect(side: Side, isConnected: boolean): Promise<void> {
    const controller = this.device.controllers[side];
    if (controller === undefined) throw new Error("no controller");
    controller.connected = isConnected;
    return this.step([0, 0]);
  }

  button(side: Side, id: "trigger" | "squeeze", value: number): Promise<void> {
    this.device.controllers[side]?.updateButtonValue(id, value);
    return this.step([0, 0]);
  }

  /** Vertical field of view of an eye, degrees. */
  set fieldOfView_deg(degrees: number) {
    this.device.fovy = (degrees * Math.PI) / 180;
  }

  stick(side: Side, x: number, y: number): void {
    this.device.controllers[side]?.updateAxes("thumbstick", x, y);
  }

  /** Returns the middle of a tile's front face in the scene. */
  tileAt(id: string): At {
    const tile = sampleManifest(6).tiles.find((each) => each.id === id);
    if (tile === undefined) throw new Error(`no tile ${id}`);
    const { min, max } = tile.bounds_um;
    const front = new Vector3((min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]);
    return front.applyMatrix4(this.specimen.group.matrixWorld).toArray();
  }

  /** Returns the place of a control of the panel in the scene. */
  controlAt(id: string, across?: number, down?: number): At {
    const point = this.hands.panel.pointOf(id, across, down);
    if (point === null) {
      throw new Error(`no ${id} among ${this.hands.panel.regions.map((region) => region.id)}`);
    }
    return point.toArray();
  }

  announce(text: string): Promise<void> {
    this.hands.announce(text);
    return this.step([0]);
  }

  /** Returns the direction of the notice's middle relative to straight ahead, degrees to the right and up. */
  noticeAt(): readonly [number, number] {
    const { mesh } = this.hands.notice;
    const head = betweenEyes(this.renderer.xr.getCamera().cameras).invert();
    const at = mesh.getWorldPosition(new Vector3()).applyMatrix4(head);
    const degrees = (radians: number) => (radians * 180) / Math.PI;
    return [degrees(Math.atan2(at.x, -at.z)), degrees(Math.atan2(at.y, Math.hypot(at.x, at.z)))];
  }

  /**
   * Returns the direction of the panel's middle: right of the head's heading, and above its level,
   * degrees.
   */
  panelAt(): readonly [number, number] {
    const head = betweenEyes(this.renderer.xr.getCamera().cameras);
    const eye = new Vector3().setFromMatrixPosition(head);
    const at = this.hands.panel.quad.mesh.getWorldPosition(new Vector3()).sub(eye);
    const ahead = new Vector3(0, 0, -1).transformDirection(head);
    const turn = Math.atan2(at.x, -at.z) - Math.atan2(ahead.x, -ahead.z);
    const up = Math.atan2(at.y, Math.hypot(at.x, at.z));
    const degrees = (radians: number) => (radians * 180) / Math.PI;
    return [degrees(Math.atan2(Math.sin(turn), Math.cos(turn))), degrees(up)];
  }

  tap(): Promise<void> {
    this.hands.tap();
    return this.step([0]);
  }

  dispatch(action: Action): void {
    this.actions.push(action);
    this.state = reduce(this.state, action);
  }

  status() {
    const { panel, pointed, progress, ring } = this.hands;
    const { position, scale } = this.specimen.pose;
    return {
      pointed,
      progress,
      isRingShown: ring.isShown,
      isOpen: panel.isOpen,
      paints: panel.quad.paints,
      position: position.toArray(),
      scale,
      regions: panel.regions.map(({ id }) => id),
      labels: panel.regions.map(({ label }) => label),
      drags: this.drags.length,
      notices: this.hands.notice.mesh.visible ? this.hands.notice.texts : [],
      textures: this.renderer.info.memory.textures,
      geometries: this.renderer.info.memory.geometries,
    };
  }

  dispose(): void {
    this.hands.dispose();
  }

  private measureHands(): number {
    const space = this.renderer.xr.getReferenceSpace();
    const at = [...(this.xr.current?.inputSources ?? [])].flatMap(({ gripSpace }) => {
      const pose = gripSpace && space && this.renderer.xr.getFrame().getPose(gripSpace, space);
      return pose ? [pose.transform.position] : [];
    });
    const [left, right] = at.map(({ x, y, z }) => new Vector3(x, y, z));
    return right === undefined ? Number.NaN : left.distanceTo(right);
  }

  private frame(): void {
    if (!this.xr.isRunning || !this.renderer.xr.isPresenting) return;
    const dt_s = this.times.shift();
    this.renderer.xr.updateCamera(this.xr.camera);
    const head = betweenEyes(this.renderer.xr.getCamera().cameras);
    if (this.hands.update(dt_s ?? 0, head, this.state)) this.changes++;
    this.renderer.render(this.scene, this.xr.camera);
    this.apart_m = this.measureHands();
    if (this.times.length > 0 || this.waiting === null) return;
    this.settling++;
    if (this.settling < 2) return; // a press is detected in the frame after it was set
    this.settling = 0;
    const resolve = this.waiting;
    this.waiting = null;
    resolve();
  }
}

/**
 * Draws two rectangles side by side with a material whose clip plane removes everything. Only the
 * left one is exempt, because it is not part of the specimen. Returns for both orders of drawing
 * the share of the left half's pixels that are drawn, and the number of pixels drawn on the right.
 */
function leftOfTheUncut(): readonly (readonly [number, number])[] {
  const renderer = new WebGLRenderer();
  const side_px = 16;
  renderer.setSize(side_px, side_px, false);
  const cuts = new Cuts();
  cuts.sync({ box: null, plane: { normal: [0, 0, 1], offset_um: -1e6 } }, new Matrix4());
  const both = new BothEyes();
  const { uCuts, uCutCount } = cuts;
  const material = depthMaterial({ uCuts, uCutCount, ...both.uniforms }, both);
  material.colorWrite = true; // the material writes zeros
  const scene = new Scene();
  scene.overrideMaterial = material;
  const planes = [-0.5, 0.5].map((x) => {
    const plane = new Mesh(new PlaneGeometry(1, 2));
    plane.position.set(x, 0, -0.5);
    scene.add(plane);
    return plane;
  });
  keepUnclipped(planes[0]);
  const target = new WebGLRenderTarget(side_px, side_px);
  const rgba = new Uint8Array(4 * side_px ** 2);
  const counts = [0, 1].map((first) => {
    planes[first].renderOrder = -1;
    planes[1 - first].renderOrder = 1;
    renderer.setRenderTarget(target);
    renderer.setClearColor(0xff0000, 1);
    renderer.clear();
    renderer.render(scene, new OrthographicCamera(-1, 1, 1, -1, 0, 2));
    renderer.readRenderTargetPixels(target, 0, 0, side_px, side_px, rgba);
    const isDrawn = (i: number) => rgba[4 * i] === 0;
    const all = Array.from({ length: side_px ** 2 }, (_, i) => i).filter(isDrawn);
    const left = all.filter((i) => i % side_px < side_px / 2).length;
    return [left / (side_px ** 2 / 2), all.length - left] as const;
  });
  renderer.dispose();
  return counts;
}

/** Returns the rotation of an upright head that looks along a direction. */
function facing(direction: Vector3): Quaternion {
  const turn = new Matrix4().lookAt(new Vector3(), direction, new Vector3(0, 1, 0));
  return new Quaternion().setFromRotationMatrix(turn);
}

declare global {
  interface Window {
    hands: Stand;
    leftOfTheUncut: typeof leftOfTheUncut;
  }
}

const stage = document.querySelector<HTMLElement>("#stage");
if (stage === null) throw new Error("the page has no stage");
window.leftOfTheUncut = leftOfTheUncut;
window.hands = new Stand(stage);
