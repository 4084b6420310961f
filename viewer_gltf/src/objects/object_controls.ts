/** Makes the controls of a label map's section. Their IDs contain the channel's, and they change its object view. */
import type { ObjectColumn } from "../bundle/generated/objects";
import type { Control, Request } from "../panel/controls";
import type { ObjectView } from "../state/objects";

export class ObjectControls {
  constructor(private readonly channel: string) {}

  id(part: string): string {
    return `${this.channel}/objects-${part}`;
  }

  change(change: Partial<ObjectView>): Request {
    return { type: "objects", channel: this.channel, change };
  }

  text(part: string, label: string, value: string): Control {
    return { kind: "text", id: this.id(part), label, value };
  }

  button(part: string, label: string, change: Partial<ObjectView>, refusal = ""): Control {
    return { kind: "button", id: this.id(part), label, refusal, to: () => this.change(change) };
  }

  columnChoice(
    part: string,
    label: string,
    value: string,
    columns: readonly ObjectColumn[],
    none: string,
    change: (id: string) => Partial<ObjectView>,
  ): Control {
    const listed = columns.map(({ id, name }) => ({ value: id, label: name }));
    return {
      kind: "choice",
      id: this.id(part),
      label,
      value,
      options: [{ value: "", label: none }, ...listed],
      isInline: false,
      to: (id) => this.change(change(id)),
    };
  }
}
