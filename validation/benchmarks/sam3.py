"""Time and memory of SAM 3 as `cloud.mask: sam3` runs it, with random weights.

    python -m validation.benchmarks.sam3 --device cuda:0

A tiny random model masks the same pictures on the CPU and on the GPU, and twice there; a random
model of the real size masks pictures of 640 x 480, its load included. Random weights find nothing
to track, so the tracker's share of the time is not in it; how well SAM 3 masks, it does not tell.
Writes reports/benchmarks/sam3-h200.json.
"""

from __future__ import annotations

import tempfile
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from pipeline.base import errors
from pipeline.recording.masks.sam3 import Sam3Mask
from validation.benchmarks.timing import timed
from validation.campaigns import runner
from validation.recordings import looks
from validation.recordings.tiny_sam3 import save_tiny_sam3, save_tokenizer
from validation.reports import write_report

REPORT = Path("reports/benchmarks/sam3-h200.json")
LOOK, PROMPT = "orange on grey, white arm", "rubber band"
FEW = 6  # pictures of the tiny model
COUNTS = 30, 270  # pictures of a second and of a recording


def masker(view, folder: Path, device: str) -> Sam3Mask:
    settings = SimpleNamespace(weights=str(folder), prompt=PROMPT, device=device)
    return Sam3Mask(view, settings)


def tiny(folder: Path, device: str) -> dict:
    """How far the device's masks are from the CPU's, which are of float32."""
    save_tiny_sam3(folder)
    view = looks.view_of(looks.LOOKS[LOOK], looks.times(FEW))[0]
    runs = [masker(view, folder, where) for where in ("cpu", device, device)]
    cpu, first, again = (np.array([run.logits[k] > 0 for k in run.numbers]) for run in runs)
    return {
        "pictures": FEW,
        "same_again": bool((first == again).all()),
        "share_of_pixels_that_differ_from_cpu": float((cpu != first).mean()),
    }


def full(folder: Path, device: str) -> dict:
    """Seconds and memory of the real size."""
    import torch
    from transformers import Sam3VideoConfig, Sam3VideoModel

    torch.manual_seed(0)
    model = Sam3VideoModel(Sam3VideoConfig())
    figures = {
        "parameters": sum(parameter.numel() for parameter in model.parameters()),
        "image": model.config.image_size,
    }
    model.to(torch.bfloat16).save_pretrained(folder)
    save_tokenizer(folder)
    del model
    for count in COUNTS:
        view = looks.view_of(looks.LOOKS[LOOK], looks.times(count))[0]
        torch.cuda.reset_peak_memory_stats()
        _, _, seconds = timed(lambda view=view: masker(view, folder, device))
        memory = torch.cuda.max_memory_allocated()
        figures[f"{count} pictures"] = {"seconds": seconds, "gpu_gb": memory / 1e9}
    return figures


def main() -> None:
    parser = runner.parser(__doc__, REPORT)
    parser.add_argument("--device", default="cuda:0", help="a GPU (default: cuda:0)")
    args = parser.parse_args()
    versions = {name: version(name) for name in ("torch", "transformers")}
    with tempfile.TemporaryDirectory() as folder:
        content = {
            "weights": "random",
            "tiny": tiny(Path(folder, "tiny"), args.device),
            "real": full(Path(folder, "real"), args.device),
        }
    write_report(args.report, content, device=args.device, versions=versions)
    print(f"{args.report}: {content}")


if __name__ == "__main__":
    errors.run(main)
