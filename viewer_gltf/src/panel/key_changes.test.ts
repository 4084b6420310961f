import { describe, expect, it } from "vitest";
import { KEYS } from "../../test/support/panel/all_keys";
import { changeKey, keyNow } from "./key_changes";
import { type KeyChanges, withKeys } from "./keys";

const changed = (changes: KeyChanges, name: string, pressed: string): KeyChanges => {
  const answer = changeKey(KEYS, changes, name, pressed);
  if ("refusal" in answer) throw new Error(answer.refusal);
  return answer.changes;
};
const refusal = (changes: KeyChanges, name: string, pressed: string) =>
  expect(changeKey(KEYS, changes, name, pressed)).toEqual({
    refusal: expect.stringMatching(/^[A-Z][^.]*\.$/),
  });

describe("a key that a user changes", () => {
  it("takes over the function of the old key, which has none then", () => {
    const changes = changed({}, "o", "é");
    expect(KEYS.standsFor("é", changes)).toBe("o");
    expect(KEYS.standsFor("o", changes)).toBeNull();
    expect(keyNow("o", changes)).toBe("é");
    expect(keyNow("m", changes)).toBe("m");
  });

  it("frees its old key for another action, and can take it back when it is free again", () => {
    const first = changed({}, "o", "é");
    const second = changed(first, "m", "o");
    expect(KEYS.standsFor("o", second)).toBe("m");
    refusal(second, "o", "o");
    const third = changed(second, "m", "m");
    expect(changed(third, "o", "o")).toEqual({});
  });

  it("is refused in one sentence if another action or the browser uses it", () => {
    for (const key of ["m", "Tab", "Enter", " ", "Escape", "F5", "Ctrl+t", "?"]) {
      refusal({}, "o", key);
    }
  });

  it("has one action for each key of the tables after any swap", () => {
    const names = KEYS.groups.flatMap(({ keys }) => keys.flatMap(({ keys }) => keys));
    let changes: KeyChanges = changed(changed({}, "a", "é"), "b", "a");
    changes = changed(changes, "a", "b");
    const done = names.map((name) => KEYS.standsFor(keyNow(name, changes), changes));
    expect(done).toEqual(names);
  });

  it("is named by its new key in sentences", () => {
    const text = "Nothing is cut yet: cut with a box (b) or a plane (n).";
    expect(withKeys(text, { b: "é" })).toBe(text.replace("(b)", "(é)"));
    expect(withKeys("two tiles (row 1)", { r: "é" })).toBe("two tiles (row 1)");
  });

  it("has no function for names that every JavaScript object has", () => {
    expect(KEYS.standsFor("constructor", {})).toBeNull();
    expect(KEYS.standsFor("toString", {})).toBeNull();
  });
});
