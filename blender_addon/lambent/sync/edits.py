# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Collecting what a scene is, and keeping what the daemon knows, so that only differences travel."""

import hashlib
import re

from ..wire import messages

# Cycles' surface for faces without a material.
DEFAULT_MATERIAL = "lambent:default surface"

_LARGEST_FLOAT = 3.4028234663852886e38
# What may be above it, in JSON.
_LARGE = re.compile(rb"e\+(3[89]|[4-9]\d|\d{3})")

_KINDS = ("image", "material", "mesh", "light", "camera", "world", "object", "settings")


class SyncState:
    """What a session of the daemon has been told: a digest for each datablock. Belongs to one session."""

    def __init__(self):
        self._known = {}
        self._clear_first = False
        self._sync = 0

    def forget(self):
        """The daemon's state is uncertain (a transaction was interrupted): the next edits begin with a clear."""
        self._known.clear()
        self._clear_first = True

    def known(self):
        """(kind, id) of everything that the daemon holds."""
        return self._known.keys()

    def knows(self, kind, identifier):
        """Whether the daemon holds that datablock."""
        return (kind, identifier) in self._known


class SceneEdits:
    """One look at a scene. put() every datablock that is in it, then take edits() and arrays to the daemon.

    arrays: {hash: wire array} that changed datablocks use. messages: what is to be told to the user, as the protocol has it.
    aovs: names of the shader AOVs that are rendered. depsgraph: what is being looked at, while it is. mattes: the names of what was put by kind of Cryptomatte.
    """

    def __init__(self, state, aovs=frozenset()):
        self._state = state
        self._changed = {}
        self._present = set()
        self._digests = {}
        self._pending_arrays = {}
        self.arrays = {}
        self.messages = []
        self.aovs = aovs
        self.depsgraph = None
        self.mattes = {"object": set(), "material": set(), "asset": set()}

    def array(self, values):
        """The reference {"array": hash} to a numpy array, to be used in the value of the next put()."""
        array = messages.wire_array(values)
        key = messages.array_hash(array)
        self._pending_arrays[key] = array
        return {"array": key}

    def put(self, kind, identifier, value):
        """The datablock is in the scene with that value. Numbers that no float holds become 0 and are reported."""
        try:
            encoded = messages.encode_json(value)
        except ValueError:  # not finite
            encoded = None
        if encoded is None or _LARGE.search(encoded):
            value = self._finite(value, value.get("name", identifier), "")
            encoded = messages.encode_json(value)
        key = (kind, identifier)
        digest = hashlib.blake2b(encoded, digest_size=16).digest()
        self._present.add(key)
        known = self._state._known.get(key)
        if known is None or known[0] != digest:
            self._digests[key] = digest
            self._changed[key] = encoded
            self.arrays.update(self._pending_arrays)
        self._pending_arrays = {}

    def keep(self, kind, identifier):
        """The datablock is in the scene, and unchanged since the last edits. It must be known to the state."""
        self._present.add((kind, identifier))

    def keep_all(self):
        """Everything that the state knows is still in the scene, and unchanged unless it is put."""
        self._present.update(self._state.known())

    def contains(self, kind, identifier):
        """Whether this look has met the datablock already."""
        return (kind, identifier) in self._present

    def report(self, severity, code, name, text):
        """Adds a message: severity error, warning or info; code as in the protocol; name of the datablock."""
        message = {"severity": severity, "code": code, "object": name, "text": text}
        if message not in self.messages:
            self.messages.append(message)

    def unsupported(self, name, text):
        """Reports that something of datablock name is not supported; text says what stands in for it."""
        self.report("warning", "unsupported", name, text)

    def edits(self, keep_unused_syncs=0):
        """Encoded edits that bring the daemon from what the state knows to what was put, in order of dependency.

        Datablocks that are gone are removed; images, materials and meshes only after keep_unused_syncs further looks
        without them, so that view layers which take turns in one session do not send each other's data again.
        """
        state = self._state
        found = [b'{"op":"clear"}'] if state._clear_first else []
        for kind in _KINDS:
            found += [_upsert(key, encoded) for key, encoded in self._changed.items() if key[0] == kind]
        self._removed = []
        for key, (_, last_sync) in state._known.items():
            if key in self._present:
                continue
            patience = keep_unused_syncs if key[0] in ("image", "material", "mesh") else 0
            if state._sync + 1 - last_sync > patience:
                self._removed.append(key)
        # Objects go before what they use.
        self._removed.sort(key=lambda key: -_KINDS.index(key[0]))
        found += [messages.encode_json({"op": "remove", "kind": key[0], "id": key[1]}) for key in self._removed]
        return found

    def changed(self):
        """{(kind, id): encoded value, None where it is removed} of what edits() brings. To be called after it."""
        return {**self._changed, **dict.fromkeys(self._removed)}

    def confirm(self):
        """The daemon accepted the edits: the state knows them now."""
        state = self._state
        state._sync += 1
        state._clear_first = False
        for key in self._removed:
            del state._known[key]
        for key in self._present:
            digest = self._digests.get(key) or state._known[key][0]
            state._known[key] = (digest, state._sync)

    def _finite(self, value, name, parameter):
        if isinstance(value, float) and not abs(value) <= _LARGEST_FLOAT:
            self.report("error", "not_finite", name, f"{name}: {parameter} is {value}; 0 is used instead")
            return 0.0
        if isinstance(value, dict):
            return {key: self._finite(item, name, key) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return [self._finite(item, name, parameter) for item in value]
        return value


def _upsert(key, encoded):
    head = messages.encode_json({"op": "upsert", "kind": key[0], "id": key[1]})
    return head[:-1] + b',"value":' + encoded + b"}"
