"""Small ONNX models."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from stereocell.tissue import onnx_classifier as module

Shape = Sequence[int | str]


def write_model(
    path: Path,
    *,
    slopes: Sequence[float] = (-2.0, 3.0),
    shape: Shape = (1, 1, "D", "H", "W"),
    names: object = None,
    has_softmax: bool = False,
) -> Path:
    """Write a 1 x 1 x 1 convolution: logit k is slopes[k] times the voxel."""
    weights = np.array(slopes, np.float32).reshape(-1, 1, 1, 1, 1)
    nodes = [helper.make_node("Conv", ["voxels", "w"], ["logits"])]
    if has_softmax:
        nodes.append(helper.make_node("Softmax", ["logits"], ["out"], axis=1))
    last = "out" if has_softmax else "logits"
    outputs = (shape[0], len(slopes), *shape[2:])
    graph = helper.make_graph(
        nodes,
        "tissue",
        [helper.make_tensor_value_info("voxels", TensorProto.FLOAT, list(shape))],
        [helper.make_tensor_value_info(last, TensorProto.FLOAT, list(outputs))],
        [numpy_helper.from_array(weights, "w")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    if names is not None:
        text = names if isinstance(names, str) else json.dumps(names)
        helper.set_model_props(model, {module.NAMES_KEY: text})
    onnx.save(model, path)
    return path
