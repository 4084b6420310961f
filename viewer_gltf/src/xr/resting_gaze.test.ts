/**
 * Users in stereo rest their gaze, tremble and press twice: each control of each page changes one
 * thing, once.
 */
import { describe, expect, it } from "vitest";
import { sweep } from "../../test/support/exhaustive";
import { LookingPerson, pagesOf } from "../../test/support/xr/looking_person";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";

const VIEW = { picked: "c2", isHistogramOpen: true } as const;
/**
 * A state with faults, a measurement and path tracing, so that every section shows everything it
 * can.
 */
function busy(state: ViewerState): ViewerState {
  const points = [
    [0, 0, 0],
    [3, 4, 0],
  ] as const;
  return [
    { type: "notify", text: "a fault", isRetryable: true } as const,
    { type: "measure", points } as const,
    { type: "finish-measuring" } as const,
    { type: "measure", points } as const,
  ].reduce(reduce, state);
}
/** With path tracing on, because the light section then has other controls. */
const traced = (state: ViewerState) => reduce(state, { type: "set", id: "mode", value: "traced" });

type Variant = (state: ViewerState) => ViewerState;
type TestedPage = readonly [
  name: string,
  tab: string,
  page: number,
  ids: readonly string[],
  variant: Variant,
];
/** The first element names the page in the report of a failed test. */
const PAGES: readonly TestedPage[] = [
  ...pagesOf(VIEW, busy).map(
    ([tab, page, ids]) => [`${tab} ${page}`, tab, page, ids, busy] as const,
  ),
  ...pagesOf(VIEW, traced)
    .filter(([tab]) => tab === "light")
    .map(([tab, page, ids]) => [`traced ${page}`, tab, page, ids, traced] as const),
];

function at([, tab, page, , variant]: TestedPage): LookingPerson {
  const person = new LookingPerson(12, variant);
  person.open(tab, page, VIEW);
  return person;
}
const CHANNELS = PAGES[1];

/** The numbers of requests and changes that one control has caused. */
type Effect = Readonly<{ id: string; requests: number; changes: number }>;

function effectsOf(
  page: TestedPage,
  act: (person: LookingPerson, id: string) => void,
  ids = page[3],
): readonly Effect[] {
  return ids.map((id) => {
    const person = at(page);
    act(person, id);
    const { changes, requests } = person;
    person.dispose();
    return { id, requests: requests.length, changes };
  });
}
const moreThanOne = (all: readonly Effect[]) =>
  all.filter(({ requests, changes }) => requests > 1 || changes > 1);

describe("every control of every page", () => {
  it("is tested", () => {
    const ids = PAGES.flatMap(([, , , all]) => all);
    expect(ids.length).toBeGreaterThan(100);
    expect(ids).toEqual(expect.arrayContaining(["leave", "c0/shown", "dwell", "more"]));
  });

  it.each(PAGES)(
    "changes one thing under a gaze that rests on it for 6 s longer: %s",
    (...page) => {
      const all = effectsOf(page, (person, id) => {
        person.lookAt(id, 0.5);
        person.rest(7.5);
      });
      expect(moreThanOne(all)).toEqual([]);
      expect(Math.max(...all.map(({ changes, requests }) => changes + requests))).toBeGreaterThan(
        0,
      );
    },
  );

  it.each(sweep(PAGES, ([, tab, page]) => tab === "channels" && page < 2))(
    "changes one thing under a gaze at its lower edge: %s",
    (...page) => {
      const all = effectsOf(page, (person, id) => {
        person.lookAt(id, 0.5, 0.9);
        person.rest(7.5);
      });
      expect(moreThanOne(all)).toEqual([]);
    },
  );

  it.each(sweep(PAGES, ([, tab]) => ["notices", "light", "measure"].includes(tab)))(
    "changes one thing by the button and nothing more by the gaze: %s",
    (...page) => {
      const all = effectsOf(page, (person, id) => {
        person.lookAt(id, 0.5);
        person.rest(1.4);
        person.press();
        person.rest(2);
      });
      expect(moreThanOne(all)).toEqual([]);
    },
  );

  it.each(PAGES)("changes one thing by a double press, unless it is a step: %s", (...page) => {
    const first = at(page);
    const isStep = (id: string) => {
      const { isStep, repeats } = first.region(id);
      return isStep === true || repeats !== undefined;
    };
    const switches = page[3].filter((id) => !isStep(id) && !first.region(id).isSlide);
    first.dispose();
    const act = (person: LookingPerson, id: string) => {
      person.lookAt(id, 0.5);
      person.press();
      person.press(180);
      person.rest(2);
    };
    const all = effectsOf(page, act, switches);
    expect(moreThanOne(all)).toEqual([]);
  });
});

