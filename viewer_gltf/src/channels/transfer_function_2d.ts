/** The editor of a channel's two-dimensional transfer function, in its card. Pure. */

import { MAX_SHAPES, type Shape, type Shapes } from "../bundle/transfer_2d";
import { fromHex, toHex } from "../math/color";
import type { Control, Histogram, PanelView } from "../panel/controls";
import {
  draggedTo,
  editedShapes,
  grabAt,
  selectedShapeIndex,
  withNewShape,
} from "../panel/edit_shapes";
import { PALETTES } from "../panel/palettes";
import type { Action } from "../state/actions";
import { REFUSED } from "../state/refusals";
import { editedName } from "../state/transfer_functions_2d";
import { removeShape, replaceShape, resize } from "../state/transfer_shapes";
import type { ChannelState } from "../state/viewer_state";

/** Colours of shapes, which multiply the channel's colour. White leaves it unchanged. */
const SHAPE_COLORS = PALETTES.slice(1).map(({ colors }) => ({
  name: "Colour, multiplied by the channel's",
  colors,
}));
const PERCENT_STEPS = 100;
const VALUE_STEPS = 255;
const GRADIENT_STEPS = 63;

/** Returns the action that gives the edited function of a channel new shapes. */
export function setShapes(channel: ChannelState, shapes: Shapes): Action {
  return { type: "set-shapes", channel: channel.id, name: editedName(channel), shapes };
}

/** Returns why the shapes cannot be edited now; "": they can. */
export function refusalOf(channel: ChannelState): string {
  if (!channel.volume) return REFUSED.transfer;
  const name = editedName(channel);
  const isOfBundle =
    channel.transferFunctions2d.includes(name) && !Object.hasOwn(channel.shapes, name);
  return channel.transfer2d === null && isOfBundle ? "The shapes are not loaded yet." : "";
}

/**
 * @param valueText returns a share of the intensities as a value of the source
 */
export function transferFunction2dItems(
  channel: ChannelState,
  view: PanelView,
  histogram: Histogram | null,
  valueText: (share: number) => string,
): readonly Control[] {
  const { id, name, transfer2d, window } = channel;
  const isOpen = view.isHistogramOpen && view.picked === id;
  const toggle: Control = {
    kind: "toggle",
    id: `${id}/plane`,
    label: "Value and gradient",
    name: `Shapes of ${name} by value and gradient`,
    value: isOpen,
    to: () => ({ panel: "histogram", channel: id }),
  };
  if (!isOpen) return [toggle];
  const shapes = editedShapes(channel);
  const selected = selectedShapeIndex(view.shape, shapes);
  const refusal = refusalOf(channel);
  const full =
    shapes.length >= MAX_SHAPES ? `A transfer function has at most ${MAX_SHAPES} shapes.` : "";
  const count = shapes.length;
  const set = (changed: Shapes) => setShapes(channel, changed);
  const most =
    transfer2d === null ? "" : percent(transfer2d.gradient_max * (window[1] - window[0]));
  const steepest = most === "" ? "" : `gradient ${most}`;
  const add = (kind: Shape["kind"]): Control => ({
    kind: "button",
    id: `${id}/add-${kind}`,
    label: kind === "rectangle" ? "+ Rectangle" : "+ Triangle",
    name: `Add a ${kind} to ${name}`,
    refusal: refusal || full,
    to: () => set(withNewShape(channel, kind)),
  });
  return [
    toggle,
    {
      kind: "histogram",
      id: `${id}/shapes`,
      label: "Value and gradient",
      name: `Value and gradient of ${name}`,
      refusal,
      histogram,
      window,
      shapes,
      selected,
      color: channel.color,
      texts: [valueText(window[0]), valueText(window[1]), steepest],
      press: (at, reach) => {
        const grab = grabAt(shapes, at, reach, selected);
        const index = grab?.index ?? selected;
        return { panel: "shape", shape: index === null ? null : { index, count }, grab };
      },
      drag: (at) => {
        const dragged = view.grab === null ? null : draggedTo(shapes, view.grab, at);
        return dragged === null ? null : set(dragged);
      },
    },
    add("rectangle"),
    add("triangle"),
    ...(selected === null ? [] : shapeItems(channel, shapes, selected, refusal)),
  ];
}

function shapeItems(
  channel: ChannelState,
  shapes: Shapes,
  selected: number,
  refusal: string,
): readonly Control[] {
  const { id } = channel;
  const shape = shapes[selected];
  const which = `shape ${selected + 1} of ${shapes.length}`;
  const set = (changed: Shapes) => setShapes(channel, changed);
  const change = (changed: Shape) => set(replaceShape(shapes, selected, changed));
  const { values, gradients } = shape;
  const percents = ([low, high]: readonly [number, number]) =>
    [percent(low), percent(high)] as const;
  const part = (name: "opacity" | "softness", label: string): Control => ({
    kind: "slider",
    id: `${id}/shape-${name}`,
    label,
    name: `${label} of ${which}`,
    value: shape[name],
    steps: PERCENT_STEPS,
    text: percent(shape[name]),
    refusal,
    to: (value) => change({ ...shape, [name]: value }),
  });
  return [
    {
      kind: "button",
      id: `${id}/remove-shape`,
      label: `Remove ${shape.kind}`,
      refusal,
      to: () => set(removeShape(shapes, selected)),
    },
    {
      kind: "window",
      id: `${id}/shape-values`,
      label: "Value",
      name: `Value of ${which}`,
      value: values,
      steps: VALUE_STEPS,
      texts: percents(values),
      refusal,
      to: ([value, high]) => {
        const moved = resize(shape, "left", { value, gradient: 0 });
        return change(resize(moved, "right", { value: high, gradient: 0 }));
      },
    },
    {
      kind: "window",
      id: `${id}/shape-gradients`,
      label: "Gradient",
      name: `Gradient of ${which}`,
      value: gradients,
      steps: GRADIENT_STEPS,
      texts: percents(gradients),
      refusal,
      to: ([gradient, high]) => {
        const moved = resize(shape, "bottom", { value: 0, gradient });
        return change(resize(moved, "top", { value: 0, gradient: high }));
      },
    },
    ...(shape.kind === "triangle"
      ? [
          {
            kind: "slider",
            id: `${id}/shape-tip`,
            label: "Tip",
            name: `Tip of ${which}`,
            value: shape.tip,
            steps: VALUE_STEPS,
            text: percent(shape.tip),
            refusal,
            to: (tip: number) => change({ ...shape, tip }),
          } as const,
        ]
      : []),
    part("opacity", "Opacity of the shape"),
    part("softness", "Softness"),
    {
      kind: "colour",
      id: `${id}/shape-color`,
      label: "Colour",
      name: `Colour of ${which}, multiplied by the channel's`,
      value: toHex(shape.color),
      palettes: SHAPE_COLORS,
      refusal,
      to: (hex) => change({ ...shape, color: fromHex(hex) }),
    },
  ];
}

function percent(share: number): string {
  return `${Math.round(100 * share)} %`;
}
