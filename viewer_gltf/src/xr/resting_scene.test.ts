/**
 * A gaze that rests in the scene: on handles, lamps, objects, points to measure, and the bar's
 * buttons.
 */
import { describe, expect, it } from "vitest";
import { LookingPerson } from "../../test/support/xr/looking_person";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";

const DWELL_S = 1.7;
const LONG_S = 7.5;

/** With a clip box. */
function boxed(state: ViewerState): ViewerState {
  const box = { min: [5, -15, 2], max: [45, -5, 6] } as const;
  return { ...state, clip: { ...state.clip, box: { min: [...box.min], max: [...box.max] } } };
}
const traced = (state: ViewerState): ViewerState => {
  const lit = reduce(state, { type: "set", id: "mode", value: "traced" });
  const lamps = lit.trace.lamps.map((lamp) => ({ ...lamp, isOn: true }));
  return { ...lit, areLampsShown: true, trace: { ...lit.trace, lamps } };
};
const measuring = (state: ViewerState) =>
  reduce(state, { type: "set", id: "tool", value: "measure" });

const HANDLES = [
  ["a face of the box", "x-max", boxed],
  ["a lamp", "lamp-0", traced],
] as const;

describe("a handle under a resting gaze", () => {
  it.each(HANDLES)("is picked up, stays in place, and is put down once: %s", (_, id, change) => {
    const person = new LookingPerson(4, change);
    person.lookUp();
    person.lookAtHandle(id);
    const at = () => person.handles.handles.find((each) => each.id === id)?.position ?? [];
    const before = at();
    person.rest(DWELL_S);
    expect(person.isCarrying).toBe(true);
    person.rest(LONG_S);
    at().forEach((v, i) => {
      expect(Math.abs(v - before[i])).toBeLessThan(1.5); // um, of 50: a head trembles
    });
    person.turnBy(6);
    person.rest(DWELL_S);
    expect(person.isCarrying).toBe(false);
    const put = at();
    expect(put).not.toEqual(before);
    person.rest(LONG_S);
    expect(person.isCarrying).toBe(false);
    expect(at()).toEqual(put);
  });

  it.each(HANDLES)("is not picked up when it moves under the gaze: %s", (_, id, change) => {
    const person = new LookingPerson(4, change);
    const { state } = person;
    person.lookAtHandle(id);
    person.state = change === boxed ? { ...state, clip: { ...state.clip, box: null } } : state;
    if (change === traced) person.state = { ...state, areLampsShown: false };
    person.lookUp();
    person.rest(0.5);
    person.lookBack();
    person.rest(0.2);
    person.state = state;
    person.rest(LONG_S);
    expect(person.hands.pointed).toBe(`handle:${id}`);
    expect(person.isCarrying).toBe(false);
  });
});

describe("a clip handle that existed before stereo began", () => {
  it("is picked up by the button, not by a resting gaze", () => {
    const person = new LookingPerson(4, boxed);
    person.handles.isCutAsleep = true;
    person.lookUp();
    person.lookAtHandle("x-max");
    person.rest(LONG_S);
    expect(person.hands.pointed).toBe("handle:x-max");
    expect(person.isCarrying).toBe(false);
    person.press();
    expect(person.isCarrying).toBe(true);
  });
});

describe("a point to measure under a resting gaze", () => {
  it("is set once, and the next point where the gaze rests next, even in the same tile", () => {
    const person = new LookingPerson(4, measuring);
    person.lookUp();
    person.lookAtTile("tile:r0_c1");
    person.rest(LONG_S);
    expect(person.measured).toHaveLength(1);
    person.turnBy(3);
    expect(person.hands.pointed).toBe("tile:r0_c1");
    person.rest(LONG_S);
    expect(person.measured).toHaveLength(2);
  });
});

describe("an object under a resting gaze", () => {
  const showing = (person: LookingPerson, object: string | null) => {
    person.objectAlong = () => (object === null ? null : { id: object, distance: 0.9 });
    const { objects } = person.state;
    person.state = { ...person.state, objects: { ...objects } };
  };

  it("is not chosen if it came under the gaze because another object was hidden", () => {
    const person = new LookingPerson(4);
    showing(person, "c0/7");
    person.lookUp();
    person.lookAtTile("tile:r0_c1");
    person.rest(1);
    showing(person, "c0/8");
    person.rest(LONG_S);
    expect(person.hands.pointed).toBe("tile:r0_c1/c0/8");
    expect(person.requests).toEqual([]);
  });

  it("is chosen once", () => {
    const person = new LookingPerson(4);
    showing(person, "c0/7");
    person.lookUp();
    person.lookAtTile("tile:r0_c1");
    person.rest(LONG_S);
    expect(person.requests).toHaveLength(1);
  });
});

describe("the bar under a resting gaze", () => {
  const ids = new LookingPerson(4).hands.panel.places.map(({ id }) => id);
  const repeating = ids.filter((id) => /nearer|farther|roll/.test(id));

  it("has the buttons that are tested", () => {
    expect(repeating).toHaveLength(4);
    expect(ids).toEqual(expect.arrayContaining(["bar-volumes", "bar-move", "opener"]));
  });

  it.each(["bar-volumes", "opener"])("changes one thing: %s", (id) => {
    const person = new LookingPerson(4);
    person.lookAt(id);
    person.changes = 0;
    person.rest(LONG_S);
    expect(person.changes).toBe(1);
  });

  it.each(repeating)("keeps moving while the gaze stays, and stops when it leaves: %s", (id) => {
    const person = new LookingPerson(4);
    const { state } = person;
    person.lookUp();
    person.lookAt(id);
    person.rest(1.3);
    expect(person.hasMoved).toBe(false);
    person.rest(1);
    const first = person.place;
    person.rest(1);
    const second = person.place;
    expect(second).not.toEqual(first);
    person.lookUp();
    const left = person.place;
    person.rest(LONG_S);
    expect(person.place).toEqual(left);
    expect(person.state).toBe(state);
  });

  it("picks up the specimen once, and leaves it where it was put down", () => {
    const person = new LookingPerson(4);
    person.lookUp();
    person.lookAt("bar-move");
    person.rest(DWELL_S);
    expect(person.isCarrying).toBe(true);
    person.lookAside();
    person.rest(DWELL_S);
    expect(person.isCarrying).toBe(false);
    const put = person.place;
    person.rest(LONG_S);
    expect(person.place).toEqual(put);
  });

  it("undoes one choice with Undo, not earlier ones", () => {
    const person = new LookingPerson(4);
    person.lookAt("bar-volumes");
    person.rest(DWELL_S);
    person.lookUp();
    person.lookAt("undo-choice");
    person.changes = 0;
    person.rest(LONG_S);
    // One for the undoing, one because Undo disappears from the bar.
    expect(person.changes).toBeLessThanOrEqual(2);
    expect(
      person.requests.filter((request) => JSON.stringify(request).includes("restore")),
    ).toHaveLength(1);
  });

  it.each(["leave", "close", "up"])("changes one thing while the menu is open: %s", (id) => {
    const person = new LookingPerson(4);
    person.open("channels");
    person.lookAt(id);
    person.changes = 0;
    person.requests.length = 0;
    person.rest(LONG_S);
    expect(person.changes).toBe(1);
    expect(person.requests.length).toBeLessThanOrEqual(1);
  });
});
