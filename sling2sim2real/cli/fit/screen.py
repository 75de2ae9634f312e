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
    width = max(len(value["label"]) for value in card["values"])
    lines += [f"  {value['label']:{width}}  {_value(value)}" for value in card["values"]]
    lines += ["", "  target     draw (y, z)           lands at   90 % interval       force"]
    lines += [_draw(draw) for draw in card["draws"]]
    if card["next"]:
        lines += ["", "What would help most:", *(f"  - {step}" for step in card["next"])]
    page = Path(card["card"]).with_name("index.html").resolve()
    return "\n".join([*lines, "", f"Card: {card['card']}", f"Page: {page.as_uri()}"])


def _value(row: dict) -> str:
    unit = f" {row['unit']}" if row["unit"] else ""
    if row["fixed"]:
        return f"{row['value']:.4g}{unit}, fixed"
    if row["low"] is None:
        return f"{row['value']:.4g}{unit}"
    return f"{row['value']:.4g}{unit}  ({row['low']:.4g} to {row['high']:.4g})"


def _draw(row: dict) -> str:
    at = f"{row['draw_y_m']:.4f}, {row['draw_z_m']:.4f} m"
    text = f"  {row['target_m']:.3f} m    {at}"
    if row["predicted_landing_m"] is None:
        return f"{text}    the launch fails in simulation"
    ends = row["interval_90_m"]
    interval = f"{ends[0]:.3f} to {ends[1]:.3f} m" if ends else "not known       "
    return (
        f"{text}    {row['predicted_landing_m']:.3f} m   {interval}    {row['hold_force_n']:.1f} N"
    )
