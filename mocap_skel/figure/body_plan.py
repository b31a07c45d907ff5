"""What is true of every body in every posture: order along a limb, left and right, front and back.

Data only, in the standard names of markers. `*` in a name stands for a side, L or R, and `~` for the other one. A rule stands here only
if no posture breaks it by a wide margin; `segments/body_order.py` applies the rules.
"""

from __future__ import annotations

# (from, nearer, farther): seen from the first marker, the second is nearer than the third. Each triple lies on
# one segment, or beside the joint of it, so that bending a joint hardly changes the two distances.
ORDER = (
    ("*SHO", "*UPA", "*ELB"),
    ("*ELB", "*UPA", "*SHO"),
    ("*WRA", "*ARM", "*ELB"),
    ("*WRB", "*ARM", "*ELB"),
    ("*ELB", "*ARM", "*WRA"),
    ("*ELB", "*ARM", "*WRB"),
    ("*ELB", "*WRA", "*FIN"),
    ("*ELB", "*WRB", "*FIN"),
    ("*FIN", "*WRA", "*ELB"),
    ("*FIN", "*WRB", "*ELB"),
    ("*FWT", "*THI", "*KNE"),
    ("*FWT", "*GTR", "*KNE"),
    ("*KNE", "*THI", "*GTR"),
    ("*ANK", "*TIB", "*KNE"),
    ("*ANK", "*LEG", "*KNE"),
    ("*KNE", "*TIB", "*ANK"),
    ("*KNE", "*LEG", "*ANK"),
    ("*ANK", "*HEE", "*TOE"),
    ("*HEE", "*ANK", "*TOE"),
    ("*TOE", "*ANK", "*HEE"),
    ("*MT5", "*ANK", "*HEE"),
    ("*HEE", "*ANK", "*MT5"),
    ("*HEE", "*MT5", "*TOE"),
    ("T10", "*SHO", "*BHD"),
    ("STRN", "*SHO", "*FHD"),
    ("*BWT", "T10", "RBAC"),
    ("*FHD", "*BHD", "C7"),
    ("*FHD", "~FHD", "C7"),
    ("*FHD", "~FHD", "T10"),
    ("*BHD", "~BHD", "T10"),
    ("*BHD", "C7", "T10"),
    ("*BHD", "C7", "STRN"),
    ("*FHD", "CLAV", "STRN"),
    ("*FHD", "CLAV", "T10"),
    ("*SHO", "C7", "T10"),
    ("*SHO", "C7", "~SHO"),
    ("*SHO", "CLAV", "STRN"),
    ("*SHO", "CLAV", "~SHO"),
    ("CLAV", "STRN", "T10"),
    ("C7", "T10", "STRN"),
    ("STRN", "CLAV", "C7"),
    ("*BWT", "T10", "C7"),
    ("*FWT", "STRN", "CLAV"),
    ("*FWT", "~FWT", "*SHO"),
    ("*FWT", "*BWT", "*SHO"),
    ("*FWT", "*BWT", "CLAV"),
    ("*BWT", "*FWT", "C7"),
    ("*FWT", "*BWT", "*KNE"),
    ("*THI", "*FWT", "~FWT"),
    ("*THI", "*BWT", "~BWT"),
    ("RBAC", "C7", "CLAV"),
    ("RBAC", "T10", "STRN"),
    ("*FHD", "~FHD", "RBAC"),
    ("*FWT", "*BWT", "RBAC"),
    ("*BWT", "*FWT", "RBAC"),
)  # fmt: skip

# Pairs of markers, left and right, that lie nearer to those of their own side than to the other side's, however
# legs and arms are crossed.
SIDES = (
    ("FWT", "BWT"),
    ("FWT", "GTR"),
    ("FWT", "THI"),
    ("FWT", "KNE"),
    ("BWT", "THI"),
    ("GTR", "KNE"),
    ("THI", "KNE"),
    ("KNE", "TIB"),
    ("TIB", "ANK"),
    ("SHO", "UPA"),
    ("SHO", "ELB"),
    ("UPA", "ELB"),
    ("SHO", "FWT"),
    ("SHO", "BWT"),
    ("FHD", "BHD"),
    ("FHD", "SHO"),
    ("BHD", "SHO"),
)  # fmt: skip

# Farther down, crossed legs and folded arms bring the other side nearer. There the distance itself tells: metres in
# a person of 1.75 m (ANSUR, Gordon 1989; the feet from the places of `artificial/markers.py`).
LENGTHS = (
    ("KNE", "ANK", 0.42),
    ("ELB", "WRA", 0.255),
    ("ELB", "WRB", 0.255),
    ("HEE", "TOE", 0.19),
    ("ANK", "HEE", 0.08),
    ("ANK", "TOE", 0.135),
    ("WRA", "FIN", 0.10),
)  # fmt: skip
# What tells the size of the body there: markers of the trunk, which keep their distances.
SIZES = (
    ("LSHO", "RSHO", 0.36),
    ("LFWT", "RFWT", 0.25),
    ("LSHO", "LFWT", 0.46),
    ("RSHO", "RFWT", 0.46),
)

# Parts whose two sides may be exchanged as a whole, in words.
PARTS = {
    "the legs": ("GTR", "THI", "KNE", "KNM", "TIB", "LEG", "ANK", "HEE", "TOE", "MT5"),
    "the shanks and feet": ("TIB", "LEG", "ANK", "HEE", "TOE", "MT5"),
    "the ankles and feet": ("ANK", "HEE", "TOE", "MT5"),
    "the thighs": ("GTR", "THI", "KNE", "KNM"),
    "the shanks": ("TIB", "LEG", "ANK"),
    "the feet": ("HEE", "TOE", "MT5"),
    "the arms": ("UPA", "ELB", "ARM", "WRA", "WRB", "FIN"),
    "the shoulders and arms": ("SHO", "UPA", "ELB", "ARM", "WRA", "WRB", "FIN"),
    "the forearms and hands": ("ARM", "WRA", "WRB", "FIN"),
    "the upper arms": ("UPA", "ELB"),
    "the forearms": ("ARM", "WRA", "WRB"),
    "the wrists and hands": ("WRA", "WRB", "FIN"),
    "the wrists": ("WRA", "WRB"),
    "the head": ("FHD", "BHD"),
    "the pelvis": ("FWT", "BWT"),
    "the upper body": ("SHO", "UPA", "ELB", "ARM", "WRA", "WRB", "FIN", "FHD", "BHD"),
}  # fmt: skip

# (front, back): pairs whose line points forward, by the part that they are of.
FRONTS = (
    ("the chest", "CLAV", "C7"),
    ("the chest", "STRN", "T10"),
    ("the pelvis", "LFWT", "LBWT"),
    ("the pelvis", "RFWT", "RBWT"),
    ("the head", "LFHD", "LBHD"),
    ("the head", "RFHD", "RBHD"),
)  # fmt: skip