describe("the rows of the panel", () => {
  const places = (person: LookingPerson) =>
    new Map(person.regions.map(({ id, rect }) => [id, rect]));

  it.each(PAGES)("keep their places when a switch among them is pressed: %s", (...page) => {
    const first = at(page);
    const switches = page[3].filter((id) => first.switches.includes(id));
    first.dispose();
    for (const id of switches) {
      const person = at(page);
      const before = places(person);
      person.lookAt(id);
      person.press();
      person.rest(1);
      const after = places(person);
      expect(after.get(id), id).toEqual(before.get(id));
      // a section that opens below a switch moves the rest of the page
      const common = [...before].filter(([each]) => after.has(each) && !id.endsWith("/plane"));
      expect(
        common.map(([each]) => [each, after.get(each)]),
        id,
      ).toEqual(common);
      person.dispose();
    }
  });

  it("keep their places in a list of many channels until the panel is opened again", () => {
    const person = new LookingPerson(70);
    person.open("channels");
    const ids = () => person.regions.flatMap(({ id }) => (id.endsWith("/shown") ? [id] : []));
    expect(ids()).toEqual(["c0", "c1", "c2", "c3"].map((id) => `${id}/shown`));
    const before = ids();
    for (const id of ["c3/shown", "c0/shown", "c2/shown"]) {
      person.lookAt(id);
      person.press();
      person.rest(1);
      expect(ids()).toEqual(before);
    }
    person.lookAt("close");
    person.press();
    person.open("channels");
    const shown = person.state.channels.filter((channel) => channel.shown);
    expect(ids().slice(0, shown.length)).toEqual(shown.map(({ id }) => `${id}/shown`));
  });
});

describe("a gaze that opens or closes the panel", () => {
  it("does nothing more, even if a control appears where the button was", () => {
    const person = new LookingPerson(9, busy);
    person.lookAt("opener");
    person.changes = 0;
    person.rest(2);
    expect(person.hands.panel.isOpen).toBe(true);
    expect(person.hands.pointed).toMatch(/^panel:/);
    person.rest(6);
    expect(person.hands.panel.isOpen).toBe(true);
    expect([person.changes, person.requests]).toEqual([1, []]);
  });

  it("does not fire when stereo begins with the gaze on the button", () => {
    const person = new LookingPerson(9, busy);
    person.lookAt("opener");
    person.hands.stop();
    person.hands.start(null);
    person.rest(6);
    // The bar has moved to where the head faces.
    expect(person.hands.pointed).toMatch(/^panel:bar-/);
    expect([person.hands.panel.isOpen, person.requests]).toEqual([false, []]);
    person.lookUp();
    person.lookAt("opener");
    person.rest(2);
    expect(person.hands.panel.isOpen).toBe(true);
  });

  it("chooses no tile behind it", () => {
    const person = at(CHANNELS);
    person.lookAt("close");
    person.rest(7.5);
    expect(person.hands.panel.isOpen).toBe(false);
    expect([person.changes, person.requests]).toEqual([1, []]);
  });

  it("leaves the panel open after a double press on its button", () => {
    const person = new LookingPerson(12, busy);
    person.lookAt("opener");
    person.press();
    person.press(180);
    expect(person.hands.panel.isOpen).toBe(true);
    expect(person.requests).toEqual([]);
  });
});

describe("a press that comes just after the dwell", () => {
  it("does not change anything else", () => {
    const person = at(CHANNELS);
    person.lookAt("c0/shown");
    person.rest(1.6);
    expect(person.requests).toHaveLength(1);
    person.press(100);
    expect(person.requests).toHaveLength(1);
  });
});

describe("the button of a WebXR session", () => {
  it("changes one thing by a double press, and two by two presses", () => {
    const person = new LookingPerson(9, busy);
    person.enterSession();
    person.open("channels");
    person.lookAt("c0/shown");
    person.press();
    person.press(180);
    expect(person.requests).toEqual([{ type: "show", channel: "c0", shown: false }]);
    person.rest(6);
    expect(person.requests).toHaveLength(1);
    person.press();
    expect(person.requests).toHaveLength(2);
  });
});

describe("a second press after a while", () => {
  it("switches back", () => {
    const person = at(CHANNELS);
    person.lookAt("c0/shown");
    person.press();
    person.press(600);
    expect(person.requests).toEqual([
      { type: "show", channel: "c0", shown: false },
      { type: "show", channel: "c0", shown: true },
    ]);
  });
});
