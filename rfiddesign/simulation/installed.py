"""Floors with their tags laid, kept for as long as memory allows."""

from collections import OrderedDict
from threading import Lock

from rfiddesign.floor import Floor, TagMap, build_tag_map
from rfiddesign.geometry import TagPattern

# About 300 MB of tags and their index.
MAX_TAGS_KEPT = 10_000_000


class InstalledTags:
    """Tag maps by pattern and floor; those used last are kept while they are few enough.  Safe to share by threads."""

    def __init__(self, max_tags: int = MAX_TAGS_KEPT):
        self._max_tags = max_tags
        self._maps: OrderedDict[tuple[TagPattern, int], TagMap] = OrderedDict()
        self._laying: dict[tuple[TagPattern, int], Lock] = {}
        self._lock = Lock()

    def lay(self, pattern: TagPattern, floor: Floor) -> TagMap:
        """The tags of `pattern` on `floor`, where the plan has them."""
        key = (pattern, id(floor))
        with self._lock:
            if key in self._maps:
                self._maps.move_to_end(key)
                return self._maps[key]
            own_lock = self._laying.setdefault(key, Lock())
        # Different patterns are laid side by side; whoever asks for the same one waits for it.
        with own_lock:
            kept = self._maps.get(key)
            if kept is not None:
                return kept
            tags = build_tag_map(pattern.lay(floor.drivable))
            with self._lock:
                self._maps[key] = tags
                while len(self._maps) > 1 and sum(kept.n_tags for kept in self._maps.values()) > self._max_tags:
                    self._maps.popitem(last=False)
            return tags
