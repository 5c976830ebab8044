"""A floor with its tags laid, kept for as long as memory allows."""

from collections import OrderedDict
from threading import Lock

from rfiddesign.floor import Floor, TagMap, build_tag_map
from rfiddesign.geometry import TagPattern

# About 300 MB of tags and their index.
MAX_TAGS_KEPT = 10_000_000


class InstalledTags:
    """Tag maps of one floor by pattern; those used last are kept while they are few enough.

    Safe to share by threads.
    """

    def __init__(self, floor: Floor, max_tags: int = MAX_TAGS_KEPT):
        self._floor = floor
        self._max_tags = max_tags
        self._maps: OrderedDict[TagPattern, TagMap] = OrderedDict()
        self._laying: dict[TagPattern, Lock] = {}
        self._lock = Lock()

    def lay(self, pattern: TagPattern) -> TagMap:
        """The tags of `pattern` on the floor, where the plan has them."""
        with self._lock:
            if pattern in self._maps:
                self._maps.move_to_end(pattern)
                return self._maps[pattern]
            own_lock = self._laying.setdefault(pattern, Lock())
        # Different patterns are laid side by side; whoever asks for the same one waits for it.
        with own_lock:
            with self._lock:
                kept = self._maps.get(pattern)
            if kept is not None:
                return kept
            tags = build_tag_map(pattern.lay(self._floor.drivable))
            with self._lock:
                self._maps[pattern] = tags
                while len(self._maps) > 1 and sum(kept.n_tags for kept in self._maps.values()) > self._max_tags:
                    self._maps.popitem(last=False)
            return tags
