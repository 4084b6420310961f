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


def write_endless_model(path: Path) -> Path:
    """Write a network that adds 0 to its input 2^62 times."""
    like = helper.make_tensor_value_info
    body = helper.make_graph(
        [
            helper.make_node("Identity", ["go"], ["goes on"]),
            helper.make_node("Add", ["before", "zero"], ["after"]),
        ],
        "step",
        [
            like("step", TensorProto.INT64, []),
            like("go", TensorProto.BOOL, []),
            like("before", TensorProto.FLOAT, None),
        ],
        [like("goes on", TensorProto.BOOL, []), like("after", TensorProto.FLOAT, None)],
        [numpy_helper.from_array(np.zeros(1, np.float32), "zero")],
    )
    loop = helper.make_node("Loop", ["steps", "", "voxels"], ["last"], body=body)
    both = helper.make_node("Concat", ["last", "last"], ["out"], axis=1)
    return _save(path, [loop, both], [numpy_helper.from_array(np.array(2**62), "steps")])


def write_huge_model(path: Path, *, planes: int = 1 << 29) -> Path:
    """Write a network of some hundred bytes that makes a constant of 4.3 GB.

    planes  the constant takes 8 bytes for each
    """
    size = numpy_helper.from_array(np.array([1, 2, planes, 1, 1]), "size")
    nodes = [
        helper.make_node("ConstantOfShape", ["size"], ["many"]),
        helper.make_node("ReduceMax", ["many"], ["one"], axes=[2, 3, 4]),
        helper.make_node("Add", ["voxels", "one"], ["out"]),
    ]
    return _save(path, nodes, [size])


def _save(path: Path, nodes: list[onnx.NodeProto], constants: list[TensorProto]) -> Path:
    ends = [
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, count, 4, 4, 4])]
        for name, count in (("voxels", 1), ("out", 2))
    ]
    graph = helper.make_graph(nodes, "tissue", *ends, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.save(model, path)
    return path
