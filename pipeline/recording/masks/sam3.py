"""SAM 3 of transformers: a text prompt, weights in a local folder, a graphics card.

The processor of transformers wants torchvision; what it does to a picture (resize, scale to -1..1)
and to a prompt (CLIP's tokens, 32 of them) is done here. Source: facebook/sam3, its
preprocessor_config.json, and transformers.models.sam3_video.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from pipeline.base.errors import UserError
from pipeline.params.recording import Sam3
from pipeline.recording.view import RgbdFrame, View

TOKENS = 32  # of a prompt
NOTHING = -10.0  # logit of a mask that is not there


class Sam3Mask:
    """All that the video model finds by the prompt, where the band can be.

    The model sees all colour pictures of the window in their order; what it keeps of each is one
    picture of logits in its own low resolution.
    """

    def __init__(self, view: View, settings: Sam3):
        """Raises UserError where something is missing."""
        self.view = view
        model, tokenizer = _load(Path(settings.weights), settings.device)
        self.numbers = [k for k in range(len(view)) if view.color(k) is not None]
        if not self.numbers:
            raise UserError(f"{view.recording.path}: no colour picture in the window is readable")
        self.logits = dict(zip(self.numbers, self._track(model, tokenizer, settings), strict=True))

    def mask(self, frame: RgbdFrame) -> np.ndarray:
        camera = self.view.recording.color_camera
        logits = cv2.resize(self.logits[frame.number], (camera.width, camera.height))
        return self.view.marked(logits > 0, frame)

    def _track(self, model: Any, tokenizer: Any, settings: Sam3) -> list[np.ndarray]:
        """Logits (h, w) of each picture."""
        import torch
        from transformers.models.sam3_video.modeling_sam3_video import (  # pyright: ignore[reportMissingImports]
            Sam3VideoInferenceSession,
        )

        size, kind = model.config.image_size, model.dtype
        video = torch.empty((len(self.numbers), 3, size, size), dtype=kind)
        for place, number in enumerate(self.numbers):
            color = self.view.color(number)
            assert color is not None  # `numbers` are those that can be read
            color = cv2.cvtColor(color, cv2.COLOR_BGR2RGB)
            color = cv2.resize(color, (size, size), interpolation=cv2.INTER_LINEAR)
            video[place] = torch.from_numpy(color).permute(2, 0, 1).to(kind) / 127.5 - 1
        session = Sam3VideoInferenceSession(
            video,
            inference_device=settings.device,
            inference_state_device=settings.device,
            video_storage_device="cpu",
            dtype=kind,
        )
        prompt = session.add_prompt(settings.prompt)
        tokens = tokenizer(
            settings.prompt,
            return_tensors="pt",
            padding="max_length",
            max_length=TOKENS,
            truncation=True,
        ).to(settings.device)
        session.prompt_input_ids[prompt] = tokens.input_ids
        session.prompt_attention_masks[prompt] = tokens.attention_mask
        with torch.inference_mode():
            tracked = [
                _together(out, session) for out in model.propagate_in_video_iterator(session)
            ]
        return tracked


def _together(out: Any, session: Any) -> np.ndarray:
    """The objects of one picture as one picture of logits (h, w); hidden ones are left out."""
    hidden = (out.suppressed_obj_ids or set()) | session.hotstart_removed_obj_ids
    shown = [mask for key, mask in sorted(out.obj_id_to_mask.items()) if key not in hidden]
    if not shown:
        return np.full((1, 1), NOTHING, np.float32)
    logits = np.stack([mask.float().cpu().numpy()[0] for mask in shown])
    return logits.max(axis=0)


def _load(folder: Path, device: str) -> tuple[Any, Any]:
    """Model and tokenizer. Raises UserError with one line about what is missing."""
    try:
        import torch
        from transformers import (  # pyright: ignore[reportMissingImports]
            AutoTokenizer,
            Sam3VideoModel,
        )
        from transformers.utils import logging  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise UserError(
            f"cloud.mask sam3: {error.name or 'transformers'} is not installed, run"
            " pip install -e '.[sam3]'"
        ) from None
    if device != "cpu" and not _has(device):
        raise UserError(
            f"cloud.sam3.device {device}: there is no such GPU, set cloud.mask to opencv (or device"
            " to cpu, which takes minutes a picture)"
        )
    _check(folder)
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        model, loaded = Sam3VideoModel.from_pretrained(
            folder,
            local_files_only=True,
            use_safetensors=True,
            output_loading_info=True,
            dtype=torch.float32 if device == "cpu" else torch.bfloat16,
        )
        tokenizer = AutoTokenizer.from_pretrained(folder, local_files_only=True)
    except Exception as error:  # whatever transformers says of files that it cannot read
        reason = str(error).strip().splitlines() or [type(error).__name__]
        raise UserError(f"cloud.sam3.weights {folder}: cannot be loaded ({reason[0]})") from error
    if missing := sorted(loaded["missing_keys"]):
        raise UserError(
            f"cloud.sam3.weights {folder}: incomplete, {len(missing)} weights such as"
            f" {missing[0]} are missing: download all of facebook/sam3 again"
        )
    return model.to(device).eval(), tokenizer


def _has(device: str) -> bool:
    import torch

    number = int(device.partition(":")[2] or 0)
    return torch.cuda.is_available() and number < torch.cuda.device_count()


def _check(folder: Path) -> None:
    """The files of a SAM 3 video model are there. Raises UserError."""
    if not folder.is_dir():
        raise UserError(
            f"cloud.sam3.weights {folder}: there is no such folder, download facebook/sam3 into it"
            " (its licence has to be accepted on huggingface.co), or set cloud.mask to opencv"
        )
    for name, pattern in (
        ("config.json", "config.json"),
        ("model.safetensors", "*.safetensors"),
        ("tokenizer.json", "tokenizer.json"),
    ):
        if not any(folder.glob(pattern)):
            raise UserError(f"cloud.sam3.weights {folder}: incomplete, {name} is missing")
    try:
        kind = json.loads((folder / "config.json").read_text(encoding="utf-8")).get("model_type")
    except (ValueError, AttributeError):
        kind = "damaged"
    if kind != "sam3_video":
        raise UserError(
            f"cloud.sam3.weights {folder}: config.json is of a model {kind!r}, not sam3_video"
        )
