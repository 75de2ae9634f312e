"""A table is (heads, rows) of strings, as markdown or LaTeX; numbers become text here.

Centimetres, milliseconds and per cent appear in tables and nowhere else.
"""

from __future__ import annotations

import re

import numpy as np

Table = tuple[list[str], list[list[str]]]
NONE = "–"
MINUS = re.compile(r"(?<![\w.])-(?=\d)")  # before a number, not in 1E-3
NAMES = {  # of methods, as the paper prints them
    "DE_L": r"$DE_{\mathcal{L}}$",
    "BO_L": r"$BO_{\mathcal{L}}$",
    "Adam_L": r"$Adam_{\mathcal{L}}$",
    "−c": r"Sling2Sim2Real$^{-c}$",
    "−m": r"Sling2Sim2Real$^{-m}$",
    "−c, −m": r"Sling2Sim2Real$^{-c,-m}$",
    "−L_work": r"Sling2Sim2Real$^{-\mathcal{L}_{\mathrm{work}}}$",
}
SPECIAL = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"} | {
    sign: f"\\{sign}" for sign in "&%$#_{}"
}
SYMBOLS = {
    "±": r"$\pm$", "−": "$-$", "–": "--", "ν": r"$\nu$", "θ": r"$\theta$", "†": r"$\dagger$",
    "⚠": r"$\ast$", "|": "$|$", "×": r"$\times$", "·": r"$\cdot$",
}  # fmt: skip
HEAD = "% Needs booktabs and graphicx. Written by the last stage of `dvc repro`.\n"


def markdown(table: Table | None, repeats: bool = True) -> str:
    """Write a table as markdown; "" of None.

    Without `repeats`, first cells that repeat those above are blank.
    """
    if table is None:
        return ""
    heads, rows = table
    rows = rows if repeats else without_repeats(rows)
    rows = [[MINUS.sub("−", cell) for cell in row] for row in rows]
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def without_empty(table: Table) -> Table:
    """Without the columns that have no number in any row."""
    heads, rows = table
    filled = [n for n in range(len(heads)) if any(row[n] != NONE for row in rows)]
    return [heads[n] for n in filled], [[row[n] for n in filled] for row in rows]


def without_repeats(rows: list[list[str]]) -> list[list[str]]:
    """Rows whose first two cells are blank where they repeat those of the row above."""
    shown = []
    for above, row in zip([None, *rows], rows, strict=False):
        same = 0
        while above and same < 2 and row[same] == above[same]:
            same += 1
        shown.append([""] * same + row[same:])
    return shown


def number(value: float | None, form: str, otherwise: str | None = NONE) -> str:
    """`value` in a format such as ".3f", or `otherwise` where there is none."""
    if value is not None and np.isfinite(value):
        return format(value, form)
    return otherwise if isinstance(otherwise, str) else NONE


def centimetres(metres: float | None) -> str:
    return number(None if metres is None else 100 * metres, ".2f")


def percent(fraction: float, form: str = ".0f") -> str:
    return f"{100 * fraction:{form}} %"


def latex(table: Table, caption: str, label: str, over: tuple[str, int, int] | None = None) -> str:
    """A floating table; a rule parts rows whose first cells differ.

    Args:
        over: A heading above the columns from the second to the third number, counted from 1.
    """
    heads, rows = table
    lines = [r"\toprule"]
    if over:
        title, first, last = over
        blank = "& " * (first - 1)
        after = " &" * (len(heads) - last)
        span = f"\\multicolumn{{{last - first + 1}}}{{c}}{{{text(title)}}}"
        lines += [f"{blank}{span}{after} \\\\", f"\\cmidrule(lr){{{first}-{last}}}"]
    lines += [_line(heads), r"\midrule"]
    for number, (row, shown) in enumerate(zip(rows, without_repeats(rows), strict=True)):
        if number and row[0] != rows[number - 1][0]:
            lines.append(r"\midrule")
        lines.append(_line(shown))
    lines.append(r"\bottomrule")
    body = "\n".join(f"        {line}" for line in lines)
    columns = "lll" + "c" * (len(heads) - 3)
    return (
        f"{HEAD}\\begin{{table}}[t]\n    \\centering\n    \\caption{{{text(caption)}}}\n"
        f"    \\label{{{label}}}\n    \\resizebox{{\\linewidth}}{{!}}{{%\n"
        f"    \\begin{{tabular}}{{{columns}}}\n{body}\n"
        f"    \\end{{tabular}}%\n    }}\n\\end{{table}}\n"
    )


def text(words: str) -> str:
    """Words, with *emphasis* and **bold** of markdown, as LaTeX."""
    signs = SPECIAL | SYMBOLS
    plain = "".join(signs.get(sign, sign) for sign in words)
    bold = re.sub(r"\*\*(.+?)\*\*", r"\\textbf{\1}", plain)
    return re.sub(r"\*(.+?)\*", r"\\emph{\1}", bold)


def _line(cells: list[str]) -> str:
    return " & ".join(NAMES.get(cell) or text(cell) for cell in cells) + r" \\"
