/** The keys of the shapes of a two-dimensional transfer function. Pure. */
import { MAX_SHAPES, type Shape } from "../bundle/transfer_2d";
import { fromHex, toHex } from "../math/color";
import type { PanelView, Refusal, Request } from "../panel/controls";
import {
  editedShapes,
  SHAPE_NUMBERS,
  selectedShapeIndex,
  withNewShape,
} from "../panel/edit_shapes";
import { type Key, key, neighbour, no, ofChannel, withChannel } from "../panel/key";
import { nextColour } from "../panel/palettes";
import { REFUSED } from "../state/refusals";
import { removeShape, replaceShape } from "../state/transfer_shapes";
import type { ChannelState } from "../state/viewer_state";
import { refusalOf, setShapes } from "./transfer_function_2d";

/** Step of a shape's number, 0..1: five columns of the table. */
const SHAPE_STEP = 5 / 255;

const NO_SHAPE = no(REFUSED.shape);

function addShapeOf(kind: Shape["kind"]) {
  return (channel: ChannelState): Request | Refusal => {
    const reason = refusalOf(channel);
    if (reason !== "") return no(reason);
    const shapes = withNewShape(channel, kind);
    if (shapes.length > MAX_SHAPES)
      return no(`A transfer function has at most ${MAX_SHAPES} shapes.`);
    return setShapes(channel, shapes);
  };
}

/** Returns a key that changes the selected shape of the chosen channel; `to` returns null to remove it. */
function ofShape(
  name: string,
  label: string,
  to: (shape: Shape, view: PanelView) => Shape | null,
): Key {
  return key(name, label, (context) =>
    withChannel(context, (channel) => {
      const reason = refusalOf(channel);
      if (reason !== "") return no(reason);
      const shapes = editedShapes(channel);
      const index = selectedShapeIndex(context.view.shape, shapes);
      if (index === null) return NO_SHAPE;
      const changed = to(shapes[index], context.view);
      return setShapes(
        channel,
        changed === null ? removeShape(shapes, index) : replaceShape(shapes, index, changed),
      );
    }),
  );
}

function changeNumber(steps: number) {
  return (shape: Shape, { shapeNumber }: PanelView): Shape => {
    const [first] = SHAPE_NUMBERS;
    const number = SHAPE_NUMBERS.find(({ id, isOf }) => id === shapeNumber && isOf(shape)) ?? first;
    return number.by(shape, steps * SHAPE_STEP);
  };
}

export const SHAPE_KEYS: readonly Key[] = [
  ofChannel("H", "Joint histogram of value and gradient: open or close", ({ id }) => ({
    panel: "histogram",
    channel: id,
  })),
  ofChannel("Q", "Add a rectangle", addShapeOf("rectangle")),
  ofChannel("Y", "Add a triangle", addShapeOf("triangle")),
  key("J", "Next shape, which the keys below change", (context) =>
    withChannel(context, (channel) => {
      const shapes = editedShapes(channel);
      const present = selectedShapeIndex(context.view.shape, shapes);
      if (present === null) return NO_SHAPE;
      const { length: count } = shapes;
      return { panel: "shape", shape: { index: (present + 1) % count, count }, grab: null };
    }),
  ),
  key(";", "Choose the next number of the shape, such as its opacity", ({ view }) => {
    const ids = SHAPE_NUMBERS.map(({ id }) => id);
    const id = neighbour(ids, view.shapeNumber ?? ids[0], 1);
    return id === null ? NO_SHAPE : { panel: "shape-number", id };
  }),
  ofShape("<", "Decrease the chosen number of the shape", changeNumber(-1)),
  ofShape(">", "Increase the chosen number of the shape", changeNumber(1)),
  ofShape("*", "Next colour of the shape", (shape) => ({
    ...shape,
    color: fromHex(nextColour(toHex(shape.color))),
  })),
  ofShape("Shift+Delete", "Remove the shape", () => null),
];
