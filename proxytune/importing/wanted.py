"""What a user asks of an import, where the source alone does not say."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

NOTHING: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True)
class Wanted:
    """What to take from a source; whatever is left empty is chosen by what there is.

    Attributes:
        commands: Topic of the commands; "none" for a log without them.
        poses: Topic of the poses, or parent and child of a transform as "map>base_link".
        frames: Topic of the pictures; "none" to leave them out.
        stamps: Whose times count: "header" (when it was measured) or "receive" (when it was written down).
        columns: Of a table or of arrays: our name to theirs, with the unit where it is not ours, as in
            {"time": "stamp_ns:ns", "x": "pos_x_mm:mm", "heading": "yaw_deg:deg", "v": "cmd_lin"}.
        kind: Kind of the commands, one of `proxytune.logs.COMMANDS`, where the source does not say.
    """

    commands: str = ""
    poses: str = ""
    frames: str = ""
    stamps: str = "header"
    columns: Mapping[str, str] = field(default_factory=lambda: NOTHING)
    kind: str = ""
