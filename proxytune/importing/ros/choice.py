"""Which topic of a bag is taken for what, and why."""

from dataclasses import dataclass, replace

from proxytune.errors import LogError
from proxytune.importing.ros.bag import Topic
from proxytune.importing.ros.roles import COMMAND_ROLE, KINDS, PICTURE_ROLE, POSE_ROLE, TRANSFORMS, Role, short
from proxytune.importing.source import Channel
from proxytune.importing.wanted import Wanted
from proxytune.logs import COMMANDS
from proxytune.settings import nearest


@dataclass(frozen=True)
class Choice:
    """What is taken from a bag.

    Attributes:
        commands: Topic of the commands, or None.
        kind: Kind of the commands.
        poses: Topic of the poses.
        transform: Parent and child as "map>base_link" where poses come of transforms; "" until it is chosen.
        pictures: Topic of the pictures, or None.
    """

    commands: Topic | None
    kind: str
    poses: Topic
    transform: str
    pictures: Topic | None

    @property
    def of_transforms(self) -> bool:
        """Whether poses come of transforms."""
        return self.poses.kind in TRANSFORMS


def choose(topics: tuple[Topic, ...], wanted: Wanted, where: str) -> Choice:
    """Choose topics by what is wanted, else by type, name and number of messages.

    Args:
        topics: All topics.
        wanted: What the user asks for.
        where: The bag, as a complaint names it.

    Raises:
        LogError: If a topic is named that is missing or of no use, or none can be commands or poses.
    """
    if wanted.kind and wanted.kind not in COMMANDS:
        raise LogError(f"{where}: unknown kind of commands '{wanted.kind}'; {nearest(wanted.kind, COMMANDS)}")
    without = "none" in (wanted.commands, wanted.kind)
    commands = None if without else _choose(_command_role(wanted), topics, wanted.commands, where)
    if not without and commands is None:
        raise LogError(f"{_nothing(COMMAND_ROLE, topics, where)}, or take a log without commands by --commands none")
    transform = wanted.poses if ">" in wanted.poses else ""
    role = replace(POSE_ROLE, ranks={"TFMessage": 0, "tfMessage": 0}) if transform else POSE_ROLE
    poses = _choose(role, topics, "" if transform else wanted.poses, where)
    if poses is None:
        raise LogError(_nothing(role, topics, where))
    pictures = None if wanted.frames == "none" else _choose(PICTURE_ROLE, topics, wanted.frames, where)
    kind = "none" if commands is None else _kind_of(commands, wanted.kind, where)
    return Choice(commands, kind, poses, transform, pictures)


def channels_of(topics: tuple[Topic, ...], choice: Choice) -> tuple[Channel, ...]:
    """Every topic with what it is taken for, or why it is left out."""
    return tuple(Channel(topic.name, topic.kind, topic.count, _part(topic, choice)) for topic in topics)


def notes_of(topics: tuple[Topic, ...], choice: Choice) -> tuple[str, ...]:
    """What was taken and what else could have been, a sentence each."""
    taken = ((COMMAND_ROLE, choice.commands), (POSE_ROLE, choice.poses), (PICTURE_ROLE, choice.pictures))
    return tuple(_note(role, topic, topics) for role, topic in taken if topic is not None)


def _command_role(wanted: Wanted) -> Role:
    """Commands of the kind that is wanted, where one is."""
    if wanted.commands or not wanted.kind:
        return COMMAND_ROLE
    ranks = {name: rank for name, rank in COMMAND_ROLE.ranks.items() if KINDS[name] in ("", wanted.kind)}
    return replace(COMMAND_ROLE, ranks=ranks)


def _choose(role: Role, topics: tuple[Topic, ...], name: str, where: str) -> Topic | None:
    if not name:
        return min(filter(role.is_offered, topics), key=role.order, default=None)
    named = {topic.name: topic for topic in topics}
    topic = named.get(name) or named.get(f"/{name}")
    if topic is None:
        raise LogError(f"{where}: no topic '{name}'; {nearest(name, named)}")
    if not role.can_be(topic):
        raise LogError(f"{where}: topic {topic.name} cannot be {role.name}: {role.why_not(topic)}")
    return topic


def _kind_of(topic: Topic, wanted: str, where: str) -> str:
    said = KINDS[short(topic.kind)]
    if not said and not wanted:
        raise LogError(
            f"{where}: topic {topic.name} does not say what its two numbers are; add --kind duty, "
            "wheel_speed or twist, or leave commands out by --commands none"
        )
    if said and wanted and said != wanted:
        raise LogError(f"{where}: topic {topic.name} holds commands of kind {said}, not {wanted}; leave --kind out")
    return said or wanted


def _nothing(role: Role, topics: tuple[Topic, ...], where: str) -> str:
    left = [topic.name for topic in topics if role.can_be(topic)]
    if left:
        return f"{where}: no topic is plainly {role.name}; name one of {', '.join(left)} by {role.option}"
    return f"{where}: no topic has {role.name}, which are messages of type {', '.join(role.ranks)}; record one"


def _note(role: Role, topic: Topic, topics: tuple[Topic, ...]) -> str:
    others = [other.name for other in topics if role.is_offered(other) and other != topic]
    also = f"; {', '.join(others)} could be as well ({role.option})" if others else ""
    return f"{role.name.capitalize()} are {topic.count} messages of {topic.name} ({short(topic.kind)}){also}."


def _part(topic: Topic, choice: Choice) -> str:
    roles = ((COMMAND_ROLE, choice.commands), (POSE_ROLE, choice.poses), (PICTURE_ROLE, choice.pictures))
    for role, taken in roles:
        if topic == taken:
            return role.name
    if choice.of_transforms and topic.kind in TRANSFORMS and topic.count:
        return POSE_ROLE.name
    fitting = [role for role, _ in roles if role.is_offered(topic)]
    if fitting:
        return f"left out: could be {fitting[0].name} as well ({fitting[0].option})"
    near = [role for role, _ in roles if short(topic.kind) in role.ranks]
    return f"left out: {near[0].why_not(topic)}" if near else "left out: neither commands, poses nor pictures"
