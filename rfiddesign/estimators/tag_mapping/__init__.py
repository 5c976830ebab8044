"""Where tags lie, learned from polls of antennas whose poses are known (tag_mapping_adaptive_likelihood)."""
