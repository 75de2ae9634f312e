"""What a card says, on one screen."""

from __future__ import annotations

from pathlib import Path


def shown(card: dict) -> str:
    """Verdict, values, three draws, what would help, and where the card lies.

    Args:
        card: As `fit` returns it.
    """
    reasons = [f"  - {reason}" for reason in card["reasons"]]
    lines = [f"{card['band']}: {card['verdict']}", *reasons, ""]
    width = max(len(one["label"]) for one in card["values"])
    lines += [f"  {one['label']:{width}}  {_value(one)}" for one in card["values"]]
    lines += ["", "  target     draw (y, z)           lands at   90 % interval       force"]
    lines += [_draw(one) for one in card["draws"]]
    if card["next"]:
        lines += ["", "What would help most:", *(f"  - {one}" for one in card["next"])]
    page = Path(card["card"]).with_name("index.html").resolve()
    return "\n".join([*lines, "", f"Card: {card['card']}", f"Page with a replay: {page.as_uri()}"])


def _value(about: dict) -> str:
    unit = f" {about['unit']}" if about["unit"] else ""
    if about["fixed"]:
        return f"{about['value']:.4g}{unit}, fixed"
    if about["low"] is None:
        return f"{about['value']:.4g}{unit}"
    return f"{about['value']:.4g}{unit}  ({about['low']:.4g} to {about['high']:.4g})"


def _draw(about: dict) -> str:
    at = f"{about['draw_y_m']:.4f}, {about['draw_z_m']:.4f} m"
    text = f"  {about['target_m']:.3f} m    {at}"
    if about["predicted_landing_m"] is None:
        return f"{text}    the launch fails in simulation"
    ends = about["interval_90_m"]
    interval = f"{ends[0]:.3f} to {ends[1]:.3f} m" if ends else "not known       "
    return (
        f"{text}    {about['predicted_landing_m']:.3f} m   {interval}"
        f"    {about['hold_force_n']:.1f} N"
    )
