"""`sling bench`: one benchmark of validation/benchmarks; a flag that it would ignore is refused."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from pipeline.params import Params

METHOD = "sling2sim2real"  # of --scaling
# What each benchmark takes beside --json and the flag that asks for it; "" is the plain form.
TAKES = {
    "recording": (),
    "scaling": ("methods", "budget", "device"),
    "peers": ("device",),
    "methods": ("budget", "device"),
    "": ("law", "device"),
}
SCRIPTS = {  # in validation/benchmarks
    "": "throughput",
    "recording": "clouds",
    "scaling": "scaling",
    "methods": "methods",
    "peers": "engines",
}


def bench(arguments: argparse.Namespace, what: str) -> str:
    """Measure `what`, a key of TAKES; a table, or with --json one object."""
    from pipeline.base.environment import environment
    from pipeline.params import load

    device, budget = arguments.device or "cpu", arguments.budget or "laptop"
    result, table, command = MEASURE[what](arguments, load(), device, budget)
    if not arguments.json:
        return table(result)
    device = "cpu" if what == "recording" else device
    command = f"sling bench {command} --json" if command else ""
    script = Path(__file__).with_name(f"{SCRIPTS[what]}.py")
    return json.dumps(environment(device, command, script) | result)


def requested(arguments: argparse.Namespace) -> str:
    """The benchmark asked for, a key of TAKES. Raises ArgumentTypeError on a flag too many."""
    flags = ("recording", "scaling", "peers", "methods", "budget", "law", "device")
    given = [name for name in flags if getattr(arguments, name) is not None]
    what = next((name for name in TAKES if name in given), "")
    for name in given:
        if name not in (what, *TAKES[what]):
            why = f"not used by --{what}" if what else "used by --methods and --scaling alone"
            raise argparse.ArgumentTypeError(f"argument --{name}: {why}")
    if what == "scaling" and len(arguments.methods or ()) > 1:
        raise argparse.ArgumentTypeError("argument --methods: --scaling takes one of them")
    return what


def _simulator(arguments, params: Params, device, budget):
    from validation.benchmarks import throughput

    if arguments.law is None:
        return throughput.bench(params, device), throughput.table, ""
    result = throughput.bench(params, device, arguments.law)
    return result, throughput.table, f"--law {arguments.law} --device {device}"


def _recording(arguments, params: Params, device, budget):
    from validation.benchmarks import clouds

    return clouds.bench_recording(arguments.recording, params), clouds.table, "--recording"


def _scaling(arguments, params: Params, device, budget):
    from validation.benchmarks import scaling

    band, method = arguments.scaling, (arguments.methods or [METHOD])[0]
    command = f"--scaling {band} --methods {method} --budget {budget} --device {device}"
    result = scaling.bench_scaling(params, device, band or None, method, budget)
    return result, scaling.table, command


def _methods(arguments, params: Params, device, budget):
    from validation.benchmarks import methods

    result = methods.bench_methods(params, device, budget, arguments.methods)
    words = ["--methods", *arguments.methods, f"--budget {budget} --device {device}"]
    return result, methods.table, " ".join(words)


def _peers(arguments, params: Params, device, budget):
    from validation.benchmarks import engines

    entries = engines.bench_peers(params, device)
    return {"peers": entries}, lambda _: engines.table(entries), f"--peers --device {device}"


MEASURE = {
    "": _simulator,
    "recording": _recording,
    "scaling": _scaling,
    "methods": _methods,
    "peers": _peers,
}
