/** Start of the inbox: the page on which images are handed in. */
import "../panel/html/colors.css";
import "../panel/html/controls.css";
import "../panel/html/forced_colors.css";
import "./inbox.css";
import "./card.css";
import { LastingSocket } from "../dom/lasting_socket";
import { InboxPage } from "./inbox_page";
import { readInboxState } from "./inbox_state";
import { Server } from "./server";

const LIGHT = matchMedia("(prefers-color-scheme: light)");

/** Gives the page the colour theme of the system. */
function applyTheme(): void {
  document.documentElement.dataset.theme = LIGHT.matches ? "light" : "dark";
}

applyTheme();
LIGHT.addEventListener("change", applyTheme);

const app = document.getElementById("app");
if (app === null) throw new Error("the page has no #app");
const root = new URL("./", location.href);
const page = new InboxPage(app, new Server(root.href));
const events = new URL("events", root);
events.protocol = root.protocol === "https:" ? "wss:" : "ws:";
new LastingSocket(
  events.href,
  (text) => {
    const state = readInboxState(text);
    if (state !== null) page.update(state);
    return state !== null;
  },
  () => page.update(null),
);
