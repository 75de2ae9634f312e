"""Names made to do harm to whatever shows them."""

MARKUP = (
    "<script>alert(1)</script>.mcap",
    "<img src=x onerror=alert(1)>.mcap",
    "![x](none.png).mcap",
    "[x](javascript:alert(1)).mcap",
    "a|b|c.mcap",
    "``` `a` ```.mcap",
    "a\n\n# b\n.mcap",
    "$\\frac{a$.mcap",
    "\x1b[2J\u202e\r.mcap",
    "**a** _b_ ~~c~~ &lt;.mcap",
)
