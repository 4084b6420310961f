import { expect, test } from "vitest";
import type { ChannelState } from "../state/viewer_state";
import { channelActions, sharedChannel } from "./view_sharing";

const CHANNEL = {
  id: "CD31",
  shown: true,
  color: [1, 0, 0],
  opacity: 0.5,
  window: [0, 0.5],
} as unknown as ChannelState;
const RANGE = [100, 300] as const;

test("the window of a shared channel is in values of the source", () => {
  expect(sharedChannel(CHANNEL, RANGE)).toEqual({
    visible: true,
    color: "#ff0000",
    opacity: 0.5,
    window: [100, 200],
  });
});

test("requested settings that differ from the present ones become actions", () => {
  expect(channelActions(CHANNEL, { visible: false, window: [150, 300] }, RANGE)).toEqual([
    { type: "show", channel: "CD31", shown: false },
    { type: "window", channel: "CD31", window: [0.25, 1] },
  ]);
  expect(channelActions(CHANNEL, { color: "#00ff00", opacity: 0.25 }, RANGE)).toEqual([
    { type: "set", id: "color", value: [0, 1, 0], channel: "CD31" },
    { type: "set", id: "opacity", value: 0.25, channel: "CD31" },
  ]);
});

test("settings that come back as they were sent change nothing", () => {
  const third = { ...CHANNEL, opacity: 1 / 3, window: [1 / 3, 2 / 3] } as unknown as ChannelState;
  expect(channelActions(third, sharedChannel(third, RANGE), RANGE)).toEqual([]);
});
