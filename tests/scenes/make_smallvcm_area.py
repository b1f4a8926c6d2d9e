# SPDX-License-Identifier: GPL-3.0-or-later
"""SmallVCM's Cornell box lit by its area light; see smallvcm_boxes.py."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import smallvcm_boxes

smallvcm_boxes.build("area")
