import { describe, expect, it } from "vitest";
import { breakLines } from "./paint";

const measure = (words: string) => words.length;

describe("text on the panel", () => {
  it("stays unchanged if it fits", () => {
    expect(breakLines("one two", 7, 1, measure)).toEqual(["one two"]);
  });

  it("breaks lines at each line break of the text", () => {
    expect(breakLines("one\ntwo three\nfour", 9, 3, measure)).toEqual(["one", "two three", "four"]);
    expect(breakLines("one two\nthree", 4, 3, measure)).toEqual(["one", "two", "thr…"]);
    expect(breakLines("one\ntwo", 9, 1, measure)).toEqual(["one two"]);
  });

  it("breaks between words, and ends with an ellipsis if the lines are used up", () => {
    expect(breakLines("one two three", 7, 2, measure)).toEqual(["one two", "three"]);
    expect(breakLines("one two three four", 7, 2, measure)).toEqual(["one two", "three…"]);
    expect(breakLines("unbroken", 5, 1, measure)).toEqual(["unbr…"]);
  });
});
