"""A bag, or a folder of bags, as drives with commands, poses and pictures.

A topic is taken by its type, its name and its number of messages, unless the user names it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from proxytune.errors import LogError
from proxytune.files import package_table
from proxytune.importing.bag import (
    COMMAND_TYPES,
    Topic,
    bags_in,
    form_of,
    open_bag,
    read_commands,
    read_poses,
    read_wheels,
)
from proxytune.importing.bag_scene import TRANSFORMS, choose_transform, read_chain, read_pictures, read_transforms
from proxytune.importing.source import Channel, Drive, Source, Wanted, told_once
from proxytune.importing.vesc import KIND as VESC, pair_topics, read_vesc, servo_of
from proxytune.logs import COMMANDS
from proxytune.settings import nearest


def short(kind: str) -> str:
    """A type without its package: Twist of geometry_msgs/msg/Twist."""
    return kind.rpartition("/")[2]


@dataclass(frozen=True)
class Role:
    """Something that a log needs of a bag, as roles.toml has it."""

    name: str
    option: str
    ranks: Mapping[str, int]
    first: Sequence[str] = ()
    never: Sequence[str] = ()
    asked: Sequence[str] = ()

    def can_be(self, topic: Topic) -> bool:
        """True if a topic has messages that can be read as this."""
        return topic.count > 0 and topic.known and not topic.lacking and short(topic.kind) in self.ranks

    def is_offered(self, topic: Topic) -> bool:
        """True if a topic may be taken without being named."""
        named_otherwise = any(part in topic.name.lower() for part in self.never)
        return self.can_be(topic) and not named_otherwise and short(topic.kind) not in self.asked

    def order(self, topic: Topic) -> tuple[bool, int, int, int, str]:
        """The lowest goes first: by name, by type, by number of messages."""
        name = topic.name.lower()
        differs = name.rpartition("/")[2] not in self.first
        by_name = next((place for place, part in enumerate(self.first) if part in name), len(self.first))
        return differs, by_name, self.ranks[short(topic.kind)], -topic.count, topic.name

    def why_not(self, topic: Topic) -> str:
        """The reason why a topic is not taken."""
        if not topic.count:
            return "it has no messages"
        if topic.lacking:
            return f"bags without messages of it: {topic.lacking}"
        if not topic.known:
            return f"the bag does not define {topic.kind}; record it by a newer ROS or as mcap, which does"
        return f"{topic.kind} is none of {', '.join(self.ranks)}"


KIND_OF = {name: kind for name, (kind, _) in COMMAND_TYPES.items()} | {short(VESC): "speed_steering"}
"""The kind of command that a type of message says; empty where it says none."""
ROLES = package_table("importing/roles.toml")
COMMAND_ROLE, POSE_ROLE, WHEEL_ROLE, PICTURE_ROLE = (Role(name, **table) for name, table in ROLES.items())


@dataclass(frozen=True)
class Choice:
    """The topics that are taken from a bag, and the kind of its commands.

    Where poses come of transforms, `transform` is parent and child as "map>base_link"; "" until it is chosen.
    """

    commands: Topic | None
    kind: str
    poses: Topic
    transform: str
    wheels: Topic | None
    pictures: Topic | None

    @property
    def of_transforms(self) -> bool:
        """True if poses come of transforms."""
        return self.poses.kind in TRANSFORMS


def choose(topics: tuple[Topic, ...], wanted: Wanted, where: str) -> Choice:
    """Choose topics by what is wanted, else by type, name and number of messages."""
    if wanted.kind and wanted.kind not in COMMANDS:
        raise LogError(f"{where}: unknown kind of commands '{wanted.kind}'; {nearest(wanted.kind, COMMANDS)}")
    of_kind = COMMAND_ROLE
    if wanted.kind and not wanted.commands:
        ranks = {name: rank for name, rank in COMMAND_ROLE.ranks.items() if KIND_OF[name] in ("", wanted.kind)}
        of_kind = replace(COMMAND_ROLE, ranks=ranks)
    commands = None if wanted.without_commands else _choose(of_kind, topics, wanted.commands, where)
    if not wanted.without_commands and commands is None:
        raise LogError(f"{_nothing(COMMAND_ROLE, topics, where)}, or take a log without commands by --commands none")
    transform = wanted.poses if ">" in wanted.poses else ""
    role = replace(POSE_ROLE, ranks={"TFMessage": 0, "tfMessage": 0}) if transform else POSE_ROLE
    if (poses := _choose(role, topics, "" if transform else wanted.poses, where)) is None:
        raise LogError(_nothing(role, topics, where))
    wheels = _choose(WHEEL_ROLE, topics, wanted.wheels, where)
    pictures = None if wanted.frames == "none" else _choose(PICTURE_ROLE, topics, wanted.frames, where)
    kind = "none" if commands is None else _kind_of(commands, wanted.kind, where)
    return Choice(commands, kind, poses, transform, wheels, pictures)


def roles_of(choice: Choice) -> tuple[tuple[Role, Topic | None], ...]:
    """The topic taken in each role."""
    taken = (choice.commands, choice.poses, choice.wheels, choice.pictures)
    return tuple(zip((COMMAND_ROLE, POSE_ROLE, WHEEL_ROLE, PICTURE_ROLE), taken, strict=True))


def channels_of(topics: tuple[Topic, ...], choice: Choice) -> tuple[Channel, ...]:
    """Every topic with what it is taken for, or why it is left out."""
    return tuple(Channel(topic.name, topic.kind, topic.count, _taken_for(topic, choice)) for topic in topics)


def notes_of(topics: tuple[Topic, ...], choice: Choice) -> tuple[str, ...]:
    """Tell what was taken and what else could have been, a sentence each."""
    notes = []
    for role, topic in roles_of(choice):
        if topic is not None:
            others = [other.name for other in topics if role.is_offered(other) and other != topic]
            also = f"; {', '.join(others)} could be as well ({role.option})" if others else ""
            what = f"{topic.count} messages of {topic.name} ({short(topic.kind)}){also}"
            notes.append(f"{role.name.capitalize()} are {what}.")
    return tuple(notes)


def _choose(role: Role, topics: tuple[Topic, ...], name: str, where: str) -> Topic | None:
    if not name:
        return min(filter(role.is_offered, topics), key=role.order, default=None)
    named = {topic.name: topic for topic in topics}
    if (topic := named.get(name) or named.get(f"/{name}")) is None:
        raise LogError(f"{where}: no topic '{name}'; {nearest(name, named)}")
    if not role.can_be(topic):
        raise LogError(f"{where}: topic {topic.name} cannot be {role.name}: {role.why_not(topic)}")
    return topic


def _kind_of(topic: Topic, wanted: str, where: str) -> str:
    said = KIND_OF[short(topic.kind)]
    if not said and not wanted:
        remedy = "add --kind duty, wheel_speed or twist, or leave commands out by --commands none"
        raise LogError(f"{where}: topic {topic.name} does not say what its two numbers are; {remedy}")
    if said and wanted and said != wanted:
        raise LogError(f"{where}: topic {topic.name} holds commands of kind {said}, not {wanted}; leave --kind out")
    return said or wanted


def _nothing(role: Role, topics: tuple[Topic, ...], where: str) -> str:
    if left := [topic.name for topic in topics if role.can_be(topic)]:
        return f"{where}: no topic is plainly {role.name}; name one of {', '.join(left)} by {role.option}"
    return f"{where}: no topic has {role.name}, which are messages of type {', '.join(role.ranks)}; record one"


def _taken_for(topic: Topic, choice: Choice) -> str:
    roles = roles_of(choice)
    for role, taken in roles:
        if topic == taken:
            return role.name
    if choice.of_transforms and topic.kind in TRANSFORMS and topic.count:
        return POSE_ROLE.name
    if choice.commands is not None and choice.commands.kind == VESC and topic.name == servo_of(choice.commands.name):
        return COMMAND_ROLE.name
    if fitting := [role for role, _ in roles if role.is_offered(topic)]:
        return f"left out: could be {fitting[0].name} as well ({fitting[0].option})"
    if named := [role.option for role, _ in roles if role.can_be(topic)]:
        return f"left out: taken only where it is named ({' or '.join(named)})"
    near = [role for role, _ in roles if short(topic.kind) in role.ranks]
    return f"left out: {near[0].why_not(topic)}" if near else "left out: neither commands, poses nor pictures"


def read_bag(path: Path, wanted: Wanted) -> Source:
    """Read a ROS bag, or a folder of bags with a drive each, of the same topics.

    The path is a ROS 1 file, a ROS 2 folder or storage file (sqlite3 or mcap), or a folder of such.
    """
    bags = bags_in(path)
    topics, notes = _list(path, bags)
    choice = choose(topics, wanted, str(path))
    if choice.of_transforms and not choice.transform:
        first = next(iter(bags.values()))
        with open_bag(first) as opened:
            transforms = read_transforms(opened)
        choice = replace(choice, transform=choose_transform(transforms, f"{first}: {choice.poses.name}"))
    drives: list[Drive] = []
    said: list[tuple[str, str]] = []
    notes = [*notes_of(topics, choice), *notes]
    for name, bag in bags.items():
        drive, own = _read_drive(name, bag, choice, wanted)
        drives.append(drive)
        said += [(name, note) for note in dict.fromkeys(own)]
    notes += [note if len(bags) == 1 else f"{who}: {note}" for who, note in told_once(said, len(bags), "drives")]
    forms = sorted({form_of(bag) for bag in bags.values()})
    form = forms[0] if len(bags) == 1 else f"{len(bags)} bags: {', '.join(forms)}"
    return Source(form, tuple(drives), channels_of(topics, choice), tuple(dict.fromkeys(notes)))


def _list(path: Path, bags: dict[str, Path]) -> tuple[tuple[Topic, ...], list[str]]:
    """The topics of all bags together; one that a bag lacks counts as without messages there."""
    listed, notes = [], []
    for bag_path in bags.values():
        with open_bag(bag_path) as bag:
            if not any(topic.count for topic in bag.topics):
                raise LogError(f"{bag_path}: holds no messages; record it again, or leave it out")
            listed.append({topic.name: topic for topic in bag.topics})
            if not bag.defines_types:
                notes.append(f"{bag_path.name} does not define its types of message: those of ROS 2 Humble were taken.")
    names = sorted({name for topics in listed for name in topics})
    merged = []
    for name in names:
        own = [topics[name] for topics in listed if name in topics]
        kind = own[0].kind if len({topic.kind for topic in own}) == 1 else "several types"
        known, lacking = all(topic.known for topic in own), len(bags) - sum(topic.count > 0 for topic in own)
        merged.append(Topic(name, kind, sum(topic.count for topic in own), known, lacking))
    return pair_topics(tuple(merged)), notes


def _read_drive(name: str, path: Path, choice: Choice, wanted: Wanted) -> tuple[Drive, list[str]]:
    """One bag as a drive, and what there is to say of it."""
    commands, wheels, pictures = None, None, None
    said: list[str] = []
    with open_bag(path) as bag:
        if choice.commands is not None:
            if choice.commands.kind == VESC:
                commands, notes = read_vesc(bag, choice.commands.name, wanted.vesc)
            else:
                commands, notes = read_commands(bag, choice.commands.name, choice.kind, wanted.stamps)
            said += notes
        if choice.of_transforms:
            where = f"{bag.path}: {choice.poses.name}"
            poses, notes = read_chain(read_transforms(bag), choice.transform, wanted.stamps, where)
        else:
            poses, notes = read_poses(bag, choice.poses.name, wanted.stamps)
        said += notes
        if choice.wheels is not None:
            wheels, notes = read_wheels(bag, choice.wheels.name, wanted.stamps)
            said += notes
        if choice.pictures is not None:
            pictures, notes = read_pictures(bag, choice.pictures.name, wanted.stamps)
            said += notes
    return Drive(name, commands, poses, pictures, wheels), said
