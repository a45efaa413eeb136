"""Colours of the pictures, of Okabe and Ito (2008), which the colour-blind tell apart; a page may have its own."""

STICK, SLIP, TRUTH = "#0072b2", "#d55e00", "#009e73"
NO_CONTACT = "#8b949e55"
"""Not opaque: grey on a light ground and on a dark one."""

FAINT, LINE = "#57606a", "#c9d1d9"

OF_THE_PAGE = {
    "#000000": "var(--text)",
    "#b0b0b0": "var(--faint)",
    FAINT: "var(--faint)",
    LINE: "var(--line)",
}
"""Variables of the page's style in place of matplotlib's black and grey, and of ours. The others are told apart on a
light ground and on a dark one."""
