"""Writes a trained network as one self-contained ONNX file."""

import json
import logging
import platform
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import torch

import derain
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.model_file import CHECKSUM_KEY, METADATA_KEY, NO_CHECKSUM, with_checksum
from derain.export.proof import BF16, FINITE, FLOAT32, INT8, Proof, prove
from derain.export.quantisation import quantised
from derain.export.runtimes.session import FLOAT32_PRECISION, Runtime
from derain.files.atomic import replacing
from derain.models.base import DerainingModule
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.spec import Spec
from derain.views.candidates import Bound, Candidates
from derain.views.channels import extra_channels
from derain.views.view import ViewedScan

# The version of ONNX's operators, stated so that files do not change with torch's default. 18 is
# the oldest that torch 2.13's exporter writes without converting.
OPSET = 18

# Numbers in a graph that are smaller than this are set to 0. The product of two of them is below
# 1e-38, where a number is subnormal, and a processor computes several times more slowly with those.
NEGLIGIBLE = 1e-20


def export(
    model: DerainingModule,
    path: Path | str,
    calibration: Sequence[Frame] = (),
    runtime: Runtime = Runtime(),
) -> Proof:
    """Exports a model, proves it, and only then puts the file in its place.

    Args:
        model: A trained model; its device and training mode are restored.
        path: The ONNX file to write.
        calibration: Scans like those that the model will see, their intensities in its unit, to
            export it in eight bits; none exports it in float32. Each is read twice, one at a time.
        runtime: Runtime of the file, which is proved by that too where it is not onnxruntime.

    Returns:
        The proof; the file's metadata hold that of onnxruntime.

    Raises:
        InputError: A model without a Spec, an output that cannot be written, a runtime that cannot
            run it, or a proof that fails; no file is left then.
    """
    path = Path(path)
    with evaluation_on_cpu(model), replacing(path) as temporary:
        proto = _traced(model, model.spec)
        flushed = flush_to_zero(proto)
        if calibration:
            proto = quantised(proto, model.spec.make_view(), calibration, model.INTEGER_OPERATORS)
        temporary.write_bytes(_described(proto, model.spec, {}))
        runtimes = [Runtime()] if runtime.is_default else [Runtime(), runtime]
        proofs = [_proof(model, temporary, calibration, each) for each in runtimes]
        for proof in proofs:
            if not proof.holds:
                reason = f"the exported model differs:\n{proof}"
                raise InputError(path, reason, "No file was left.")
        known = {"proof": proofs[0].as_dict(), "flushed": flushed}
        temporary.write_bytes(_described(proto, model.spec, known))
        onnx.checker.check_model(proto, full_check=True)
    return Proof(tuple(case for proof in proofs for case in proof.cases))


@contextmanager
def evaluation_on_cpu(model: DerainingModule) -> Iterator[None]:
    """Moves a model to the CPU in evaluation mode; afterwards its device and modes are restored.

    Args:
        model: The model, which is changed in place.
    """
    device = model.device
    training = [module for module in model.modules() if module.training]
    try:
        model.eval().cpu()
        yield
    finally:
        model.to(device)
        for module in training:
            module.training = True


def with_metadata(proto: onnx.ModelProto, metadata: Mapping[str, Any], **texts: str) -> bytes:
    """An ONNX file of a graph: its bytes, with their checksum among the metadata.

    Args:
        proto: The graph, whose metadata are replaced.
        metadata: Metadata for derain, JSON-able.
        texts: Metadata for people.
    """
    known = json.dumps({**metadata, CHECKSUM_KEY: NO_CHECKSUM})
    onnx.helper.set_model_props(proto, {METADATA_KEY: known, **texts})
    return with_checksum(proto.SerializeToString())


def flush_to_zero(proto: onnx.ModelProto) -> int:
    """Sets the numbers of a graph that are smaller than NEGLIGIBLE to 0.

    Returns:
        How many they were.
    """
    flushed = 0
    for tensor in proto.graph.initializer:
        values = onnx.numpy_helper.to_array(tensor)
        if values.dtype.kind != "f":
            continue
        negligible = (values != 0) & (np.abs(values) < NEGLIGIBLE)
        if negligible.any():
            flushed += int(negligible.sum())
            kept = np.where(negligible, values.dtype.type(0), values)
            tensor.CopyFrom(onnx.numpy_helper.from_array(kept, tensor.name))
    return flushed


