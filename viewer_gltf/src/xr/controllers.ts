/**
 * The input sources of a WebXR session: where each hand points and holds, and which buttons were
 * pressed. Sources without a place of their own (Cardboard's button, a look) point as the head does.
 */
import {
  CylinderGeometry,
  Group,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  Vector3,
} from "three";
import { leaveUncut } from "../gpu/unclipped_material";
import type { RoomRay } from "../interaction/ray_pointer";
import type { HandPose } from "../math/grab";

/** `press` and `release` are of the trigger held, `select` is the trigger used. */
export type HandEvent = Readonly<{
  kind: "press" | "select" | "release" | "squeeze" | "let-go";
  source: XRInputSource;
  /** At the time of the event; null: as the gaze. */
  ray: RoomRay | null;
  time_ms: number;
}>;

const KINDS = {
  selectstart: "press",
  select: "select",
  selectend: "release",
  squeezestart: "squeeze",
  squeezeend: "let-go",
} as const;

/** Of a thumbstick or touchpad, -1..1: to the right, and towards the body. */
export type Stick = Readonly<{ x: number; y: number }>;
const AT_REST: Stick = { x: 0, y: 0 };
/** Dead zone of a stick, as a share of its way: sticks never rest at zero. */
const DEAD = 0.15;

const LINE_RADIUS_M = 0.0012;
/** Length of a ray that meets nothing, m. */
const LINE_M = 1.5;

export class Hand {
  /** null: the gaze's, or it is not tracked now. */
  ray: RoomRay | null = null;
  /** Where it holds things; null: not known now. */
  pose: HandPose | null = null;

  constructor(
    readonly source: XRInputSource,
    readonly line: Mesh<CylinderGeometry, MeshBasicMaterial>,
  ) {}

  /** Whether it has a place in the room, other than the head's. */
  get isTracked(): boolean {
    const { targetRayMode } = this.source;
    return targetRayMode === "tracked-pointer" || targetRayMode === "transient-pointer";
  }

  /** Profiles name what a controller has; one that names nothing is taken by its buttons. */
  get canSqueeze(): boolean {
    const { profiles, gamepad, hand } = this.source;
    if (hand) return false;
    if (profiles.some((name) => name.includes("squeeze"))) return true;
    const isNamed = profiles.some((name) => name.startsWith("generic-"));
    return !isNamed && gamepad?.mapping === "xr-standard" && gamepad.buttons.length > 1;
  }

  get stick(): Stick {
    const { gamepad } = this.source;
    if (gamepad?.mapping !== "xr-standard") return AT_REST;
    const { axes } = gamepad;
    const [x = 0, y = 0] = axes.length >= 4 ? [axes[2], axes[3]] : axes;
    const live = (v: number) => (Math.abs(v) < DEAD ? 0 : v);
    return { x: live(x), y: live(y) };
  }
}

export class Controllers {
  /** The rays, to be seen. */
  readonly group = new Group();
  hands: readonly Hand[] = [];
  private readonly tube = lineGeometry();
  private events: HandEvent[] = [];
  private stopped = new AbortController();
  private session: XRSession | null = null;
  private space: XRReferenceSpace | null = null;

  constructor() {
    this.group.name = "rays";
  }

  begin(session: XRSession, space: XRReferenceSpace | null): void {
    this.end();
    this.session = session;
    this.space = space;
    this.stopped = new AbortController();
    const { signal } = this.stopped;
    for (const [type, kind] of Object.entries(KINDS)) {
      const listener = (event: XRInputSourceEvent) => {
        const { inputSource: source, frame, timeStamp: time_ms } = event;
        const ray = this.rayOf(source, frame);
        this.events.push({ kind, source, ray, time_ms });
      };
      session.addEventListener(type, listener as unknown as EventListener, { signal });
    }
  }

  end(): void {
    this.stopped.abort();
    this.session = null;
    this.space = null;
    this.events = [];
    for (const hand of this.hands) this.drop(hand);
    this.hands = [];
  }

  /** Read where the hands are. Once a frame, before anything that asks for it. */
  update(frame: XRFrame | null, space: XRReferenceSpace | null): void {
    this.space = space;
    const sources = this.session === null ? [] : [...this.session.inputSources];
    this.hands = this.hands.filter((hand) => {
      if (sources.includes(hand.source)) return true;
      this.drop(hand);
      return false;
    });
    for (const source of sources) {
      if (!this.hands.some((hand) => hand.source === source)) this.add(source);
    }
    for (const hand of this.hands) {
      if (frame !== null) this.follow(hand, frame);
    }
  }

  /** The buttons that were pressed since the last call. */
  take(): readonly HandEvent[] {
    return this.events.splice(0);
  }

  /** Draw a hand's ray up to what it meets. */
  draw(hand: Hand, distance_m: number | null): void {
    hand.line.visible = hand.ray !== null;
    if (hand.ray === null) return;
    const { origin, direction } = hand.ray;
    hand.line.position.copy(origin);
    hand.line.quaternion.setFromUnitVectors(FORWARD, direction);
    hand.line.scale.set(1, 1, distance_m ?? LINE_M);
  }

  dispose(): void {
    this.end();
    this.tube.dispose();
  }

  private add(source: XRInputSource): void {
    const material = new MeshBasicMaterial({ color: 0x9fb4d0, toneMapped: false });
    material.transparent = true; // so that it is drawn after the panel, to which it leads
    const line = new Mesh(this.tube, material);
    line.renderOrder = RENDER_ORDER;
    line.visible = false;
    leaveUncut(line);
    this.group.add(line);
    this.hands = [...this.hands, new Hand(source, line)];
  }

  private drop({ line }: Hand): void {
    line.removeFromParent();
    line.material.dispose(); // the geometry is everybody's
  }

  private follow(hand: Hand, frame: XRFrame): void {
    const { source } = hand;
    hand.ray = this.rayOf(source, frame);
    const held = matrixOf(frame, source.gripSpace ?? source.targetRaySpace, this.space);
    hand.pose = null;
    if (held === null || !hand.isTracked) return;
    const [position, orientation] = [new Vector3(), new Quaternion()];
    held.decompose(position, orientation, new Vector3());
    hand.pose = { position, orientation };
  }

  private rayOf(source: XRInputSource, frame: XRFrame): RoomRay | null {
    if (source.targetRayMode === "gaze") return null;
    // a finger on the one picture of a handheld screen points; in a Cardboard it is the button
    const isHandheld = this.session?.interactionMode === "screen-space";
    if (source.targetRayMode === "screen" && !isHandheld) return null;
    const pose = matrixOf(frame, source.targetRaySpace, this.space);
    if (pose === null) return null;
    return {
      origin: new Vector3().setFromMatrixPosition(pose),
      direction: new Vector3(0, 0, -1).transformDirection(pose),
    };
  }
}

/** Over the panel, under notices and the ring. */
const RENDER_ORDER = 1850;
const FORWARD = new Vector3(0, 0, -1);

/** null: the headset doesn't know. */
function matrixOf(frame: XRFrame, of: XRSpace, space: XRReferenceSpace | null): Matrix4 | null {
  const pose = space === null ? undefined : frame.getPose(of, space);
  return pose ? new Matrix4().fromArray(pose.transform.matrix) : null;
}

/** From the origin one metre along -z. */
function lineGeometry(): CylinderGeometry {
  const tube = new CylinderGeometry(LINE_RADIUS_M, LINE_RADIUS_M, 1, 6, 1, true);
  tube.rotateX(Math.PI / 2);
  tube.translate(0, 0, -0.5);
  return tube;
}
