"""Differences from Cycles that are known, with their reasons: cases that differ otherwise fail the comparison."""

import re

# (pattern of the case's label, reason)
k_known = [
    (r"Blackbody", "Cycles fits curves to the colour; ours is integrated from Planck's law (0.02%)"),
]


def reason(case):
    """Why a case may differ, or ""."""
    from compare import label

    return next((why for pattern, why in k_known if re.search(pattern, label(case))), "")
