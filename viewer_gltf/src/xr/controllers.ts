/**
 * The input sources of a WebXR session: where each hand is and points, and which buttons were
 * pressed. Sources without a position of their own (a Cardboard's button, a gaze) point with the
 * head.
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
import { keepUnclipped } from "../gpu/unclipped_material";
import type { SceneRay } from "../interaction/ray_pointer";
import type { HandPose } from "../math/grab";

/**
 * `press` and `release` are the start and end of holding the trigger; `select` is a completed
 * press.
 */
export type HandEvent = Readonly<{
  kind: "press" | "select" | "release" | "squeeze" | "let-go";
  source: XRInputSource;
  /** Ray at the time of the event; null: use the gaze. */
  ray: SceneRay | null;
  time_ms: number;
}>;

const KINDS = {
  selectstart: "press",
  select: "select",
  selectend: "release",
  squeezestart: "squeeze",
  squeezeend: "let-go",
} as const;

/** Position of a thumbstick or touchpad, -1 to 1: x to the right, y towards the body. */
export type Stick = Readonly<{ x: number; y: number }>;
const AT_REST: Stick = { x: 0, y: 0 };
/** Dead zone of a stick, as a share of its range: sticks do not rest exactly at zero. */
const DEAD_ZONE = 0.15;

/** Radius of a drawn ray, metres. */
const LINE_RADIUS_M = 0.0012;
/** Metres. Drawn length of a ray that hits nothing. */
const LINE_M = 1.5;

export class Hand {
  /** Ray along which the source points; null if it points with the gaze, or is not tracked now. */
  ray: SceneRay | null = null;
  /** Pose of the hand's grip; null if it is not tracked now. */
  pose: HandPose | null = null;

  constructor(
    readonly source: XRInputSource,
    readonly line: Mesh<CylinderGeometry, MeshBasicMaterial>,
  ) {}

  /** Whether the source has a position in the scene other than the head's. */
  get isTracked(): boolean {
    const { targetRayMode } = this.source;
    return targetRayMode === "tracked-pointer" || targetRayMode === "transient-pointer";
  }

  /**
   * Whether the source has a squeeze button, from its profiles; if no profile is generic, from its
   * buttons.
   */
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
    const live = (v: number) => (Math.abs(v) < DEAD_ZONE ? 0 : v);
    return { x: live(x), y: live(y) };
  }
}

export class Controllers {
  /** Scene objects of the rays that are drawn from the hands. */
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

  /** Reads the poses of the hands. Call it once a frame, before any other method reads them. */
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

  /** Returns and removes the events since the last call. */
  take(): readonly HandEvent[] {
    return this.events.splice(0);
  }

  /** Draws a hand's ray up to the target that it hits. */
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
    material.transparent = true; // sorts the ray after the panel at which it points
    const line = new Mesh(this.tube, material);
    line.renderOrder = RENDER_ORDER;
    line.visible = false;
    keepUnclipped(line);
    this.group.add(line);
    this.hands = [...this.hands, new Hand(source, line)];
  }

  private drop({ line }: Hand): void {
    line.removeFromParent();
    line.material.dispose(); // all hands share the geometry
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

  private rayOf(source: XRInputSource, frame: XRFrame): SceneRay | null {
    if (source.targetRayMode === "gaze") return null;
    // On a handheld screen a finger points. In a Cardboard viewer a touch is the button.
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

/** Draw order: after the panel, before notices and the dwell ring. */
const RENDER_ORDER = 1850;
const FORWARD = new Vector3(0, 0, -1);

/** Pose of a space in the session's space; null if the headset does not know it. */
function matrixOf(frame: XRFrame, of: XRSpace, space: XRReferenceSpace | null): Matrix4 | null {
  const pose = space === null ? undefined : frame.getPose(of, space);
  return pose ? new Matrix4().fromArray(pose.transform.matrix) : null;
}

/** A tube from the origin to one metre along -z. */
function lineGeometry(): CylinderGeometry {
  const tube = new CylinderGeometry(LINE_RADIUS_M, LINE_RADIUS_M, 1, 6, 1, true);
  tube.rotateX(Math.PI / 2);
  tube.translate(0, 0, -0.5);
  return tube;
}
