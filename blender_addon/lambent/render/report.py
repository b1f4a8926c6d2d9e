# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What the last render of each scene could not do as asked; a panel lists it."""

_messages = {}


def store(scene_name, messages):
    """Replaces what is listed for a scene. messages: as the protocol has them."""
    _messages[scene_name] = list(messages)


def add(scene_name, messages):
    """Adds messages that are not listed yet."""
    known = _messages.setdefault(scene_name, [])
    known += [message for message in messages if message not in known]


def listed(scene_name):
    """The messages of a scene's last render, unsupported things first."""
    return sorted(_messages.get(scene_name, ()), key=lambda message: message.get("code") != "unsupported")


def clear():
    """Forgets everything (another file was opened)."""
    _messages.clear()
