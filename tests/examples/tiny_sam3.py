"""SAM 3 with few and narrow layers and random weights, in a folder as a user would have it."""

from __future__ import annotations

from pathlib import Path

WIDTH, IMAGE = 128, 112


def save_tiny_sam3(folder: Path) -> None:
    """A model that finds something by any prompt."""
    import torch
    from transformers import Sam3VideoConfig, Sam3VideoModel

    heads = {"num_attention_heads": 2, "intermediate_size": 64}
    vision = {
        "backbone_config": {
            **heads,
            "model_type": "sam3_vit_model",
            "hidden_size": 32,
            "num_hidden_layers": 2,
            "image_size": IMAGE,
            "pretrain_image_size": IMAGE,
            "patch_size": 14,
            "window_size": 4,
            "global_attn_indexes": [1],
        },
        "fpn_hidden_size": WIDTH,
        "backbone_feature_sizes": [[32, 32], [16, 16], [8, 8]],
    }
    detector = {
        "vision_config": vision,
        "text_config": {**heads, "hidden_size": 32, "num_hidden_layers": 1, "projection_dim": 32},
        "geometry_encoder_config": {**heads, "hidden_size": WIDTH, "num_layers": 1},
        "detr_encoder_config": {**heads, "hidden_size": WIDTH, "num_layers": 1},
        "detr_decoder_config": {**heads, "hidden_size": WIDTH, "num_layers": 1, "num_queries": 8},
        "mask_decoder_config": {"hidden_size": WIDTH, "num_attention_heads": 2},
    }
    tracker = {
        "vision_config": vision,
        "prompt_encoder_config": {"hidden_size": WIDTH, "image_size": IMAGE, "patch_size": 14},
        "mask_decoder_config": {
            "hidden_size": WIDTH,
            "mlp_dim": 64,
            "num_attention_heads": 2,
            "iou_head_hidden_dim": 32,
        },
        "memory_attention_hidden_size": WIDTH,
        "memory_attention_num_layers": 1,
        "memory_attention_feed_forward_hidden_size": 64,
        "memory_attention_rope_feat_sizes": [8, 8],
        "memory_encoder_hidden_size": WIDTH,
        "memory_encoder_output_channels": 64,
        "mask_downsampler_embed_dim": WIDTH,
        "memory_fuser_embed_dim": WIDTH,
        "memory_fuser_intermediate_dim": 64,
        "image_size": IMAGE,
    }
    torch.manual_seed(0)
    config = Sam3VideoConfig(
        detector_config=detector,
        tracker_config=tracker,
        low_res_mask_size=32,
        score_threshold_detection=0.0,
        new_det_thresh=0.0,
    )
    Sam3VideoModel(config).save_pretrained(folder)
    save_tokenizer(folder)


def save_tokenizer(folder: Path) -> None:
    """One that knows two words."""
    from transformers import CLIPTokenizer

    words = ("<|startoftext|>", "<|endoftext|>", "rubber</w>", "band</w>")
    vocabulary = {word: number for number, word in enumerate(words)}
    CLIPTokenizer(vocab=vocabulary, merges=[]).save_pretrained(folder)
