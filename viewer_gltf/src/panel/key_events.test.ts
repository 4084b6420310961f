import { describe, expect, it } from "vitest";
import { type Focus, firesOn, keyName } from "./key_events";

describe("a key with Ctrl or Command", () => {
  it("is named with Ctrl, also on a keyboard without Latin letters", () => {
    const z = { key: "z", code: "KeyZ", shiftKey: false };
    expect(keyName({ ...z, ctrlKey: true })).toBe("Ctrl+z");
    expect(keyName({ ...z, metaKey: true })).toBe("Ctrl+z");
    expect(keyName({ ...z, key: "Z", shiftKey: true, ctrlKey: true })).toBe("Ctrl+Z");
    expect(keyName({ ...z, key: "я", ctrlKey: true })).toBe("Ctrl+z");
  });
});

describe("a key that is pressed", () => {
  it("has a name on every keyboard", () => {
    const named = (key: string, code: string, shiftKey = false) => keyName({ key, code, shiftKey });
    expect(named("a", "KeyQ")).toBe("a"); // as on a French keyboard
    expect(named("ф", "KeyA")).toBe("a");
    expect(named("Ф", "KeyA", true)).toBe("A");
    expect(named("?", "Minus", true)).toBe("?");
    expect(named("ArrowLeft", "ArrowLeft")).toBe("ArrowLeft");
    expect(named("ArrowLeft", "ArrowLeft", true)).toBe("Shift+ArrowLeft");
  });

  it("is ignored while the user types, and is left to a control that it operates", () => {
    const press = ["Enter", " ", "Shift+Enter"];
    const goThrough = ["ArrowLeft", "Shift+ArrowUp", "Home", "End", "PageUp", "PageDown"];
    const others = ["o", "?", "+", "-", "=", "Escape", "Delete", "Backspace"];
    const fire = (focus: Focus) =>
      [press, goThrough, others].map((names) => {
        const fired = names.filter((name) => firesOn(name, focus)).length;
        return fired === 0 ? "none" : fired === names.length ? "all" : "some";
      });
    expect(fire("field")).toEqual(["none", "none", "none"]);
    expect(fire("list")).toEqual(["none", "none", "all"]);
    expect(fire("button")).toEqual(["none", "all", "all"]);
    expect(fire("page")).toEqual(["all", "all", "all"]);
  });
});
