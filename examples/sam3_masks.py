"""Masks of a recording's pictures by SAM 3, for `cloud.mask: folder`.

    sling check my.mcap --pictures to_mask
    python examples/sam3_masks.py to_mask my.masks --weights models/sam3

Wants a GPU, `pip install '.[sam3]'`, and all files of facebook/sam3 in the folder of weights. It
has never run with the real weights here: look at `sling check --sheet` before you trust it.

Transformers' own processor wants torchvision; what it does to a picture (resize, scale to -1..1)
and to a prompt (CLIP's tokens, 32 of them) is done here. Source: facebook/sam3, its
preprocessor_config.json, and transformers.models.sam3_video.
"""

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np
import torch
from transformers import AutoTokenizer, Sam3VideoModel
from transformers.models.sam3_video.modeling_sam3_video import Sam3VideoInferenceSession

TOKENS = 32  # of a prompt
NOTHING = -10.0  # logit of a mask that is not there


def session_of(model, pictures: list[np.ndarray], prompt: str, tokenizer, device: str):
    """The model's session with all pictures (H, W, 3), BGR, in their order, and the prompt."""
    size, kind = model.config.image_size, model.dtype
    video = torch.empty((len(pictures), 3, size, size), dtype=kind)
    for place, picture in enumerate(pictures):
        color = cv2.resize(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), (size, size))
        video[place] = torch.from_numpy(color).permute(2, 0, 1).to(kind) / 127.5 - 1
    session = Sam3VideoInferenceSession(
        video,
        inference_device=device,
        inference_state_device=device,
        video_storage_device="cpu",
        dtype=kind,
    )
    number = session.add_prompt(prompt)
    shape = {"padding": "max_length", "max_length": TOKENS, "truncation": True}
    tokens = tokenizer(prompt, return_tensors="pt", **shape).to(device)
    session.prompt_input_ids[number] = tokens.input_ids
    session.prompt_attention_masks[number] = tokens.attention_mask
    return session


def logits_of(found, session) -> np.ndarray:
    """The objects of one picture as one picture of logits (h, w); hidden ones are left out."""
    hidden = (found.suppressed_obj_ids or set()) | session.hotstart_removed_obj_ids
    shown = [mask for key, mask in sorted(found.obj_id_to_mask.items()) if key not in hidden]
    if not shown:
        return np.full((1, 1), NOTHING, np.float32)
    return np.stack([mask.float().cpu().numpy()[0] for mask in shown]).max(axis=0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("pictures", type=Path, help="folder that `sling check --pictures` wrote")
    parser.add_argument("masks", type=Path, help="folder to write, beside the recording")
    parser.add_argument("--weights", type=Path, default=Path("models/sam3"))
    parser.add_argument("--prompt", default="rubber band")
    parser.add_argument("--device", default="cuda")
    arguments = parser.parse_args()
    files = sorted(arguments.pictures.glob("*.png"))
    if not files:
        sys.exit(f"error: {arguments.pictures}: no picture is in it")
    local = {"local_files_only": True}
    kind = torch.float32 if arguments.device == "cpu" else torch.bfloat16
    try:
        model = Sam3VideoModel.from_pretrained(arguments.weights, dtype=kind, **local)
        tokenizer = AutoTokenizer.from_pretrained(arguments.weights, **local)
        model = model.to(arguments.device).eval()
    except (OSError, ValueError, RuntimeError) as error:
        sys.exit(f"error: {arguments.weights}: {str(error).splitlines()[0]}")
    pictures = [cv2.imread(str(file)) for file in files]
    session = session_of(model, pictures, arguments.prompt, tokenizer, arguments.device)
    arguments.masks.mkdir(exist_ok=True)
    with torch.inference_mode():
        found = model.propagate_in_video_iterator(session)
        for file, picture, each in zip(files, pictures, found, strict=True):
            logits = cv2.resize(logits_of(each, session), picture.shape[1::-1])
            cv2.imwrite(str(arguments.masks / file.name), 255 * (logits > 0).astype(np.uint8))
            print(file.name, f"{(logits > 0).mean():.1%}", flush=True)


if __name__ == "__main__":
    main()
