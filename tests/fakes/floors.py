"""The rooms of the package, from the ground up: imports go downwards."""

FLOORS = (
    "errors starting",
    "starting arrays settings files unpacking seeds identity lineage extensions space scores logs",
    "usefulness effects importing",
    "domain",
    "driving",
    "search learning environments",
    "storage running",
    "study",
    "sweep teaching diagnosis",
    "report",
    "api testing skeletons",
    "loop",
    "cli",
    "__main__ __init__",
)


def floor(room: str) -> int:
    """How high above the ground a room is."""
    return next(height for height, rooms in enumerate(FLOORS) if room in rooms.split())
