"""Studies of the pinned strip alone, at rest and compressed at constant speed."""