def _proof(
    model: DerainingModule, path: Path, calibration: Sequence[Frame], runtime: Runtime
) -> Proof:
    if not calibration:
        bounds = FLOAT32 if runtime.precision == FLOAT32_PRECISION else BF16
        assert bounds.difference is not None
        bounds = replace(bounds, difference=bounds.difference * model.LOGIT_GAIN)
        return prove(model, path, _hard_cases(model.spec), bounds, runtime)
    scans = ((frame.name, frame.read()) for frame in calibration)
    seen = prove(model, path, scans, INT8, runtime)
    hard = prove(model, path, _hard_cases(model.spec), FINITE, runtime)
    return Proof(seen.cases + hard.cases)


def _hard_cases(spec: Spec) -> Iterator[tuple[str, Scan]]:
    """Hard scans that have the network's extra channels, with gaps, as fused scans have them."""
    generator = np.random.default_rng(0)
    statistics = dict(zip(spec.channels, zip(spec.mean, spec.std, strict=True), strict=True))
    for name, scan in hard_cases():
        columns = {}
        for channel in extra_channels(spec.channels):
            column = generator.normal(*statistics[channel], len(scan))
            columns[channel] = np.where(generator.random(len(scan)) < 0.1, np.nan, column)
        yield name, replace(scan, fields=columns)


def _traced(model: DerainingModule, spec: Spec) -> onnx.ModelProto:
    """The deployed network as an ONNX graph, for scans of any size where its view varies."""
    example = _example(spec)
    inputs = {name: torch.from_numpy(array) for name, array in example.inputs().items()}
    lengths = {axis: torch.export.Dim(axis, min=0) for axis in example.varying.values()}
    # The exporter warns of what is deprecated in itself and of a missing torchvision, about which
    # nobody here can do anything. What it makes is proved.
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        program = torch.onnx.export(
            model.deployed().eval(),
            kwargs=inputs,
            input_names=list(inputs),
            output_names=["logits"],
            opset_version=OPSET,
            dynamo=True,
            external_data=False,
            dynamic_shapes={
                name: {0: lengths[example.varying[name]]} if name in example.varying else None
                for name in inputs
            },
            verbose=False,
        )
    assert program is not None  # only None where it writes a file itself
    proto: onnx.ModelProto = program.model_proto
    if scored := list(example.varying.values()):
        # Where a network computes in blocks, as 3D-OutDet does, the exporter writes the number of
        # scores as a formula over them. It is that of the last input's rows.
        proto.graph.output[0].type.tensor_type.shape.dim[0].dim_param = scored[-1]
    del proto.graph.value_info[:]
    for node in proto.graph.node:
        # The exporter notes the source line of every operator, which is longer than the graph.
        del node.metadata_props[:]
    return proto


def _example(spec: Spec) -> ViewedScan:
    """The network's inputs for a small scan, for the exporter to trace.

    No length may be 0 or 1, which it would take for constants, or that of another axis.
    """
    scan = Scan.of(scene(50))
    if spec.candidates is not None:
        # So many that the neighbourhoods of those around them are not all that there are.
        near = Bound("range", most=float(np.sort(scan.range)[5]))
        spec = replace(spec, candidates=Candidates((near,)))
    return spec.make_view()(scan)


def _described(proto: onnx.ModelProto, spec: Spec, known: dict[str, object]) -> bytes:
    """An ONNX file of a graph, with what a user needs besides it."""
    versions = {
        "derain": derain.__version__,
        "torch": torch.__version__,
        "onnx": onnx.__version__,
        "onnxruntime": onnxruntime.__version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    description = f"{spec.network} trained on {spec.data}: probability of rain for LiDAR points"
    proto.doc_string = description
    proto.producer_name, proto.producer_version = "derain", derain.__version__
    return with_metadata(
        proto,
        {"spec": spec.as_dict(), "versions": versions, **known},
        description=description,
        license=f"network: MIT; training data: {spec.licence}",
        version=derain.__version__,
    )
