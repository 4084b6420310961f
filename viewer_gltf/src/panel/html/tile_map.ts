/** Buttons of the tiles by row and column. The gazed, the selected and the isolated tile are marked. */

import { element } from "../../dom/element";
import { RovingTabindex } from "../../dom/roving_tabindex";
import { shortTileName } from "../../state/tile_name";
import type { MapTile, TileMap } from "../controls";
import { hooks, type Send, type Widget } from "./widget";

function nameOf({ id, title, isFocus, isSelected, isIsolated }: MapTile): string {
  const marks = [isIsolated && "shown alone", isSelected && "selected", isFocus && "in the gaze"];
  // users of voice control call a button by the text on it, so the name ends with that text
  const names = [title, ...marks.filter(Boolean), shortTileName(id)];
  return [...new Set(names)].join(", ");
}

export function makeMap(first: TileMap, send: Send): Widget<TileMap> {
  let now = first;
  const buttons = new Map<string, HTMLButtonElement>();
  const root = element("div", { className: "map", role: "group", ariaLabel: first.label });
  root.style.setProperty("--columns", String(first.columns));
  for (const tile of first.tiles) {
    const button = element(
      "button",
      { type: "button", textContent: shortTileName(tile.id), onclick: () => send(now.to(tile.id)) },
      { ...hooks(first.id), tileChoice: tile.id },
    );
    button.style.gridRow = String(tile.row + 1);
    button.style.gridColumn = String(tile.column + 1);
    buttons.set(tile.id, button);
    root.append(button);
  }
  new RovingTabindex(root).setButtons([...buttons.values()], first.columns);
  let marked = "";
  return {
    root,
    update(control) {
      now = control;
      const names = control.tiles.map(nameOf);
      if (names.join() === marked) return;
      marked = names.join();
      control.tiles.forEach((tile, i) => {
        const button = buttons.get(tile.id);
        if (button === undefined) return;
        button.ariaLabel = names[i];
        button.ariaPressed = String(tile.isSelected || tile.isIsolated);
        button.classList.toggle("gazed", tile.isFocus);
        button.classList.toggle("isolated", tile.isIsolated);
      });
    },
  };
}
