"""How a verdict looks: one sign and one colour for it, on the page, in pictures and in tables."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Look:
    """How the joints of one verdict are drawn and named.

    Attributes:
        sign: the sign in text.
        mark: the same sign as a marker of matplotlib.
        filled: whether that marker is filled.
        meaning: the verdict in words.
        colour, dark: of balls, bones and ellipsoids, on a light and on a dark ground.
        text, dark_text: of words, on a light and on a dark ground. Darker or lighter than the former:
            words need a contrast of 4.5 to 1 (WCAG 2.1, 1.4.3).
    """

    sign: str
    mark: str
    filled: bool
    meaning: str
    colour: str
    dark: str
    text: str
    dark_text: str


# Verdict → look; "none" is a joint that was not fitted. Blue and orange are Okabe & Ito's. Sign and colour
# say the same, so that nobody needs the colour.
LOOKS = {
    "yes": Look(
        "●", "o", True, "shown by the movement",
        "#0072b2", "#4da3ff", "#0057a8", "#6cb6ff",
    ),
    "weak": Look(
        "◆", "D", True, "shown in part, anatomy has its share",
        "#e69f00", "#f0b030", "#8f6000", "#f0b73a",
    ),
    "no": Look(
        "○", "o", False, "not shown by the movement: anatomy's, or place holders",
        "#cc3a70", "#ff6f9c", "#b0305c", "#ff8db0",
    ),
    "none": Look("–", "", True, "not fitted", "#5c6370", "#9aa2b1", "#5c6370", "#9aa2b1"),
}  # fmt: skip

# A value that a person should look at, whatever it is of.
ALARM = Look("▲", "^", True, "look at it", "#c62828", "#ff6b6b", "#b3261e", "#ff8a80")
_STYLED = {**LOOKS, "alarm": ALARM}


def style_of_verdicts() -> str:
    """The colours as variables of a style sheet: `--yes` for words, `--yes-ball` for what is drawn."""
    light = "".join(f"--{v}: {x.text}; --{v}-ball: {x.colour}; " for v, x in _STYLED.items())
    dark = "".join(f"--{v}: {x.dark_text}; --{v}-ball: {x.dark}; " for v, x in _STYLED.items())
    return f":root {{ {light}}}\n@media (prefers-color-scheme: dark) {{ :root {{ {dark}}} }}\n"
