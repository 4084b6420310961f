/**
 * Counts how many gazes each task of the first paper's figure 3 takes by gaze alone, with the
 * specimen in front of the user. STEREOCELL_GAZES_TABLE names a file for the table of counts.
 */
import { afterAll, describe, expect, it } from "vitest";
import { writeTable } from "../../test/support/table";
import { LookingPerson } from "../../test/support/xr/looking_person";

/** Gazes that start from a level view, each held until the dwell ring is full. */
type Task = Readonly<{
  gazes: readonly string[];
  /** A control that is looked at for half a second on the way, without a dwell ring. */
  glance?: string;
  isDone: (person: LookingPerson, before: LookingPerson["state"]) => boolean;
}>;

const DWELL_S = 1.7;
const colorOf = (state: LookingPerson["state"]) => state.channels[1].color.join();
const hasMoved = (person: LookingPerson) => person.hasMoved;

const TASKS: Readonly<Record<string, Task>> = {
  "hide a channel": {
    gazes: ["opener", "c1/shown"],
    isDone: ({ state }) => !state.channels[1].shown,
  },
  "recolour a channel": {
    gazes: ["opener", "c1/color="],
    glance: "c1/open",
    isDone: ({ state }, before) => colorOf(state) !== colorOf(before),
  },
  "choose a tile": {
    gazes: ["tile:r0_c1"],
    isDone: ({ state }) => state.selected === "r0_c1",
  },
  "isolate a tile": {
    gazes: ["tile:r0_c1", "tile:r0_c1"],
    isDone: ({ state }) => state.isolated === "r0_c1",
  },
  "switch volumes off": {
    gazes: ["bar-volumes"],
    isDone: ({ state }) => state.mode === "off",
  },
  "turn it": { gazes: ["bar-roll-left"], isDone: hasMoved },
  "bring it nearer": { gazes: ["bar-nearer"], isDone: hasMoved },
  "move it aside": { gazes: ["bar-move", "aside"], isDone: hasMoved },
};

describe("a task by gaze alone", () => {
  const rows: string[][] = [];

  afterAll(() => writeTable("STEREOCELL_GAZES_TABLE", ["task", "gazes", "looked at"], rows));

  it.each(Object.entries(TASKS))("takes at most two gazes: %s", (task, steps) => {
    const { gazes, glance, isDone } = steps;
    const person = new LookingPerson(4);
    const before = person.state;
    expect(isDone(person, before)).toBe(false);
    gazes.forEach((id, i) => {
      if (i === gazes.length - 1 && glance !== undefined) {
        person.lookAt(glance);
        person.rest(0.5);
      }
      if (id.startsWith("tile:")) person.lookAtTile(id);
      else if (id === "aside") person.lookAside();
      else person.lookAt(person.find(id));
      person.rest(DWELL_S);
      if (i < gazes.length - 1 && gazes[i + 1] !== "aside") person.lookUp();
    });
    expect(isDone(person, before)).toBe(true);
    expect(gazes.length).toBeLessThanOrEqual(2);
    const glanced = glance === undefined ? "" : ` (a glance at ${glance} on the way)`;
    rows.push([task, String(gazes.length), `${gazes.join(", ")}${glanced}`]);
  });
});

describe("undoing a choice", () => {
  const undo = (person: LookingPerson) => {
    person.lookAt("undo-choice");
    person.rest(DWELL_S);
  };

  it("is offered for four seconds, and restores the state and the pose of the specimen", () => {
    const person = new LookingPerson(4);
    const { state } = person;
    person.lookAt("bar-volumes");
    person.rest(DWELL_S);
    person.lookUp();
    person.rest(2);
    expect(person.state.mode).toBe("off");
    undo(person);
    expect(person.state.mode).toBe(state.mode);
    expect(person.has("undo-choice")).toBe(false);

    person.lookUp();
    person.lookAt("bar-roll-left");
    person.rest(DWELL_S);
    expect(person.hasMoved).toBe(true);
    undo(person);
    expect(person.hasMoved).toBe(false);
  });

  it("is not offered later, nor for a choice that changed nothing", () => {
    const person = new LookingPerson(4);
    person.lookAt("bar-volumes");
    person.rest(DWELL_S);
    person.lookUp();
    expect(person.has("undo-choice")).toBe(true);
    person.rest(4.2);
    expect(person.has("undo-choice")).toBe(false);
    person.lookAt("opener");
    person.rest(DWELL_S);
    expect(person.has("undo-choice")).toBe(false);
  });

  it("restores the tile that was chosen before a resting gaze", () => {
    const person = new LookingPerson(4);
    person.lookAtTile("tile:r0_c1");
    person.rest(DWELL_S);
    expect(person.state.selected).toBe("r0_c1");
    undo(person);
    expect(person.state.selected).toBeNull();
  });
});

describe("the scene under a resting gaze", () => {
  it("chooses no tile when stereo begins with the gaze on one", () => {
    const person = new LookingPerson(4);
    person.lookAtTile("tile:r0_c1");
    person.hands.stop();
    person.hands.start(null);
    person.rest(6);
    expect(person.state.selected).toBeNull();
  });

  it("chooses one tile once, even if the gaze stays longer", () => {
    const person = new LookingPerson(4);
    person.lookAtTile("tile:r0_c1");
    person.changes = 0;
    person.rest(12);
    expect([person.state.selected, person.state.isolated]).toEqual(["r0_c1", null]);
    expect(person.changes).toBe(1);
  });

  it("does not choose a tile that came under the gaze because the specimen turned", () => {
    const person = new LookingPerson(4);
    person.lookAtTile("tile:r0_c1");
    person.rest(1);
    const before = person.hands.pointed;
    for (let k = 0; k < 3; k++) person.hands.run("pan-right", person.state);
    person.rest(6);
    expect(person.hands.pointed).not.toBe(before);
    expect(person.state.selected).toBeNull();
  });
});
