import { expect, it } from "vitest";
import { noteAsked, takeAsked } from "./request_log";

it("notes each address and range once, until the notes are taken", () => {
  takeAsked(); // what other tests asked for
  noteAsked("https://host/a", undefined);
  noteAsked("https://host/a", {});
  noteAsked("https://host/a", { Range: "bytes=0-9" });
  noteAsked("https://host/a", { range: "bytes=0-9" });
  expect(takeAsked()).toEqual([
    { url: "https://host/a", range: null },
    { url: "https://host/a", range: "bytes=0-9" },
  ]);
  noteAsked("https://host/b", undefined);
  expect(takeAsked()).toEqual([]);
});
