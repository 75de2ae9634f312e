"""A policy for tests that need a file and no network: draw = slope target + offset."""

from pathlib import Path

import numpy as np
from onnx import TensorProto, helper, numpy_helper


def write_policy(path: Path, slope: tuple[float, float], offset: tuple[float, float]) -> None:
    """As ONNX, with the names and shapes of an exported policy."""
    weights = [
        numpy_helper.from_array(np.array(values, np.float32), name)
        for name, values in (("slope", [slope]), ("offset", offset))
    ]
    graph = helper.make_graph(
        [helper.make_node("Gemm", ["target", "slope", "offset"], ["draw"])],
        "linear",
        [helper.make_tensor_value_info("target", TensorProto.FLOAT, ["batch", 1])],
        [helper.make_tensor_value_info("draw", TensorProto.FLOAT, ["batch", 2])],
        weights,
    )
    opsets = [helper.make_opsetid("", 18)]
    path.parent.mkdir(parents=True, exist_ok=True)
    model = helper.make_model(graph, opset_imports=opsets, ir_version=10)
    path.write_bytes(model.SerializeToString())
