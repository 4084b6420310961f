import { expect, it } from "vitest";
import { liveHost } from "./live_host";

const BASE = "https://lab.example:8000/";
const of = (value: string | null) =>
  liveHost(new Headers(value === null ? {} : { "Stereocell-Live": value }), BASE);

it("the header Stereocell-Live gives the build's websocket and the folder of the newest view", () => {
  const socket = "wss://lab.example:8000/live";
  expect(of("version=1; folder=")).toEqual({ socket, folder: "" });
  expect(of("version=1; folder=g12/")).toEqual({ socket, folder: "g12/" });
});

it("the websocket of a bundle in a folder lies in that folder", () => {
  const headers = new Headers({ "Stereocell-Live": "version=1; folder=" });
  expect(liveHost(headers, `${BASE}items/7/view/`)?.socket).toBe(
    "wss://lab.example:8000/items/7/view/live",
  );
});

it("other values of the header Stereocell-Live are ignored", () => {
  expect(of(null)).toBeNull();
  for (const value of [
    "version=2; folder=",
    "version=1",
    "version=1; folder=../",
    "version=1; folder=g1",
  ]) {
    expect(of(value), value).toBeNull();
  }
});
