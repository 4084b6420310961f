/** The background of the flat picture; the specimen has the same colours before all of them. */
import type { Backdrop } from "../render/backdrop";
import type { Room } from "../render/scene";
import type { Theme } from "../render/theme";

export class Background {
  /** Resolves when the background has loaded. */
  settled: Promise<void> = Promise.resolve();

  constructor(
    private readonly room: Room,
    private readonly onChange: () => void,
  ) {}

  /** @param isPlain one colour and no shadow: for cutting out, and for readers who ask for more contrast */
  dress(theme: Theme, isPlain: boolean): void {
    const dressIn = (backdrop: Backdrop | null) => {
      this.room.setTheme(theme, backdrop);
      this.onChange();
    };
    dressIn(null);
    const fetched = isPlain ? Promise.resolve() : import("../render/backdrop");
    const settled: Promise<void> = fetched.then(
      (part) => {
        if (part && this.settled === settled) dressIn(new part.Backdrop());
      },
      () => undefined, // a picture without it is as true
    );
    this.settled = settled;
  }
}
