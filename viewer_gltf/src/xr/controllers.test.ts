import { CylinderGeometry, Mesh, MeshBasicMaterial } from "three";
import { describe, expect, it } from "vitest";
import { Controllers, Hand } from "./controllers";

/** A hand with only the given properties of its source. */
function handOf(source: Partial<Record<keyof XRInputSource, unknown>>): Hand {
  const line = new Mesh(new CylinderGeometry(), new MeshBasicMaterial());
  return new Hand({ profiles: [], ...source } as unknown as XRInputSource, line);
}

describe("an input source", () => {
  it("can squeeze if its profiles say so, but not as a bare hand or a one-button remote", () => {
    const profiles = ["meta-quest-touch-plus", "generic-trigger-squeeze-thumbstick"];
    expect(handOf({ profiles }).canSqueeze).toBe(true);
    const remote = ["oculus-go", "generic-trigger-touchpad"];
    const gamepad = { mapping: "xr-standard", buttons: [{}, {}, {}], axes: [] };
    expect(handOf({ profiles: remote, gamepad }).canSqueeze).toBe(false);
    expect(handOf({ profiles: ["unheard-of"], gamepad }).canSqueeze).toBe(true);
    expect(handOf({ profiles, hand: {} }).canSqueeze).toBe(false);
  });

  it("has a stick with a dead zone, or a touchpad", () => {
    const stick = (axes: number[]) => handOf({ gamepad: { mapping: "xr-standard", axes } }).stick;
    expect(stick([0, 0, 0.1, -0.8])).toEqual({ x: 0, y: -0.8 });
    expect(stick([0.5, 0])).toEqual({ x: 0.5, y: 0 });
    expect(stick([])).toEqual({ x: 0, y: 0 });
    expect(handOf({}).stick).toEqual({ x: 0, y: 0 });
  });

  it("has no position of its own if it is a gaze or a screen", () => {
    const isTracked = (targetRayMode: string) => handOf({ targetRayMode }).isTracked;
    expect(["gaze", "screen"].map(isTracked)).toEqual([false, false]);
    expect(["tracked-pointer", "transient-pointer"].map(isTracked)).toEqual([true, true]);
  });
});

describe("a finger on a screen", () => {
  /** A tap that points along -z from (1, 2, 3), in a session with this interaction mode. */
  function rayOfTap(interactionMode: XRInteractionMode) {
    const session = Object.assign(new EventTarget(), { interactionMode, inputSources: [] });
    const controllers = new Controllers();
    controllers.begin(session as unknown as XRSession, {} as XRReferenceSpace);
    const matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1];
    const frame = { getPose: () => ({ transform: { matrix } }) };
    const inputSource = { targetRayMode: "screen", targetRaySpace: {} };
    session.dispatchEvent(Object.assign(new Event("select"), { inputSource, frame }));
    const [event] = controllers.take();
    return event.ray;
  }

  it("points at the touched place if the phone is held in a hand", () => {
    const ray = rayOfTap("screen-space");
    expect(ray?.origin.toArray()).toEqual([1, 2, 3]);
    expect(ray?.direction.toArray()).toEqual([0, 0, -1]);
  });

  it("is a button if the phone is in a Cardboard viewer, and points with the head", () => {
    expect(rayOfTap("world-space")).toBeNull();
  });
});
