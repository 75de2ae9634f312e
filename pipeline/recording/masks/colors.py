"""Whether colours speak against a pixel: hue and saturation, which shadows do not change."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

BINS = 48  # of each axis of chromaticity
ENOUGH = 200  # pixels to learn from, of the band and of the hand
TOLD_APART = 0.97  # balanced accuracy from which colours count
DARK = 90  # sum of the channels below which they tell nothing
AGAINST = 0.1  # share of the band in a bin up to which a pixel is the hand's


class Colors:
    """Which chromaticities are the hand's and not the band's.

    Attributes:
        share: Of the band in each bin, shape (BINS, BINS).
    """

    def __init__(self, share: np.ndarray):
        self.share = share

    @classmethod
    def learn(cls, band: np.ndarray, hand: np.ndarray) -> Colors | None:
        """From BGR pixels (S, 3) of both; None where colours do not tell them apart."""
        samples = [pixels[_bright(pixels)] for pixels in (band, hand)]
        if min(map(len, samples)) < ENOUGH:
            return None
        counts = []
        for pixels in samples:
            histogram = np.zeros((BINS, BINS))
            np.add.at(histogram, _bins(pixels), 1.0)
            counts.append(gaussian_filter(histogram, 1.0, mode="nearest") / len(pixels) + 1e-6)
        share = counts[0] / (counts[0] + counts[1])
        right = [np.mean(share[_bins(pixels)] > 0.5) for pixels in samples]
        return cls(share) if (right[0] + 1 - right[1]) / 2 > TOLD_APART else None

    def against(self, pixels: np.ndarray) -> np.ndarray:
        """Which BGR pixels (S, 3) are the hand's rather than the band's: (S,)."""
        return _bright(pixels) & (self.share[_bins(pixels)] < AGAINST)


def _bright(pixels: np.ndarray) -> np.ndarray:
    return pixels.sum(axis=1, dtype=np.int32) > DARK


def _bins(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of blue and green in a pixel (S, 3), as bins."""
    whole = np.maximum(pixels.sum(axis=1, dtype=np.int32), 1)
    cells = pixels[:, :2].astype(np.int32) * (BINS - 1) // whole[:, None]
    return cells[:, 0], cells[:, 1]
