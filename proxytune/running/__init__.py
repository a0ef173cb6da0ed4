"""Running episodes: in this process or several, with progress."""
